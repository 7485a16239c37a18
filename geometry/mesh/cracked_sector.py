"""The sector of a cracked tooth: the crack is a line of the mesh whose nodes, but for its tip, are there twice.

Cuts and hub circle carry the nodes of the sound sector, so that both kinds fit into one ring.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.element_size import flank_size
from gearbench.geometry.mesh.filling import Branch, fill, raise_order, ring_of, walk
from gearbench.geometry.mesh.grading import (
    DEFAULT,
    Chain,
    graded_outline,
    half_boundary,
    outline_nodes,
    size_samples,
    spaced_nodes,
)
from gearbench.geometry.mesh.values import CrackNodes, SectorMesh
from gearbench.geometry.tooth.crack import Slit, slit
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.outline import Segment
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TIP = 80  # elements at the crack's tip are this much shorter than the crack
FINEST = 1e-3  # modules: but no shorter than this
FLIP = np.array([1.0, -1.0])


def cracked_sector(
    tooth: Profile, gear: Gear, element_size: float | None = None, *, healed: bool = False, name: str = "gear"
) -> SectorMesh:
    """Mesh the sector of the cracked tooth of a gear whose crack has a length. `element_size` [m]: as in `sector_mesh`.

    healed: the same mesh, its crack grown together. Raises GeometryError.
    """
    if gear.crack is None:
        raise GeometryError(f"{name} has no crack to mesh")
    size = flank_size(gear.module, element_size)
    cut = slit(tooth, gear, gear.crack, name)
    sides, along = _sides(tooth, gear, cut, size)
    ring = ring_of(sides)
    mouth = int(np.argmin(np.linalg.norm(ring - cut.start, axis=1)))
    inner = cut.points(along[1:])
    corners, triangles, _ = fill(ring, branch=Branch(mouth, inner))
    crack = np.concatenate(([mouth], len(ring) + np.arange(len(inner))))
    points, cells, edges = raise_order(corners, triangles, sides, [crack])
    outline, high, hub, low, line = edges
    mesh = SectorMesh(
        points=points,
        cells=cells,
        teeth=tooth.teeth,
        cut_low=walk(low),
        cut_high=walk(high)[::-1],
        hub=walk(hub)[::-1],
        boundary_edges=outline,
    )
    return _cut_open(mesh, walk(line), cut, healed)


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
    matrix = rotation(-2 * pi / tooth.teeth)
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


def _cut_open(mesh: SectorMesh, line: Index, cut: Slit, healed: bool) -> SectorMesh:
    """The mesh with its crack cut open along the nodes `line`, unless it is healed: what lies to the left of the crack,
    looking along it, gets nodes of its own.

    The faces are free to part and, where they would close, to overlap.
    """
    if healed:
        return replace(mesh, crack=CrackNodes(faces=np.empty((0, 3), dtype=np.int64), line=line))
    points, triangles, twin = cut_along(mesh.points, mesh.cells, line, cut.direction)
    corners = line[::2]
    right = np.column_stack((corners[:-1], corners[1:], line[1::2]))
    outline = mesh.boundary_edges.copy()
    mouth = int(line[0])
    for row in np.flatnonzero((outline[:, :2] == mouth).any(axis=1)):
        # Of the two edges at the mouth, the one whose triangle has moved to the new node.
        owner = np.flatnonzero((triangles[:, 3:] == outline[row, 2]).any(axis=1))[0]
        if not (triangles[owner, :3] == mouth).any():
            outline[row] = np.where(outline[row] == mouth, twin[mouth], outline[row])
    faces = np.concatenate((right, twin[right]))
    return replace(mesh, points=points, cells=triangles, boundary_edges=outline, crack=CrackNodes(faces, line))


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
