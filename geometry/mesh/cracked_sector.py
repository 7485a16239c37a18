"""The sector of a cracked tooth: the crack is a line of the mesh whose nodes, but for its tip, are there twice.

Cuts and hub circle carry the nodes of the sound sector, so that both kinds fit into one ring.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.grading import (
    DEFAULT,
    Chain,
    graded_outline,
    half_boundary,
    outline_nodes,
    size_samples,
    spaced_nodes,
)
from gearbench.geometry.mesh.sector_mesh import gmsh_session
from gearbench.geometry.tooth.crack import Slit, slit
from gearbench.geometry.tooth.outline import Segment
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TIP = 80  # elements at the crack's tip are this much shorter than the crack
FINEST = 1e-3  # modules: but no shorter than this
FLIP = np.array([1.0, -1.0])


@dataclass(frozen=True)
class CrackedSector:
    """A tooth sector with a crack, as `SectorMesh` but without its symmetry.

    `faces` (k, 3): edges (corner, corner, middle) of both faces of the crack, none where it is `healed`; `line`
    (2 m + 1,): nodes along the crack from the fillet to the tip, corners and middles alternating, on its right side.
    """

    teeth: int
    points: Array
    triangles: Index
    cut_low: Index
    cut_high: Index
    hub: Index
    boundary_edges: Index
    faces: Index
    line: Index


def cracked_sector(
    tooth: Profile, gear: Gear, element_size: float | None = None, *, healed: bool = False, name: str = "gear"
) -> CrackedSector:
    """Mesh the sector of the cracked tooth of a gear whose crack has a length. `element_size` [m]: as in `sector_mesh`.

    healed: the same mesh, its crack grown together. Raises GeometryError.
    """
    if gear.crack is None:
        raise GeometryError(f"{name} has no crack to mesh")
    size = gear.module / 12 if element_size is None else element_size
    cut = slit(tooth, gear, gear.crack, name)
    sides, along = _sides(tooth, gear, cut, size)
    ring = np.concatenate([chain.corners[:-1] for chain in sides])
    mouth = int(np.argmin(np.linalg.norm(ring - cut.start, axis=1)))
    corners, triangles = _fill(ring, mouth, cut.points(along[1:]))
    mesh = _second_order(tooth.teeth, sides, corners, triangles, mouth, len(along) - 1)
    return mesh if healed else opened(mesh, cut)


def _sides(tooth: Profile, gear: Gear, cut: Slit, size: float) -> tuple[tuple[Chain, ...], Array]:
    """The sides of the whole sector counter-clockwise (outline, upper cut, hub, lower cut), and distances of the
    crack's corner nodes from its start."""
    beside = half_boundary(tooth, gear.hub_radius, size)
    pieces, cloud = graded_outline(tooth, size, DEFAULT)
    finest = min(size, max(cut.length / TIP, min(FINEST * tooth.module, cut.length / 8)))
    there = np.linspace(0.0, cut.length, 4 * TIP)
    sizes = np.minimum(size, finest + cloud.growth * (cut.length - there))
    samples = size_samples(cut.length, lambda t: np.interp(t, there, sizes))
    along, _ = spaced_nodes(*samples, 2)
    steps = np.linalg.norm(np.diff(beside.cut.corners, axis=0), axis=1)
    cloud = cloud.and_at(beside.cut.mids, steps)
    upper = outline_nodes(_split(pieces, cut), cloud.and_at(cut.points(there), sizes))
    lower = _flipped(outline_nodes(pieces, cloud.and_at(cut.points(there) * FLIP, sizes)))
    high, hub = beside.cut, beside.hub
    turn = -2 * pi / tooth.teeth
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    low = Chain(high.corners[::-1] @ matrix.T, high.mids[::-1] @ matrix.T)
    sides = (_joined(lower, upper), high, _joined(hub, _flipped(hub)), low)
    return sides, along


