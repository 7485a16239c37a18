"""Stress from displacements on quadratic triangles: superconvergent points, extrapolation, nodal averages.

Stresses of these triangles are best at the three points of the quadrature of degree two (Barlow 1976; Zienkiewicz and
Taylor); from there they are continued linearly to the six nodes and averaged over the elements that share a node.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.gear.elasticity import PlaneModuli
from gearbench.geometry.mesh.values import Mesh, SectorMesh
from gearbench.geometry.tooth.fillet import rotation

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SAMPLES = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]])
# Values at the nodes of linear functions given at SAMPLES.
TO_NODES = np.array([[5.0, -1, -1], [-1, 5, -1], [-1, -1, 5], [2, 2, -1], [-1, 2, 2], [2, -1, 2]]) / 3


def shapes(at: Array) -> Array:
    """Quadratic shape functions (q, 6) at reference points (q, 2): corners, then middles of 01, 12, 20."""
    x, y = at.T
    z = 1 - x - y
    return np.column_stack([z * (2 * z - 1), x * (2 * x - 1), y * (2 * y - 1), 4 * z * x, 4 * x * y, 4 * y * z])


def shape_slopes(at: Array) -> Array:
    """Their derivatives (q, 6, 2) by the reference coordinates."""
    x, y = at.T
    z = 1 - x - y
    zero = np.zeros_like(x)
    dx = np.column_stack([1 - 4 * z, 4 * x - 1, zero, 4 * (z - x), 4 * y, -4 * y])
    dy = np.column_stack([1 - 4 * z, zero, 4 * y - 1, -4 * x, 4 * x, 4 * (z - y)])
    return np.stack([dx, dy], axis=-1)


@dataclass(frozen=True)
class Recovery:
    """Stress recovery on one mesh: triangles (m, 6), derivatives of the shape functions (m, 3, 6, 2) [1/m] at the
    sample points, and how many elements share each node."""

    triangles: Indices
    slopes: Array
    count: Array
    moduli: PlaneModuli

    def element_stress(self, displacement: Array) -> Array:
        """Stress (m, 6, 3) [Pa] xx, yy, xy at each element's nodes from the displacement (n, 2) [m]."""
        own = displacement[self.triangles]
        gradient = np.einsum("mqad,mac->mqcd", self.slopes, own)
        e, nu, shear = self.moduli.modulus, self.moduli.poisson, self.moduli.lame[1]
        exx, eyy = gradient[..., 0, 0], gradient[..., 1, 1]
        stress = np.stack(
            [
                e / (1 - nu * nu) * (exx + nu * eyy),
                e / (1 - nu * nu) * (eyy + nu * exx),
                shear * (gradient[..., 0, 1] + gradient[..., 1, 0]),
            ],
            axis=-1,
        )
        return np.einsum("aq,mqs->mas", TO_NODES, stress)

    def nodal_sum(self, displacement: Array) -> Array:
        """Sum (n, 3) over elements of the stress at each node."""
        found = self.element_stress(displacement).reshape(-1, 3)
        nodes = self.triangles.ravel()
        return np.column_stack([np.bincount(nodes, found[:, k], len(self.count)) for k in range(3)])

    def nodal(self, displacement: Array) -> Array:
        """Stress (n, 3) [Pa] averaged at the nodes."""
        return np.asarray(self.nodal_sum(displacement) / self.count[:, None])


def make_recovery(mesh: Mesh, moduli: PlaneModuli) -> Recovery:
    """Prepare the recovery on curved quadratic triangles."""
    points, triangles = mesh.points, mesh.cells
    reference = shape_slopes(SAMPLES)
    jacobian = np.einsum("qad,mac->mqcd", reference, points[triangles])
    slopes = np.einsum("qad,mqdc->mqac", reference, np.linalg.inv(jacobian))
    count = np.bincount(triangles.ravel(), minlength=len(points)).astype(float)
    return Recovery(triangles, slopes, count, moduli)


def turn_stress(stress: Array, angle: float) -> Array:
    """Components (..., 3) of stress in a frame from which this one is turned by `angle`: sigma' = R sigma R^T."""
    c, s = np.cos(angle), np.sin(angle)
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    return np.stack(
        [
            c * c * xx + s * s * yy - 2 * s * c * xy,
            s * s * xx + c * c * yy + 2 * s * c * xy,
            s * c * (xx - yy) + (c * c - s * s) * xy,
        ],
        axis=-1,
    )


def ring_stress(recovery: Recovery, sector: SectorMesh, fields: dict[int, Array]) -> dict[int, Array]:
    """Nodal stress of sectors, averaged over their common cuts too; sector numbers to displacements (n, 2), each in
    its own frame. A cut whose other side is not among them is averaged over its own side."""
    teeth = sector.teeth
    pitch = 2 * pi / teeth
    sums = {j: recovery.nodal_sum(u) for j, u in fields.items()}
    out = {}
    for j, own in sums.items():
        total, count = own.copy(), recovery.count.copy()
        for here, there, step in ((sector.cut_high, sector.cut_low, 1), (sector.cut_low, sector.cut_high, -1)):
            other = sums.get((j + step) % teeth)
            if other is not None:
                total[here] += turn_stress(other[there], step * pitch)
                count[here] += recovery.count[there]
        out[j] = total / count[:, None]
    return out


def principal(stress: Array) -> Array:
    """In-plane principal stresses (..., 2), the larger one first, of stress (..., 3) xx, yy, xy."""
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    return np.stack([middle + radius, middle - radius], axis=-1)


def von_mises(stress: Array, out_of_plane: Array | float = 0.0) -> Array:
    """Von Mises stress (...) of stress (..., 3) and the normal stress out of the plane [Pa]."""
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    zz = out_of_plane
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)


def rotated(points: Array, angle: float) -> Array:
    """Vectors (..., 2) turned counter-clockwise by an angle."""
    return np.asarray(points @ rotation(angle).T)
