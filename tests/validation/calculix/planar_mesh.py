"""Second-order triangle mesh of a whole gear in its working position, refined where it will touch.

Every boundary node, mid-side nodes included, is computed from the exact profile; gmsh only fills the inside.
Lengths in mm, as in the CalculiX deck.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gearbench.geometry.tooth.profile import Profile, radial

Array = NDArray[np.float64]
GROWTH = 0.22  # of element size per distance
TURNING = 0.4  # of the boundary along an element [rad]


@dataclass(frozen=True)
class Spot:
    """Elements of `size` within `flat` of the point `at` (2,) (world, mm); growing with the distance
    outside."""

    at: Array
    size: float
    flat: float


@dataclass(frozen=True)
class PlanarMesh:
    """points (n, 2); triangles (m, 6), corners counter-clockwise, then the mid-side nodes of 1-2, 2-3, 3-1;
    hub (k,) nodes; flank: edges (element, local edge 0..2) of each tooth's working flank and tip edge, and of
    the fillet where that undercuts."""

    points: Array
    triangles: NDArray[np.int64]
    hub: NDArray[np.int64]
    flank: dict[int, NDArray[np.int64]]


def size_field(
    spots: list[Spot], centre: Array, root: float, largest: float, growth: float
) -> Callable[[Array], Array]:
    """Element size at points (n, 2): that of the spots, `largest` on far teeth, up to three times that in the
    body inside the root radius."""
    at = np.array([spot.at for spot in spots])
    size = np.array([spot.size for spot in spots])
    flat = np.array([spot.flat for spot in spots])

    def field(points: Array) -> Array:
        depth = root - np.hypot(points[:, 0] - centre[0], points[:, 1] - centre[1])
        out = np.clip(largest + growth * depth, largest, 3 * largest)
        for p, s, f in zip(at, size, flat, strict=True):
            distance = np.hypot(points[:, 0] - p[0], points[:, 1] - p[1])
            np.minimum(out, s + growth * np.maximum(distance - f, 0.0), out=out)
        return out

    return field


def half_tooth(shape: Profile) -> list[tuple[str, Callable[[Array], Array]]]:
    """The counter-clockwise half of the outline, root to tip, each piece over t in [0, 1]; gear frame, m."""
    start = pi / shape.teeth
    land = start - shape.root_half_angle
    pieces: list[tuple[str, Callable[[Array], Array]]] = []
    if shape.root_half_angle * shape.root_radius > 1e-9:
        pieces.append(("root", lambda t: shape.root_radius * radial(start + t * (land - start))))
    pieces.append(("fillet", lambda t: shape.fillet(shape.beta_form * t)))
    rho = (shape.rho_form, shape.rho_end)
    pieces.append(("involute", lambda t: shape.involute(rho[0] + t * (rho[1] - rho[0]))))
    pieces.append(("edge", lambda t: shape.points(shape.s_end + t * (shape.s_tip - shape.s_end) * (1 - 1e-15))))
    pieces.append(("tip", lambda t: shape.tip_radius * radial(shape.tip_half_angle * (1 - t))))
    return pieces


def divide(curve: Callable[[Array], Array], field: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Corner and mid-side nodes (k + 1, 2), (k, 2) of a curve over [0, 1], spaced as the size field and its
    own turning want."""

    def counted(t: Array) -> tuple[Array, Array]:
        """Arc length and number of elements up to t."""
        points = curve(t)
        chord = np.diff(points, axis=0)
        step = np.hypot(*chord.T)
        size = field(points)
        direction = np.unwrap(np.arctan2(chord[:, 1], chord[:, 0]))
        bend = np.abs(np.gradient(direction)) / TURNING
        density = np.maximum(step * 0.5 * (1 / size[1:] + 1 / size[:-1]), bend)
        return np.concatenate([[0.0], np.cumsum(step)]), np.concatenate([[0.0], np.cumsum(density)])

    t = np.linspace(0.0, 1.0, 201)
    for _ in range(3):  # the sampling itself follows the field
        _, count = counted(t)
        fine = np.linspace(0.0, count[-1], max(201, 16 * int(count[-1])))
        t = np.interp(fine, count, t)
        t[0], t[-1] = 0.0, 1.0
    length, count = counted(t)
    wanted = np.linspace(0.0, count[-1], max(int(np.ceil(count[-1])), 1) + 1)
    at = np.interp(wanted, count, t)
    at[0], at[-1] = 0.0, 1.0
    arc = np.interp(at, t, length)
    return curve(at), curve(np.interp(0.5 * (arc[1:] + arc[:-1]), length, t))