def _split(pieces: list[Segment], cut: Slit) -> list[Segment]:
    """The outline's pieces with a joint where the crack starts."""
    out: list[Segment] = []
    for piece in pieces:
        if piece.name != "fillet":
            out.append(piece)
            continue
        at, whole = cut.along, piece
        before, after = whole.samples[whole.samples < at], whole.samples[whole.samples > at]
        out.append(replace(whole, length=at, samples=np.append(before, at)))
        out.append(
            Segment(
                "fillet",
                whole.length - at,
                partial(_later, whole.points, at),
                partial(_later, whole.curvature, at),
                np.concatenate(([0.0], after - at)),
            )
        )
    return out


def _later(function: Callable[[Array], Array], by: float, t: Array) -> Array:
    """A curve's value `by` further along it."""
    return function(t + by)


def _flipped(chain: Chain) -> Chain:
    """The mirror image of a chain, walked backwards."""
    return Chain(chain.corners[::-1] * FLIP, chain.mids[::-1] * FLIP)


def _joined(first: Chain, second: Chain) -> Chain:
    return Chain(np.concatenate((first.corners, second.corners[1:])), np.concatenate((first.mids, second.mids)))


def _fill(ring: Array, mouth: int, inner: Array) -> tuple[Array, Index]:
    """Triangulate inside the closed polygon `ring` (n, 2), with the open polygon from its corner `mouth` over `inner`
    (m, 2) among the edges. Returns corners, the first n + m of which are these, and triangles."""
    scale = 1 / np.ptp(ring, axis=0).max()  # gmsh's tolerances are absolute
    given = np.concatenate((ring, inner))
    count = len(ring)
    ends = np.concatenate((np.column_stack((ring, np.roll(ring, -1, axis=0))), _chords(given, mouth, count)))
    middles = 0.5 * scale * (ends[:, :2] + ends[:, 2:])
    lengths = scale * np.hypot(*(ends[:, 2:] - ends[:, :2]).T)

    def size(dim: int, tag: int, x: float, y: float, z: float, before: float) -> float:
        away = np.hypot(middles[:, 0] - x, middles[:, 1] - y)
        return float(np.min(lengths + DEFAULT.growth * np.maximum(away - 0.5 * lengths, 0.0)))

    with gmsh_session() as gmsh:
        gmsh.model.add("gearbench cracked tooth sector")
        try:
            geo, mesh = gmsh.model.geo, gmsh.model.mesh
            nodes = [geo.addPoint(x * scale, y * scale, 0.0) for x, y in given]
            lines = [geo.addLine(nodes[i], nodes[(i + 1) % count]) for i in range(count)]
            crack = [geo.addLine(a, b) for a, b in pairwise([nodes[mouth], *nodes[count:]])]
            surface = geo.addPlaneSurface([geo.addCurveLoop(lines)])
            geo.synchronize()
            mesh.embed(1, crack, 2, surface)
            for line in (*lines, *crack):
                mesh.setTransfiniteCurve(line, 2)
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
            mesh.setSizeCallback(size)
            mesh.generate(2)
            mesh.removeSizeCallback()
            tags, flat, _ = mesh.getNodes()
            _, elements = mesh.getElementsByType(2)
            first = [int(mesh.getNodes(0, node)[0][0]) for node in nodes]
        finally:
            gmsh.model.remove()
    order = {tag: i for i, tag in enumerate(first)}
    for tag in tags:
        order.setdefault(int(tag), len(order))
    corners = np.empty((len(order), 2))
    for tag, point in zip(tags, flat.reshape(-1, 3), strict=True):
        corners[order[int(tag)]] = point[:2] / scale
    corners[: len(given)] = given
    return corners, np.array([order[int(tag)] for tag in elements], dtype=np.int64).reshape(-1, 3)


def _chords(given: Array, mouth: int, count: int) -> Array:
    """Ends (m, 4) of the crack's edges."""
    along = np.concatenate((given[mouth][None], given[count:]))
    return np.column_stack((along[:-1], along[1:]))


