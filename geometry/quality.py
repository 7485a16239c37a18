"""Quality of a mesh of curved quadratic triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# The determinant of the map of a quadratic triangle is a quadratic polynomial: its Bernstein coefficients
# bound it.
_NODES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])


@dataclass(frozen=True)
class Quality:
    """Measured on every triangle; the worst is kept. `jacobian`: lower bound of the map's determinant over
    the triangle, relative to twice its area (1 for straight sides with centred middles; <= 0: folded).
    `angle`: smallest corner angle of the straight-sided triangle [rad]. `aspect`: inradius over circumradius,
    twice (1: equilateral). `growth`: largest ratio of the square roots of the areas of two triangles that
    share an edge."""

    triangles: int
    nodes: int
    jacobian: float
    angle: float
    aspect: float
    growth: float
    area: float


def shape_gradients(at: Array) -> Array:
    """Gradients (n, 6, 2) of the six quadratic shape functions at reference points `at` (n, 2)."""
    x, y = at[:, 0], at[:, 1]
    w, zero = 1 - x - y, np.zeros(len(at))
    dx = [1 - 4 * w, 4 * x - 1, zero, 4 * (w - x), 4 * y, -4 * y]
    dy = [1 - 4 * w, zero, 4 * y - 1, -4 * x, 4 * x, 4 * (w - y)]
    return np.stack((np.stack(dx, axis=1), np.stack(dy, axis=1)), axis=2)


def determinants(points: Array, triangles: Index, at: Array) -> Array:
    """Determinants (m, n) of the map of each triangle (m, 6) at the reference points `at` (n, 2)."""
    jacobian = np.einsum("mkx,nkr->mnxr", points[triangles], shape_gradients(at))
    return jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]


def areas(points: Array, triangles: Index) -> Array:
    """Exact areas (m,) of the curved triangles: the determinant is quadratic, three points integrate it."""
    middles = np.array([[0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
    return determinants(points, triangles, middles).sum(axis=1) / 6


def quality(points: Array, triangles: Index) -> Quality:
    """Measure a mesh: points (n, 2), triangles (m, 6)."""
    area = areas(points, triangles)
    value = determinants(points, triangles, _NODES)
    corner, middle = value[:, :3], value[:, 3:]
    bernstein = 2 * middle - 0.5 * (corner + corner[:, [1, 2, 0]])
    lowest = np.minimum(corner.min(axis=1), bernstein.min(axis=1)) / (2 * area)
    side = np.linalg.norm(points[triangles[:, [1, 2, 0]]] - points[triangles[:, [0, 1, 2]]], axis=2)
    a, b, c = side.T
    cosines = np.stack(((b * b + c * c - a * a) / (2 * b * c), (c * c + a * a - b * b) / (2 * c * a)), axis=1)
    angles = np.arccos(np.clip(cosines, -1, 1))
    angles = np.column_stack((angles, np.pi - angles.sum(axis=1)))
    aspect = 8 * np.prod(np.sin(angles / 2), axis=1)
    return Quality(
        triangles=len(triangles),
        nodes=len(points),
        jacobian=float(lowest.min()),
        angle=float(angles.min()),
        aspect=float(aspect.min()),
        growth=_growth(triangles, area),
        area=float(area.sum()),
    )


def _growth(triangles: Index, area: Array) -> float:
    """Largest ratio of sizes across an edge (middles identify the edges)."""
    middle = triangles[:, 3:].ravel()
    order = np.argsort(middle, kind="stable")
    owner = np.repeat(np.arange(len(triangles)), 3)[order]
    shared = np.flatnonzero(np.diff(middle[order]) == 0)
    ratio = np.sqrt(area[owner[shared]] / area[owner[shared + 1]])
    return float(np.maximum(ratio, 1 / ratio).max(initial=1.0))
