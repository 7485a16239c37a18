"""One tooth sector as curved quadratic triangles, and its repetition to a full gear. The only user of gmsh.

gmsh fills the half sector between given straight boundary edges; order two is raised here, so that every
boundary node, mid-side nodes included, lies on the exact profile. The other half is the mirror image.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.element_size import flank_size
from gearbench.geometry.mesh.grading import Chain, HalfBoundary, half_boundary
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_GMSH = threading.Lock()  # gmsh keeps global state
_OPTIONS = (
    ("General.Terminal", 0),
    ("General.NumThreads", 1),  # hence the same mesh every time
    ("Mesh.Algorithm", 6),  # frontal Delaunay
    ("Mesh.MeshSizeExtendFromBoundary", 1),
    ("Mesh.MeshSizeFromPoints", 0),
    ("Mesh.MeshSizeFromCurvature", 0),
    ("Mesh.Smoothing", 10),
)


class MeshingUnavailable(ImportError):
    """gmsh cannot be loaded; the sentence says what to install."""


@dataclass(frozen=True)
class SectorMesh:
    """One tooth sector between the polar angles -pi/z and +pi/z, from the hub circle to the profile.

    `points` (n, 2) [m]; `triangles` (m, 6): three corners counter-clockwise, then the middles of 0-1, 1-2,
    2-0 (gmsh and meshio order). Node numbers: `cut_low`, `cut_high` on the radial cuts, ordered by radius
    (corners and middles alternate), equal under a rotation by 2 pi/z; `hub` on the hub circle by polar angle,
    ends of the cuts included; `boundary_edges` (k, 3) corner, corner, middle along tip land, flanks, fillets
    and root land by polar angle (counter-clockwise: the material lies to the left). The mesh is symmetric:
    `mirror[i]` is the node at (x, -y).
    """

    teeth: int
    points: Array
    triangles: Index
    cut_low: Index
    cut_high: Index
    hub: Index
    boundary_edges: Index
    mirror: Index

    @property
    def cells(self) -> Index:
        """The elements, whatever their kind."""
        return self.triangles


@dataclass(frozen=True)
class GearMesh:
    """A full gear: `points`, `triangles`, `hub`, `boundary_edges` as in SectorMesh; `node_of[k, i]` is the
    number of sector node i in tooth k, whose axis stands at the polar angle 2 pi k/z."""

    teeth: int
    points: Array
    triangles: Index
    hub: Index
    boundary_edges: Index
    node_of: Index

    @property
    def cells(self) -> Index:
        """The elements, whatever their kind."""
        return self.triangles


def sector_mesh(gear_profile: Profile, gear: Gear, element_size: float | None = None) -> SectorMesh:
    """Mesh one tooth sector. `element_size` [m] on flanks and fillets; default module/12.

    Raises GeometryError for an element size outside (module/400, module/2), and MeshingUnavailable without
    gmsh.
    """
    size = flank_size(gear.module, element_size)
    return sector_within(gear_profile.teeth, half_boundary(gear_profile, gear.hub_radius, size))


def sector_within(teeth: int, boundary: HalfBoundary) -> SectorMesh:
    """The sector of a gear with that many teeth whose half has the given nodes on its boundary."""
    ring = np.concatenate([chain.corners[:-1] for chain in sides_of(boundary)])
    corners, triangles, _ = fill(ring)
    points, half, edges = raise_order(corners, _ccw(corners, triangles), boundary)
    # Mirroring turns the triangles over: corners 0 and 1 change places, hence the middles of 1-2 and 2-0.
    whole = mirrored(teeth, points, half, edges, [1, 0, 2, 3, 5, 4])
    return SectorMesh(
        teeth=teeth,
        points=whole.points,
        triangles=whole.cells,
        cut_low=whole.cut_low,
        cut_high=whole.cut_high,
        hub=whole.hub,
        boundary_edges=whole.boundary_edges,
        mirror=whole.mirror,
    )


def sides_of(boundary: HalfBoundary) -> tuple[Chain, Chain, Chain, Chain]:
    """The sides in order around the half sector."""
    return boundary.outline, boundary.cut, boundary.hub, boundary.axis


def _import_gmsh() -> Any:
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise MeshingUnavailable(
            f"gmsh cannot be loaded ({error}); on Debian it needs the packages libgl1 libegl1 libglu1-mesa"
            " libxcursor1 libxft2 libxinerama1 libgomp1"
        ) from error
    return gmsh


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """gmsh, for one thread at a time; someone else's session is left as it was. Raises MeshingUnavailable."""
    gmsh = _import_gmsh()
    with _GMSH:
        ours = not gmsh.isInitialized()
        if ours:
            gmsh.initialize(readConfigFiles=False, interruptible=False)
        before = [] if ours else [(option, gmsh.option.getNumber(option)) for option, _ in _OPTIONS]
        current = "" if ours else gmsh.model.getCurrent()
        try:
            for option, value in _OPTIONS:
                gmsh.option.setNumber(option, value)
            yield gmsh
        finally:
            if ours:
                gmsh.finalize()
            else:
                for option, value in before:
                    gmsh.option.setNumber(option, value)
                gmsh.model.setCurrent(current)