def _second_order(
    teeth: int, sides: tuple[Chain, ...], corners: Array, triangles: Index, mouth: int, count: int
) -> CrackedSector:
    """Quadratic triangles with the sides' own middles; `count` edges of the crack follow from the corner `mouth`."""
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inverted = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    triangles = np.where(inverted[:, None], triangles[:, [0, 2, 1]], triangles)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middles = 0.5 * (corners[unique[:, 0]] + corners[unique[:, 1]])
    number = {(int(p), int(q)): i for i, (p, q) in enumerate(unique)}

    def numbered(nodes: Index) -> Index:
        return np.array([number[min(p, q), max(p, q)] for p, q in pairwise(nodes.tolist())])

    walked, start = [], 0
    ring = sum(len(chain.mids) for chain in sides)
    for chain in sides:
        nodes = (start + np.arange(len(chain.corners))) % ring
        index = numbered(nodes)
        middles[index] = chain.mids
        walked.append(np.column_stack((nodes[:-1], nodes[1:], len(corners) + index)))
        start += len(chain.mids)
    nodes = np.concatenate(([mouth], ring + np.arange(count)))
    crack = np.column_stack((nodes[:-1], nodes[1:], len(corners) + numbered(nodes)))
    outline, high, hub, low = walked
    return CrackedSector(
        teeth=teeth,
        points=np.concatenate((corners, middles)),
        triangles=np.column_stack((triangles, len(corners) + inverse.reshape(-1, 3))),
        cut_low=_walk(low),
        cut_high=_walk(high)[::-1],
        hub=_walk(hub)[::-1],
        boundary_edges=outline,
        faces=np.empty((0, 3), dtype=np.int64),
        line=_walk(crack),
    )


def _walk(edges: Index) -> Index:
    """Node numbers along a chain of edges (k, 3), middles included."""
    return np.append(edges[:, [0, 2]].ravel(), edges[-1, 1])


def opened(mesh: CrackedSector, cut: Slit) -> CrackedSector:
    """The mesh with its crack cut open: what lies to the left of the crack, looking along it, gets nodes of its own.

    The faces are free to part and, where they would close, to overlap.
    """
    points, triangles, twin = cut_along(mesh.points, mesh.triangles, mesh.line, cut.direction)
    corners = mesh.line[::2]
    right = np.column_stack((corners[:-1], corners[1:], mesh.line[1::2]))
    left = twin[right]
    outline = mesh.boundary_edges.copy()
    mouth = int(mesh.line[0])
    for row in np.flatnonzero((outline[:, :2] == mouth).any(axis=1)):
        # Of the two edges at the mouth, the one whose triangle has moved to the new node.
        owner = np.flatnonzero((triangles[:, 3:] == outline[row, 2]).any(axis=1))[0]
        if not (triangles[owner, :3] == mouth).any():
            outline[row] = np.where(outline[row] == mouth, twin[mouth], outline[row])
    return replace(
        mesh,
        points=points,
        triangles=triangles,
        boundary_edges=outline,
        faces=np.concatenate((right, left)),
    )


def cut_along(points: Array, triangles: Index, line: Index, direction: Array) -> tuple[Array, Index, Index]:
    """Double the nodes `line` of a straight crack that runs from the boundary in `direction` (2,), but for the last.

    Triangles to its left use the new nodes, which stand at the end. Returns points, triangles and the new number of
    each old node (n,).
    """
    doubled = line[:-1]
    twin = np.arange(len(points))
    twin[doubled] = len(points) + np.arange(len(doubled))
    centre = points[triangles[:, :3]].mean(axis=1) - points[line[0]]
    left = direction[0] * centre[:, 1] - direction[1] * centre[:, 0] > 0
    # Only a triangle that touches the crack has a doubled node at all.
    renamed = np.where(left[:, None], twin[triangles], triangles)
    return np.concatenate((points, points[doubled])), renamed, twin