@dataclass(frozen=True)
class Outline:
    """A closed loop: corners (k, 2), mid-side nodes (k, 2) after each corner, tooth whose working flank it is
    or a large negative number (k,)."""

    corners: Array
    mids: Array
    flank: NDArray[np.int64]


NO_FLANK = -1000


def outline(shape: Profile, placed: Callable[[int], tuple[Array, Array]], turn: int, field: Callable) -> Outline:
    """The whole gear's outline, counter-clockwise. `placed(j)` is tooth j's rotation matrix and the centre
    (mm); `turn` is +1 where tooth numbers grow counter-clockwise, else -1."""
    corners, mids, flank = [], [], []
    for i in range(shape.teeth):
        j = turn * (i - shape.teeth // 2)
        matrix, centre = placed(j)
        for mirrored in (True, False):
            pieces = half_tooth(shape)
            for name, piece in pieces if mirrored else pieces[::-1]:
                flip = np.array([1.0, -1.0 if mirrored else 1.0])

                def curve(t: Array, piece=piece, flip=flip, mirrored=mirrored, m=matrix, c=centre) -> Array:
                    return c + 1e3 * (piece(t if mirrored else 1.0 - t) * flip) @ m.T

                ends, middles = divide(curve, field)
                corners.append(ends[:-1])
                mids.append(middles)
                # An undercut fillet turns away from the flank in a corner, about which the mate may bend.
                touched = ("fillet", "involute", "edge") if shape.undercut else ("involute", "edge")
                working = not mirrored and name in touched
                flank.append(np.full(len(middles), j if working else NO_FLANK))
    return Outline(np.concatenate(corners), np.concatenate(mids), np.concatenate(flank))


def circle(centre: Array, radius: float, count: int) -> tuple[Array, Array]:
    """Corners and mid-side nodes of a circle."""
    angle = 2 * pi * np.arange(count) / count
    return centre + radius * radial(angle), centre + radius * radial(angle + pi / count)


def triangulate(loops: list[Array], field: Callable[[Array], Array]) -> tuple[Array, NDArray[np.int64]]:
    """First-order triangles between an outer and an inner loop of corners, none of which is divided
    further."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        geo = gmsh.model.geo
        wires = []
        for loop in loops:
            tags = [geo.addPoint(float(x), float(y), 0.0) for x, y in loop]
            lines = [geo.addLine(p, q) for p, q in zip(tags, tags[1:] + tags[:1], strict=True)]
            for line in lines:
                geo.mesh.setTransfiniteCurve(line, 2)
            wires.append(geo.addCurveLoop(lines))
        geo.addPlaneSurface(wires)
        geo.synchronize()
        gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, lc: float(field(np.array([[x, y]]))[0]))
        gmsh.model.mesh.generate(2)
        tags, xyz, _ = gmsh.model.mesh.getNodes()
        _, cells = gmsh.model.mesh.getElementsByType(2)
    finally:
        gmsh.finalize()
    index = np.full(int(tags.max()) + 1, -1)
    cells = cells.reshape(-1, 3).astype(int)
    used = np.unique(cells)
    order = np.searchsorted(tags[np.argsort(tags)], used)
    points = xyz.reshape(-1, 3)[np.argsort(tags)[order], :2]
    index[used] = np.arange(len(used))
    triangles = index[cells]
    p = points[triangles]
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    return points, triangles


def second_order(
    points: Array, triangles: NDArray[np.int64], loops: list[tuple[Array, Array]]
) -> tuple[Array, NDArray[np.int64], list[NDArray[np.int64]], list[NDArray[np.int64]]]:
    """Add mid-side nodes: exact ones on the loops, straight ones inside. Also per loop: its corner nodes in
    order and (element, local edge) of each of its edges."""
    local = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges, inverse = np.unique(np.sort(local, axis=1), axis=0, return_inverse=True)
    inverse = inverse.ravel()
    mids = points[edges].mean(axis=1)
    tree = cKDTree(points)
    key = {tuple(e): k for k, e in enumerate(edges.tolist())}
    first = np.full(len(edges), -1)
    first[inverse] = np.arange(len(inverse))
    corner_nodes, sides = [], []
    for corners, exact in loops:
        distance, nodes = tree.query(corners)
        assert distance.max() < 1e-9
        ids = np.array([key[tuple(sorted(e))] for e in zip(nodes.tolist(), np.roll(nodes, -1).tolist(), strict=True)])
        mids[ids] = exact
        corner_nodes.append(np.concatenate([nodes, len(points) + ids]))
        sides.append(np.column_stack([first[ids] // 3, first[ids] % 3]))
    cells = np.column_stack([triangles, len(points) + inverse.reshape(-1, 3)])
    return np.concatenate([points, mids]), cells, corner_nodes, sides


def jacobian_ratio(points: Array, cells: NDArray[np.int64]) -> Array:
    """Smallest Jacobian at an element's nodes over its mean, (m,); negative: an inverted element."""
    reference = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
    x, y = reference.T
    z = 1 - x - y
    dx = np.array([1 - 4 * z, 4 * x - 1, 0 * x, 4 * (z - x), 4 * y, -4 * y])
    dy = np.array([1 - 4 * z, 0 * y, 4 * y - 1, -4 * x, 4 * x, 4 * (z - y)])
    p = points[cells]
    a, b = np.einsum("kn,mkd->mnd", dx, p), np.einsum("kn,mkd->mnd", dy, p)
    det = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return det.min(axis=1) / det.mean(axis=1)


def straightened(points: Array, cells: NDArray[np.int64], spots: list[Spot]) -> Array:
    """Points with straight edges where curved ones distort an element (tip edges of unloaded teeth). Raises
    RuntimeError if that is needed where the mesh is meant to be fine."""
    points = points.copy()
    bad = cells[jacobian_ratio(points, cells) < 0.15]
    points[bad[:, 3:]] = 0.5 * (points[bad[:, :3]] + points[np.roll(bad[:, :3], -1, axis=1)])
    for at in points[bad].mean(axis=1):
        if any(np.hypot(*(at - s.at)) < s.flat + 20 * s.size for s in spots if s.size < 0.05):
            raise RuntimeError(f"distorted element at {at} mm, close to a contact")
    worst = jacobian_ratio(points, cells).min()
    if worst < 0.1:
        raise RuntimeError(f"distorted element: ratio of Jacobians {worst:.3g}")
    return points


def gear_mesh(
    shape: Profile,
    placed: Callable[[int], tuple[Array, Array]],
    turn: int,
    hub_radius: float,
    spots: list[Spot],
    *,
    level: float,
) -> PlanarMesh:
    """Mesh of a whole gear (hub radius in mm). `level` scales every size of the body, not those of the
    spots."""
    largest = 0.7e3 * shape.module * level
    _, centre = placed(0)
    growth = GROWTH * min(1.0, 0.5 + 0.5 * level)
    field = size_field(spots, centre, 1e3 * shape.root_radius, largest, growth)
    rim = outline(shape, placed, turn, field)
    hub_size = field(centre[None] + [hub_radius, 0.0])[0]
    hub = circle(centre, hub_radius, int(np.ceil(2 * pi * hub_radius / hub_size)))
    points, triangles = triangulate([rim.corners, hub[0]], field)
    loops = [(rim.corners, rim.mids), hub]
    points, cells, nodes, sides = second_order(points, triangles, loops)
    points = straightened(points, cells, spots)
    teeth = {int(j): sides[0][rim.flank == j] for j in np.unique(rim.flank) if j != NO_FLANK}
    return PlanarMesh(points, cells, nodes[1], teeth)


def rotation(angle: float) -> Array:
    """Matrix (2, 2) of a counter-clockwise rotation."""
    return np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