def fill(ring: Array, recombine: bool = False) -> tuple[Array, Index, Index]:
    """Triangulate inside the closed polygon `ring` (n, 2) without adding nodes to it.

    Returns corners (m, 2), the first n of which are the ring, triangles (k, 3) and, where `recombine` makes as many of
    them as it can, quadrilaterals (l, 4). Sizes inside follow the ring's.
    """
    scale = 1 / np.ptp(ring, axis=0).max()  # gmsh's tolerances are absolute
    with gmsh_session() as gmsh:
        return _triangulate(gmsh, ring, scale, recombine)


def _triangulate(gmsh: Any, ring: Array, scale: float, recombine: bool) -> tuple[Array, Index, Index]:
    gmsh.model.add("gearbench tooth sector")
    try:
        geo, count = gmsh.model.geo, len(ring)
        nodes = [geo.addPoint(x * scale, y * scale, 0.0) for x, y in ring]
        lines = [geo.addLine(nodes[i], nodes[(i + 1) % count]) for i in range(count)]
        geo.addPlaneSurface([geo.addCurveLoop(lines)])
        geo.synchronize()
        for line in lines:
            gmsh.model.mesh.setTransfiniteCurve(line, 2)
        gmsh.model.mesh.generate(2)
        if recombine:
            gmsh.model.mesh.recombine()
        tags, flat, _ = gmsh.model.mesh.getNodes()
        found = [gmsh.model.mesh.getElementsByType(kind)[1] for kind in (2, 3)]
        first = [int(gmsh.model.mesh.getNodes(0, node)[0][0]) for node in nodes]
    finally:
        gmsh.model.remove()
    order = {tag: i for i, tag in enumerate(first)}
    for tag in tags:
        order.setdefault(int(tag), len(order))
    corners = np.empty((len(order), 2))
    for tag, point in zip(tags, flat.reshape(-1, 3), strict=True):
        corners[order[int(tag)]] = point[:2] / scale
    corners[:count] = ring
    triangles, quads = (
        np.array([order[int(tag)] for tag in elements], dtype=np.int64).reshape(-1, sides)
        for elements, sides in zip(found, (3, 4), strict=True)
    )
    return corners, triangles, quads


def _ccw(points: Array, triangles: Index) -> Index:
    """The triangles (m, 3) with their corners counter-clockwise."""
    one, two = (
        points[triangles[:, 1]] - points[triangles[:, 0]],
        points[triangles[:, 2]] - points[triangles[:, 0]],
    )
    swap = one[:, 0] * two[:, 1] < one[:, 1] * two[:, 0]
    turned = triangles.copy()
    turned[swap] = turned[swap][:, [0, 2, 1]]
    return turned


