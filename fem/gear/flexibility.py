"""Static flexibility of the flanks of a gear of identical teeth.

It is found by exact singularity subtraction. For a unit load at arc length s the half-plane's (Flamant's) field is
removed on the whole boundary; what is left is regular and is solved on a coarse mesh. The kernel

    G(s, s') = K(s, s') + 2/(pi E') ln|s - s'|            (metres inside the logarithm)

is smooth, so contact mechanics can add the half-plane's response to the true pressure back analytically.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.gear.elasticity import PlaneModuli
from gearbench.fem.gear.flamant import LineLoad
from gearbench.fem.gear.flank import MIRROR, BoundaryQuadrature, boundary_quadrature, flank_trace
from gearbench.fem.gear.ring import Ring, ring_response
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.profile import Profile

Array = NDArray[np.float64]

REACH = 3  # teeth on either side whose flanks answer a load

ARC_SAMPLES = np.array([0.04, 0.1, 0.2, 0.35, 0.55, 0.78, 1.0])


def kernel_samples(shape: Profile, spacing: float) -> tuple[Array, int]:
    """Arc lengths of the kernel's samples and the index of the last one on the involute.

    On the involute they are logarithmic in the distance to the tip edge and at most `spacing` apart; on the tip edge,
    where the flank normal turns fast, they are dense at its beginning.
    """
    arc = shape.s_tip - shape.s_end
    step = arc / 3
    distance = [0.0, step]
    span = shape.s_end - shape.s_form
    while distance[-1] < span:
        step = min(step * 1.5, spacing)
        distance.append(distance[-1] + step)
    inner = shape.s_end - np.array(distance) * span / distance[-1]
    inner[-1] += 1e-9
    return np.concatenate([inner[::-1], shape.s_end + arc * ARC_SAMPLES]), len(inner) - 1


@dataclass(frozen=True)
class FlankLoads:
    """Unit loads along the inward normal of one flank (0: working, 1: back) at arc lengths s of a tooth."""

    teeth: int
    points: Array
    normals: Array
    space: Array

    def seen_from(self, j: int) -> list[LineLoad]:
        """The loads in the frame of the tooth that lies j teeth counter-clockwise of the loaded one."""
        turn = rotation(-2 * pi * j / self.teeth)
        return [
            LineLoad(turn @ x, -(turn @ n), turn @ self.space) for x, n in zip(self.points, self.normals, strict=True)
        ]


def flank_loads(shape: Profile, s: Array, side: int = 0) -> FlankLoads:
    """The loads at arc lengths s of a flank."""
    mirror = MIRROR if side else np.ones(2)
    space = np.array([np.cos(pi / shape.teeth), np.sin(pi / shape.teeth)])
    return FlankLoads(shape.teeth, shape.points(s) * mirror, shape.normals(s) * mirror, space * mirror)


def regular_forces(quadrature: BoundaryQuadrature, loads: list[LineLoad]) -> Array:
    """Nodal forces (unknowns, loads) that take the half-plane's tractions off the boundary."""
    tractions = [-load.traction(quadrature.points, quadrature.normals).ravel() for load in loads]
    return np.asarray(quadrature.load @ np.array(tractions).T)


def regular_motion(points: Array, loads: list[LineLoad], moduli: PlaneModuli) -> Array:
    """Displacements (unknowns of the points, loads) that take the half-plane's off held points."""
    return np.array([-load.displacement(points, moduli.modulus, moduli.poisson).ravel() for load in loads]).T


def flank_kernels(ring: Ring, mesh: SectorMesh, shape: Profile, moduli: PlaneModuli, s: Array) -> tuple[Array, Array]:
    """Kernels (front, back) of `CondensedGear`."""
    teeth = ring.teeth
    quadrature = boundary_quadrature(shape, mesh)
    at, normal = shape.points(s), shape.normals(s)
    loads = flank_loads(shape, s)

    def hub(j: int) -> Array:
        return regular_motion(mesh.points[mesh.hub], loads.seen_from(j), moduli)

    def forces(j: int) -> Array:
        return regular_forces(quadrature, loads.seen_from(j))

    reach = min(REACH, (teeth - 1) // 2)
    offsets = np.arange(-reach, reach + 1)
    response = ring_response(ring, forces, hub, offsets % teeth)
    kernels = np.empty((2, len(offsets), len(s), len(s)))
    for side in (0, 1):
        mirror = MIRROR if side else np.ones(2)
        trace = flank_trace(shape, mesh, s, side)
        for m, offset in enumerate(offsets):
            regular = (trace @ response[m]).T
            own = side == 0 and offset == 0
            for i, load in enumerate(loads.seen_from(int(offset))):
                kernels[side, m, i] = regular[i] + _half_plane(
                    load, at * mirror, -normal * mirror, moduli, s, i if own else None
                )
    return kernels[0], kernels[1]


def _half_plane(load: LineLoad, points: Array, inward: Array, moduli: PlaneModuli, s: Array, own: int | None) -> Array:
    """Flamant's inward normal displacement at flank points; on the loaded flank without its logarithm."""
    out = np.empty(len(points))
    other = np.arange(len(points)) != own if own is not None else np.ones(len(points), bool)
    field = load.displacement(points[other], moduli.modulus, moduli.poisson)
    out[other] = np.sum(field * inward[other], axis=1)
    if own is not None:
        scale = 1.0 / (pi * moduli.modulus)
        out[other] += 2 * scale * np.log(np.abs(s[other] - s[own]))
        out[own] = -(1 + moduli.poisson) * scale
    return out
