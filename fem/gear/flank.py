"""Where loads meet the mesh: quadrature of boundary tractions and the trace of displacements on the flanks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.profile import Profile

Array = NDArray[np.float64]

MIRROR = np.array([1.0, -1.0])


def _shape(xi: Array) -> Array:
    """Quadratic shape functions (corner, corner, middle) on [0, 1]; (..., 3)."""
    return np.stack([(1 - xi) * (1 - 2 * xi), xi * (2 * xi - 1), 4 * xi * (1 - xi)], axis=-1)


def _slope(xi: Array) -> Array:
    return np.stack([4 * xi - 3, 4 * xi - 1, 4 - 8 * xi], axis=-1)


@dataclass(frozen=True)
class BoundaryQuadrature:
    """Quadrature points (q, 2) and outward unit normals (q, 2) of the loaded boundary, and the matrix that turns
    tractions at them, stacked as (2 q,), into consistent nodal forces (unknowns, 2 q)."""

    points: Array
    normals: Array
    load: csr_matrix


def boundary_quadrature(
    shape: Profile, mesh: SectorMesh, order: int = 8, sides: Sequence[int] = (0,)
) -> BoundaryQuadrature:
    """Gauss quadrature of `order` points on the curved edges of a sector that may carry tractions.

    On the flanks that carry the loads (`sides`, 0: working, 1: back) points and normals are those of the exact profile:
    the isoparametric boundary has kinks at its nodes, which a load beside one would see.
    """
    points, edges = mesh.points, mesh.free_edges
    xi, weight = np.polynomial.legendre.leggauss(order)
    xi, weight = (xi + 1) / 2, weight / 2
    x = np.einsum("qa,kac->kqc", _shape(xi), points[edges])
    tangent = np.einsum("qa,kac->kqc", _slope(xi), points[edges])
    length = np.hypot(tangent[..., 0], tangent[..., 1])
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1) / length[..., None]
    owner = {int(mid): n for n, middles in enumerate(mesh.middles) for mid in middles}
    centre = points[mesh.corners[[owner[int(m)] for m in edges[:, 2]]]].mean(axis=1)
    outward = np.sign(np.sum((points[edges[:, 2]] - centre) * normal[:, order // 2], axis=1))
    normal *= outward[:, None, None]
    for side in sides:
        mirror = MIRROR if side else np.ones(2)
        coordinate = flank_coordinate(shape, points * mirror)[edges]
        flank = ~np.isnan(coordinate).any(axis=1)
        s = np.einsum("qa,ka->kq", _shape(xi), coordinate[flank])
        x[flank], normal[flank] = shape.points(s) * mirror, shape.normals(s) * mirror
        length[flank] = np.abs(np.einsum("qa,ka->kq", _slope(xi), coordinate[flank]))
    k, n_q = len(edges), len(edges) * order
    rows, cols, data = [], [], []
    for a in range(3):
        value = (length * weight * _shape(xi)[:, a]).ravel()
        node = np.repeat(edges[:, a], order)
        for c in range(2):
            rows.append(2 * node + c)
            cols.append(2 * np.arange(n_q) + c)
            data.append(value)
    load = csr_matrix(
        (np.concatenate(data), (np.concatenate(rows), np.concatenate(cols))), shape=(2 * len(points), 2 * n_q)
    )
    return BoundaryQuadrature(x.reshape(k * order, 2), normal.reshape(k * order, 2), load)


def flank_coordinate(profile: Profile, points: Array) -> Array:
    """Arc length s of points that lie on the working flank or its tip-edge arc; NaN for points elsewhere."""
    s_end = profile.s_end
    r2 = np.sum(points**2, axis=1)
    s = (r2 - profile.base_radius**2) / (2 * profile.base_radius)
    if profile.edge_radius > 0:
        phi = profile.psi_b - profile.rho_end / profile.base_radius
        start = np.array([-np.sin(phi), np.cos(phi)])
        d = points - profile.edge_centre
        angle = np.arctan2(-(start[0] * d[:, 1] - start[1] * d[:, 0]), d @ start)
        s = np.where(s > s_end, s_end + profile.edge_radius * angle, s)
    low, high = profile.s_form, profile.s_tip
    inside = (s > low - 1e-9) & (s < high + 1e-9)
    s = np.where(inside, np.clip(s, low, high), np.nan)
    on = np.zeros(len(points), bool)
    on[inside] = np.linalg.norm(profile.points(s[inside]) - points[inside], axis=1) < 1e-8
    return np.where(on, s, np.nan)


def flank_trace(profile: Profile, mesh: SectorMesh, s: Array, side: int) -> csr_matrix:
    """Matrix (len(s), unknowns) that gives the displacement along the inward normal at arc lengths s.

    side 0: working flank (counter-clockwise), side 1: back flank (its mirror image).
    """
    mirror = MIRROR if side else np.ones(2)
    points, edges = mesh.points, mesh.boundary_edges
    coordinate = flank_coordinate(profile, points * mirror)
    own = edges[~np.isnan(coordinate[edges]).any(axis=1)]
    ends = np.sort(coordinate[own[:, :2]], axis=1)
    by_start = np.argsort(ends[:, 0])
    own, ends = own[by_start], ends[by_start]
    at = np.clip(np.searchsorted(ends[:, 0], s, side="right") - 1, 0, len(own) - 1)
    if np.any(s > ends[at, 1] + 1e-8) or np.any(s < ends[at, 0] - 1e-8):
        raise ValueError("a flank point lies outside the meshed flank")
    nodal = coordinate[own[at]]
    xi = (s - nodal[:, 0]) / (nodal[:, 1] - nodal[:, 0])
    for _ in range(6):
        xi -= (np.sum(_shape(xi) * nodal, axis=1) - s) / np.sum(_slope(xi) * nodal, axis=1)
    inward = -profile.normals(s) * mirror
    shape = _shape(xi)
    rows = np.repeat(np.arange(len(s)), 6)
    cols = (2 * own[at][:, :, None] + np.arange(2)).reshape(-1)
    data = (shape[:, :, None] * inward[:, None, :]).reshape(-1)
    return csr_matrix((data, (rows, cols)), shape=(len(s), 2 * len(points)))