def raise_order(corners: Array, cells: Index, boundary: HalfBoundary) -> tuple[Array, Index, list[Index]]:
    """Mid-side nodes of cells (m, k): straight inside, the given ones on the boundary.

    Returns points, cells (m, 2 k) and, for each side of the boundary, its edges (n, 3) corner, corner, middle.
    """
    k = cells.shape[1]
    edges = np.sort(cells[:, [[i, (i + 1) % k] for i in range(k)]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middles = 0.5 * (corners[unique[:, 0]] + corners[unique[:, 1]])
    number = {(int(a), int(b)): i for i, (a, b) in enumerate(unique)}
    sides, start = [], 0
    ring = sum(len(chain.mids) for chain in sides_of(boundary))
    for chain in sides_of(boundary):
        nodes = (start + np.arange(len(chain.corners))) % ring
        index = np.array([number[min(a, b), max(a, b)] for a, b in pairwise(nodes.tolist())])
        middles[index] = chain.mids
        sides.append(np.column_stack((nodes[:-1], nodes[1:], len(corners) + index)))
        start += len(chain.mids)
    return (
        np.concatenate((corners, middles)),
        np.column_stack((cells, len(corners) + inverse.reshape(-1, k))),
        sides,
    )


def _walk(edges: Index) -> Index:
    """Node numbers along a chain of edges (k, 3), middles included."""
    return np.append(edges[:, [0, 2]].ravel(), edges[-1, 1])


class Whole(NamedTuple):
    """Fields of a whole sector, as in SectorMesh; `cells` of any kind."""

    points: Array
    cells: Index
    cut_low: Index
    cut_high: Index
    hub: Index
    boundary_edges: Index
    mirror: Index


def mirrored(teeth: int, points: Array, half: Index, sides: list[Index], turned: list[int]) -> Whole:
    """The whole sector from its counter-clockwise half; `turned` is the order of a mirrored cell's nodes."""
    outline, cut, hub, axis = sides
    on_axis = _walk(axis)
    points[on_axis, 1] = 0.0
    n = len(points)
    image = np.full(n, -1, dtype=np.int64)
    image[on_axis] = on_axis
    free = np.flatnonzero(image < 0)
    image[free] = n + np.arange(len(free))
    angle = 2 * pi / teeth
    low, high = image[_walk(cut)][::-1], _walk(cut)[::-1]
    points = np.concatenate((points, points[free] * [1.0, -1.0]))
    points[low] = points[high] @ _rotation(-angle).T
    return Whole(
        points=points,
        cells=np.concatenate((half, image[half][:, turned])),
        cut_low=low,
        cut_high=high,
        hub=np.concatenate((image[_walk(hub)], _walk(hub)[-2::-1])),
        boundary_edges=np.concatenate((image[outline][::-1][:, [1, 0, 2]], outline)),
        mirror=np.concatenate((image, free)),
    )


def _rotation(angle: float) -> Array:
    """Matrix (2, 2) of a counter-clockwise rotation."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def full_mesh(sector: SectorMesh, teeth: int | None = None) -> GearMesh:
    """The gear of `teeth` (default: the sector's own number) sectors, each an exact rotation; cut nodes are
    shared."""
    z = sector.teeth if teeth is None else teeth
    if z != sector.teeth:
        raise GeometryError(f"teeth = {z} cannot be made of sectors of a gear with {sector.teeth} teeth")
    points, node_of = repeated(z, sector.points, sector.cut_low, sector.cut_high)
    return GearMesh(
        teeth=z,
        points=points,
        triangles=node_of[:, sector.triangles].reshape(-1, 6),
        hub=np.unique(node_of[:, sector.hub]),
        boundary_edges=node_of[:, sector.boundary_edges].reshape(-1, 3),
        node_of=node_of,
    )


def repeated(teeth: int, points: Array, cut_low: Index, cut_high: Index) -> tuple[Array, Index]:
    """A sector's nodes turned to every tooth, those of the cuts once, and their numbers (teeth, nodes)."""
    n = len(points)
    kept = np.setdiff1d(np.arange(n), cut_high)
    node_of = np.empty((teeth, n), dtype=np.int64)
    node_of[:, kept] = np.arange(teeth)[:, None] * len(kept) + np.arange(len(kept))
    node_of[:, cut_high] = np.roll(node_of[:, cut_low], -1, axis=0)
    return np.concatenate([points[kept] @ _rotation(2 * pi * k / teeth).T for k in range(teeth)]), node_of
