"""Loads on the outline of a tooth: smooth pressure patches that move along a flank without ripple.

A contact's share of the mesh is a patch of pressure b(s) of unit resultant, centred at the arc length s: a cubic
B-spline, in the numbers of the outline's corner nodes, of hat-shaped pressures over two element sides each. It is some
five sides long, twice continuously differentiable in s, and has the resultant and the moment of the concentrated force.
Its work-conjugate displacement is what the mesh contributes to a contact's approach (docs/physics.md, "Full model").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.gear.flank import MIRROR, flank_coordinate
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.profile import Profile

Array = NDArray[np.float64]
Index = NDArray[np.int64]

NEWTON = 30


@dataclass(frozen=True)
class Outline:
    """The loaded boundary of one sector. Unknowns: 2 i + c is component c of its node i, in the frame of the sector.

    nodes (n,): numbers in the sector, from root to tip along the working flank and on to the other root, corners and
    middles of the sides alternating; read backwards they are their mirror images. path (n,): path coordinate [m], the
    arc length s on the working flank. hats (h, n): nodal weights of hat pressures of unit resultant; centres (h,):
    where they act.
    """

    shape: Profile
    nodes: Index
    path: Array
    hats: Array
    centres: Array

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 2 * len(self.nodes)

    def inward(self, s: float, side: int) -> Array:
        """Inward unit normal (2,) at arc length s of the working (0) or back (1) flank, in the sector's frame."""
        normal: Array = -self.shape.normals(np.array([s]))[0]
        return normal * MIRROR if side else normal

    def patch(self, s: float, side: int) -> Array:
        """Nodal forces (size,) of the patch of unit resultant along the inward normal at arc length s of a flank."""
        return self.spread(spline_weights(self.centres, s) @ self.hats, self.inward(s, side), side)

    def spread(self, weights: Array, direction: Array, side: int) -> Array:
        """Nodal forces (size,) in one direction (2,), shared by weights (n,) of the nodes, or of their mirror images
        for the back flank."""
        shared = weights[::-1] if side else weights
        return np.asarray((shared[:, None] * direction).ravel())


def make_outline(shape: Profile, sector: SectorMesh) -> Outline:
    """The outline of a sound sector, from its middle root land over the working flank to the other side."""
    if sector.mirror is None:
        raise ValueError("a sector with a crack has no mirror image")
    path = _path_of(sector)
    if not np.array_equal(sector.mirror[path], path[::-1]):
        raise ValueError("the outline of the sector is not symmetric")
    coordinate = _path_coordinate(shape, sector.points, path)
    hats, centres = _hats(coordinate)
    return Outline(shape, path, coordinate, hats, centres)


def _path_of(sector: SectorMesh) -> Index:
    """Nodes along the whole outline, corners and middles alternating, the working flank first, from root to tip."""
    edges = sector.boundary_edges[::-1]
    if not np.array_equal(edges[1:, 1], edges[:-1, 0]):
        raise ValueError("the boundary of the sector is not one path")
    return np.append(edges[:, [1, 2]].ravel(), edges[-1, 0])


def _path_coordinate(shape: Profile, points: Array, path: Index) -> Array:
    """Arc length s where the path runs on the working flank and its tip edge, continued by chords beyond."""
    steps = np.linalg.norm(np.diff(points[path], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    s = flank_coordinate(shape, points[path])
    on = np.flatnonzero(~np.isnan(s))
    first, last = on[0], on[-1]
    if len(on) != last - first + 1:
        raise ValueError("the flank is not one piece of the path")
    out = np.where(np.isnan(s), 0.0, s)
    out[:first] = s[first] - (along[first] - along[:first])
    out[last + 1 :] = s[last] + (along[last + 1 :] - along[last])
    return out


def _hats(path: Array) -> tuple[Array, Array]:
    """Consistent nodal loads (h, n) of the hats around every inner corner, of unit resultant, and their centres (h,).

    On a side of length L with a pressure that rises from 0 to 1 they are 0, L/3 and L/6 at its beginning, middle and
    end.
    """
    corners = path[::2]
    count = len(corners) - 2
    hats = np.zeros((count, len(path)))
    length = np.diff(corners)
    total = length[:-1] + length[1:]
    for j in range(count):
        hats[j, 2 * j + 1] = 2.0 / 3.0 * length[j] / total[j]
        hats[j, 2 * j + 2] = 1.0 / 3.0
        hats[j, 2 * j + 3] = 2.0 / 3.0 * length[j + 1] / total[j]
    return hats, hats @ path


def spline_weights(centres: Array, s: float) -> Array:
    """Cubic B-spline weights (h,) whose mean of `centres` (h,) is s. Beyond the first and the last centre they
    are those there."""
    last = len(centres) - 1
    value = np.clip(s, _mean(centres, 0.0), _mean(centres, float(last)))
    low, high = 0.0, float(last)
    at = float(np.interp(value, centres, np.arange(len(centres))))
    for _ in range(NEWTON):
        left = _mean(centres, at) - value
        low, high = (at, high) if left < 0 else (low, at)
        if high - low <= 1e-14 * last or abs(left) <= 1e-15 * (centres[-1] - centres[0]):
            break
        slope = _mean(centres, at, _slopes)
        step = at - left / slope if slope > 0 else low
        at = step if low < step < high else 0.5 * (low + high)
    out = np.zeros(len(centres))
    np.add.at(out, _four(centres, at), _values(at - np.floor(at)))
    return out


def _mean(centres: Array, at: float, weights: Callable[[float], Array] | None = None) -> float:
    return float((weights or _values)(at - np.floor(at)) @ centres[_four(centres, at)])


def _four(centres: Array, at: float) -> Index:
    """The four centres around number `at`, the ends standing for those beyond them."""
    return np.clip(int(np.floor(at)) - 1 + np.arange(4), 0, len(centres) - 1)


def _values(t: float) -> Array:
    """The uniform cubic B-spline's weights of four, at the fraction t between the middle ones."""
    u = 1.0 - t
    return np.array([u**3, 3 * t**3 - 6 * t**2 + 4, 3 * u**3 - 6 * u**2 + 4, t**3]) / 6


def _slopes(t: float) -> Array:
    u = 1.0 - t
    return np.array([-(u**2), 3 * t**2 - 4 * t, 4 * u - 3 * u**2, t**2]) / 2
