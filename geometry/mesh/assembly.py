"""A gear of tooth sectors that are not all meshed alike: fine where teeth touch, coarse where they are far away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.sector_mesh import SectorMesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Nodes of two sectors on their common cut coincide to this part of their radius.
TOLERANCE = 1e-12


@dataclass(frozen=True)
class AssembledMesh:
    """A whole gear in its own frame, sector k around the polar angle 2 pi k/z.

    `points` (n, 2) [m]; `triangles` (m, 6) as in SectorMesh; `hub` (h,) nodes of the hub circle, each once;
    `sides[k]` (e, 2): triangle and its side (0: corners 0-1, 1: 1-2, 2: 2-0) along the counter-clockwise half of the
    outline of tooth k, from the tip's middle to the root's.
    """

    points: Array
    triangles: Index
    hub: Index
    sides: tuple[Index, ...]


def assembled(sectors: Sequence[SectorMesh]) -> AssembledMesh:
    """The gear of one sector per tooth. Neighbours share the nodes of their cuts.

    Raises GeometryError where neighbouring cuts do not match.
    """
    teeth = len(sectors)
    node_of: list[Index] = []
    points, total = [], 0
    for k, sector in enumerate(sectors):
        kept = np.setdiff1d(np.arange(len(sector.points)), sector.cut_high)
        numbers = np.full(len(sector.points), -1, dtype=np.int64)
        numbers[kept] = total + np.arange(len(kept))
        total += len(kept)
        node_of.append(numbers)
        points.append(_turned(sector.points[kept], 2 * pi * k / teeth))
    for k, sector in enumerate(sectors):
        following = sectors[(k + 1) % teeth]
        _check_cut(sector, following, k)
        node_of[k][sector.cut_high] = node_of[(k + 1) % teeth][following.cut_low]
    triangles, sides, first = [], [], 0
    for numbers, sector in zip(node_of, sectors, strict=True):
        triangles.append(numbers[sector.triangles])
        sides.append(_outline_sides(sector, first))
        first += len(sector.triangles)
    hub = np.unique(np.concatenate([numbers[s.hub] for numbers, s in zip(node_of, sectors, strict=True)]))
    return AssembledMesh(np.concatenate(points), np.concatenate(triangles), hub, tuple(sides))


def _turned(points: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def _check_cut(sector: SectorMesh, following: SectorMesh, number: int) -> None:
    one, two = (np.hypot(*s.points[cut].T) for s, cut in ((sector, sector.cut_high), (following, following.cut_low)))
    if len(one) != len(two) or np.abs(one - two).max() > TOLERANCE * one.max():
        raise GeometryError(f"sector {number} and the next one do not share the nodes of their cut")


def _outline_sides(sector: SectorMesh, first: int) -> Index:
    """Triangle (counted from `first`) and side along the counter-clockwise half of a sector's outline."""
    edges = sector.boundary_edges[len(sector.boundary_edges) // 2 :]
    owner = {
        int(node): (t, side) for t, row in enumerate(sector.triangles[:, 3:], first) for side, node in enumerate(row)
    }
    return np.array([owner[int(middle)] for middle in edges[:, 2]], dtype=np.int64)
