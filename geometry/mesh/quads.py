"""One tooth sector as curved quadrilaterals of second order (nine nodes).

gmsh fills every second edge of the boundary with triangles and joins them to quadrilaterals where it can; each of both
is then divided at the middles of its sides, which leaves quadrilaterals alone.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.mesh.element_size import flank_size
from gearbench.geometry.mesh.filling import fill, raise_order, ring_of
from gearbench.geometry.mesh.grading import Grading, HalfBoundary, half_boundary
from gearbench.geometry.mesh.sector_mesh import mirrored
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]
Index = NDArray[np.int64]

GRADING = Grading(growth=0.22, bend=0.3, even=True)
# Rounds in which free corners move towards the middle of their neighbours.
SMOOTHING = 4
# A corner of the boundary that turns by less is smooth [rad].
FLAT = 1.0
# A mirrored cell's nodes: corners 0 and 1, 2 and 3 change places.
TURNED = [1, 0, 3, 2, 4, 7, 6, 5, 8]


def quad_sector_mesh(tooth: Profile, gear: Gear, element_size: float | None = None) -> SectorMesh:
    """Mesh one tooth sector with quadrilaterals. `element_size` [m] and errors as in `sector_mesh`."""
    boundary = half_boundary(tooth, gear.hub_radius, flank_size(gear.module, element_size), GRADING)
    corners, quads = _divided(boundary)
    points, half, sides = raise_order(corners, quads, boundary.sides)
    corner, middle = points[half[:, :4]].sum(axis=1), points[half[:, 4:]].sum(axis=1)
    # The centre of the cell that its four sides span (Coons).
    centres = 0.5 * middle - 0.25 * corner
    half = np.column_stack((half, len(points) + np.arange(len(half))))
    return mirrored(tooth.teeth, np.concatenate((points, centres)), half, sides, TURNED)


def _divided(boundary: HalfBoundary) -> tuple[Array, Index]:
    """Corners (n, 2), those of the boundary first, and quadrilaterals (m, 4) inside it."""
    ring = ring_of(boundary.sides)
    coarse, triangles, quads = fill(ring[::2], recombine=True)
    coarse, *cells = _without_ears(coarse, triangles, _ccw(coarse, quads), ring[::2])
    count = len(coarse)
    edges = [np.sort(np.stack((cell, np.roll(cell, -1, axis=1)), axis=2), axis=2) for cell in cells]
    unique, inverse = np.unique(np.concatenate([e.reshape(-1, 2) for e in edges]), axis=0, return_inverse=True)
    middles = 0.5 * (coarse[unique[:, 0]] + coarse[unique[:, 1]])
    last = len(ring) // 2 - 1
    on_ring = (unique[:, 1] <= last) & np.isin(unique[:, 1] - unique[:, 0], (1, last))
    before = np.where(unique[:, 1] - unique[:, 0] == 1, unique[:, 0], last)
    middles[on_ring] = ring[1::2][before[on_ring]]
    points, found, used = [coarse, middles], [], 0
    total = count + len(middles)
    for cell in cells:
        sides = count + inverse.reshape(-1)[used : used + cell.size].reshape(cell.shape)
        used += cell.size
        centre = total + np.arange(len(cell))
        total += len(cell)
        points.append(middles[sides - count].mean(axis=1))
        for i in range(cell.shape[1]):
            found.append(np.column_stack((cell[:, i], sides[:, i], centre, sides[:, i - 1])))
    return _boundary_first(np.concatenate(points), _ccw(np.concatenate(points), np.concatenate(found)), ring)


def _ccw(points: Array, cells: Index) -> Index:
    """Cells (m, 3 or 4) with their corners counter-clockwise."""
    one, two = points[cells[:, 2]] - points[cells[:, 0]], points[cells[:, -1]] - points[cells[:, 1]]
    clockwise = one[:, 0] * two[:, 1] < one[:, 1] * two[:, 0]
    turned = cells.copy()
    turned[clockwise] = turned[clockwise][:, ::-1]
    return turned


def _without_ears(corners: Array, triangles: Index, quads: Index, ring: Array) -> tuple[Array, Index, Index]:
    """Cells of which none has two sides on the boundary where that is smooth: there its corner would be flat.

    The nodes of the ring (n, 2) come first among the `corners`. Returns corners, triangles and quadrilaterals.
    """
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    turn = np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], np.sum(before * after, axis=1))
    flat = {int(i) for i in np.flatnonzero(np.abs(turn) < FLAT)}
    n = len(ring)
    points = corners.tolist()
    cells = [tuple(cell) for cell in (*triangles.tolist(), *quads.tolist())]

    def ear(cell: tuple[int, ...]) -> int | None:
        """Position of a cell's corner that lies flat between two sides on the boundary."""
        for i, corner in enumerate(cell):
            beside = {cell[i - 1], cell[(i + 1) % len(cell)]}
            if corner in flat and beside == {(corner - 1) % n, (corner + 1) % n}:
                return i
        return None

    for cell in list(cells):
        at = ear(cell)
        if at is None or cell not in cells:
            continue
        cells.remove(cell)
        first, *others = cell[at:] + cell[:at]
        if len(cell) == 3:
            # Join it with the cell beyond its third side, so that the corner gets a side inside.
            u, v = others
            beyond = next(c for c in cells if u in c and v in c)
            cells.remove(beyond)
            start = beyond.index(u)
            others = [u, *(beyond + beyond)[start + 1 : start + len(beyond) - 1], v]
        fan = [(first, one, two) for one, two in pairwise(others)]
        if any(ear(c) is not None for c in fan):
            loop = [first, *others]
            fan = [(one, two, len(points)) for one, two in pairwise([*loop, first])]
            points.append(np.mean([points[i] for i in loop], axis=0).tolist())
        cells += fan
    return np.array(points), _of_length(cells, 3), _of_length(cells, 4)


def _of_length(cells: list[tuple[int, ...]], corners: int) -> Index:
    return np.array([cell for cell in cells if len(cell) == corners], dtype=np.int64).reshape(-1, corners)


def _boundary_first(points: Array, quads: Index, ring: Array) -> tuple[Array, Index]:
    """Renumber the nodes so that the ring's come first and in its order, and smooth the others."""
    place = {(x, y): i for i, (x, y) in enumerate(points.tolist())}
    first = np.array([place[x, y] for x, y in ring.tolist()])
    rest = np.setdiff1d(np.arange(len(points)), first)
    order = np.concatenate((first, rest))
    number = np.empty(len(points), dtype=np.int64)
    number[order] = np.arange(len(points))
    return _smoothed(points[order], number[quads], len(ring)), number[quads]


def _smoothed(points: Array, quads: Index, fixed: int) -> Array:
    """Free corners moved towards the mean of those that share an edge with them."""
    ends = np.stack((quads, np.roll(quads, -1, axis=1)), axis=2).reshape(-1, 2)
    ends = np.unique(np.sort(ends, axis=1), axis=0)
    ends = np.concatenate((ends, ends[:, ::-1]))
    degree = np.bincount(ends[:, 0], minlength=len(points))[:, None]
    for _ in range(SMOOTHING):
        total = np.zeros_like(points)
        np.add.at(total, ends[:, 0], points[ends[:, 1]])
        points = np.concatenate((points[:fixed], 0.5 * (points + total / degree)[fixed:]))
    return points
