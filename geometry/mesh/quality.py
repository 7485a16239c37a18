"""Quality of a plane mesh of curved second-order elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.mesh.values import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# The determinant of the map of a quadratic triangle is a quadratic polynomial: its Bernstein coefficients
# bound it.
_NODES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])


@dataclass(frozen=True)
class Quality:
    """Measured on every element; the worst is kept.

    `jacobian`: lower bound of the map's determinant over the element, relative to what the element's area makes of it
    (1: straight sides with centred middles, for a quadrilateral a parallelogram; <= 0: folded). `angle`, `widest`:
    smallest and largest corner angle of the straight-sided element [rad]. `aspect`: inradius over circumradius of a
    triangle, twice (1: equilateral); None for quadrilaterals. `growth`: largest ratio of the square roots of the areas
    of two elements that share an edge. `area` [m^2]: of the mesh."""

    elements: int
    nodes: int
    jacobian: float
    angle: float
    widest: float
    aspect: float | None
    growth: float
    area: float


def quality(mesh: Mesh) -> Quality:
    """Measure a plane mesh of triangles or of quadrilaterals."""
    return (_triangle_quality if mesh.kind.corners == 3 else _quad_quality)(mesh)


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


def _triangle_quality(mesh: Mesh) -> Quality:
    points, triangles = mesh.points, mesh.cells
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
    return _worst(mesh, lowest, angles, area, float(aspect.min()))


def _worst(mesh: Mesh, jacobian: Array, angles: Array, area: Array, aspect: float | None) -> Quality:
    """What is kept of the elements' relative determinants (m,), corner angles (m, 3 or 4) and areas (m,)."""
    return Quality(
        elements=len(mesh.cells),
        nodes=len(np.unique(mesh.cells)),
        jacobian=float(jacobian.min()),
        angle=float(angles.min()),
        widest=float(angles.max()),
        aspect=aspect,
        growth=_growth(mesh.middles, area),
        area=float(area.sum()),
    )


def _growth(middles: Index, area: Array) -> float:
    """Largest ratio of sizes across an edge; `middles` (m, 3 or 4) of the elements' sides identify the edges."""
    order = np.argsort(middles.ravel(), kind="stable")
    owner = np.repeat(np.arange(len(middles)), middles.shape[1])[order]
    shared = np.flatnonzero(np.diff(middles.ravel()[order]) == 0)
    ratio = np.sqrt(area[owner[shared]] / area[owner[shared + 1]])
    return float(np.maximum(ratio, 1 / ratio).max(initial=1.0))


# The determinant of a nine-node quadrilateral is a polynomial of degree three in each reference coordinate: its
# Bernstein coefficients, from values at four even steps, bound it.
_STEPS = np.linspace(0.0, 1.0, 4)
_BERNSTEIN = np.linalg.inv(
    np.stack([comb * _STEPS**j * (1 - _STEPS) ** (3 - j) for j, comb in enumerate((1, 3, 3, 1))], axis=1)
)
# Reference coordinates of the nodes, in halves.
_PLACES = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]])



def quad_determinants(points: Array, quads: Index, at: Array) -> Array:
    """Determinants (m, n, n) of the map of each quadrilateral (m, 9) of the unit square at all pairs of `at` (n,)."""
    value = np.stack(((1 - at) * (1 - 2 * at), 4 * at * (1 - at), at * (2 * at - 1)), axis=1)
    slope = np.stack((4 * at - 3, 4 - 8 * at, 4 * at - 1), axis=1)
    x, y = _PLACES.T
    nodes = points[quads]
    along = np.einsum("ik,jk,mkc->mijc", slope[:, x], value[:, y], nodes)
    across = np.einsum("ik,jk,mkc->mijc", value[:, x], slope[:, y], nodes)
    return along[..., 0] * across[..., 1] - along[..., 1] * across[..., 0]


def _quad_quality(mesh: Mesh) -> Quality:
    points, quads = mesh.points, mesh.cells
    at, weight = np.polynomial.legendre.leggauss(3)
    weight = weight / 2
    area = np.einsum("mij,i,j->m", quad_determinants(points, quads, (at + 1) / 2), weight, weight)
    bound = np.einsum("ai,bj,mij->mab", _BERNSTEIN, _BERNSTEIN, quad_determinants(points, quads, _STEPS))
    corners = points[mesh.corners]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    angles = np.arctan2(cross, np.sum(ahead * back, axis=2)) % (2 * np.pi)
    return _worst(mesh, bound.min(axis=(1, 2)) / area, angles, area, None)
