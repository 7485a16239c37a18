"""The condensed elastic gear: rigid hub coordinates, fixed-hub modes and the flanks' static flexibility.

The flank kernel is found by exact singularity subtraction. For a unit load at arc length s the half-plane's
(Flamant's) field is removed on the whole boundary; what is left is regular and is solved on a coarse mesh. The kernel

    G(s, s') = K(s, s') + 2/(pi E') ln|s - s'|            (metres inside the logarithm)

is smooth, so contact mechanics can add the half-plane's response to the true pressure back analytically.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.elasticity import PlaneModuli, assemble, plane_moduli
from gearbench.fem.flamant import LineLoad
from gearbench.fem.flank import (
    MIRROR,
    BoundaryQuadrature,
    boundary_quadrature,
    flank_trace,
)
from gearbench.fem.ring import Ring, make_ring, ring_modes, ring_response, rotation
from gearbench.geometry.mesh import SectorMesh, sector_mesh
from gearbench.geometry.profile import Profile, profile
from gearbench.rig import Gear, Material

Array = NDArray[np.float64]

EDGE_RADIUS_LEAST = 5e-6  # [m]
REACH = 3  # teeth on either side whose flanks answer a load


@dataclass(frozen=True)
class CondensedGear:
    """One gear, condensed. Kernels are per unit thickness [m per N/m]; modes are normalised to the whole gear.

    s (n,): arc lengths of the samples on the working flank, up to and over the tip edge [m]; last: index of the one
        where the involute ends.
    front, back (2 reach + 1, n, n): inward normal displacement of the working (back) flank of the tooth that lies
        m - reach teeth counter-clockwise of the loaded one, [m, load at s_i, response at s_j]; front[reach] is G.
    omega (q,) [rad/s]; mode_front, mode_back (q, teeth, n): inward normal modal displacement [kg^-1/2];
    mode_hub (q, 3): coupling mass with the hub's x, y (gear frame) and rotation [kg^1/2, kg^1/2 m].
    unknowns: of the whole gear's mesh.
    """

    teeth: int
    face_width: float
    s: Array
    last: int
    front: Array
    back: Array
    omega: Array
    mode_front: Array
    mode_back: Array
    mode_hub: Array
    unknowns: int

    @property
    def reach(self) -> int:
        """Number of neighbouring teeth kept on either side."""
        return (len(self.front) - 1) // 2


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


def rounded(gear: Gear) -> Gear:
    """The gear with a tip edge that elasticity can turn around: a sharper one is rounded to EDGE_RADIUS_LEAST."""
    return gear.model_copy(update={"tip_edge_radius": max(gear.tip_edge_radius, EDGE_RADIUS_LEAST)})


def condense(gear: Gear, material: Material, element_size: float | None = None, modes: int = 8) -> CondensedGear:
    """Mesh one sector of the gear and condense the whole gear to hub and flanks.

    element_size [m] on the flanks (None: module / 12). Raises GeometryError for an impossible gear.
    """
    gear = rounded(gear)
    shape = profile(gear)
    mesh = sector_mesh(shape, gear, element_size or gear.module / 12)
    moduli = plane_moduli(material)
    stiffness, mass = assemble(mesh.points, mesh.triangles, moduli)
    ring = make_ring(mesh, gear.teeth, stiffness, mass)
    s, last = kernel_samples(shape, gear.module / 7)
    front, back = flank_kernels(ring, mesh, shape, moduli, s)
    areal = material.density * gear.face_width
    found = ring_modes(ring, areal, gear.face_width, modes)
    traces = [flank_trace(shape, mesh.points, mesh.boundary_edges, s, side) for side in (0, 1)]
    rigid = _rigid_shapes(mesh.points, gear.teeth)
    n = len(s)
    return CondensedGear(
        teeth=gear.teeth,
        face_width=gear.face_width,
        s=s,
        last=last,
        front=front,
        back=back,
        omega=np.array([m.omega for m in found]),
        mode_front=np.array([(traces[0] @ m.shape.T).T for m in found]).reshape(-1, gear.teeth, n),
        mode_back=np.array([(traces[1] @ m.shape.T).T for m in found]).reshape(-1, gear.teeth, n),
        mode_hub=np.array([[areal * np.sum(r * (mass @ m.shape.T).T) for r in rigid] for m in found]).reshape(-1, 3),
        unknowns=gear.teeth * (stiffness.shape[0] - len(ring.low) - len(ring.hub)),
    )


def _rigid_shapes(points: Array, teeth: int) -> Array:
    """Rigid translation in x, in y and rotation about the centre, in every sector's frame; (3, teeth, unknowns)."""
    out = np.empty((3, teeth, 2 * len(points)))
    spin = np.column_stack([-points[:, 1], points[:, 0]]).ravel()
    for j in range(teeth):
        back = rotation(-2 * pi * j / teeth)
        for c in range(2):
            out[c, j] = np.tile(back[:, c], len(points))
        out[2, j] = spin
    return out


def flank_kernels(ring: Ring, mesh: SectorMesh, shape: Profile, moduli: PlaneModuli, s: Array) -> tuple[Array, Array]:
    """Kernels (front, back) of `CondensedGear`, by exact subtraction of Flamant's field."""
    teeth = ring.teeth
    quadrature = boundary_quadrature(shape, mesh.points, mesh.triangles, mesh.boundary_edges)
    at, normal = shape.points(s), shape.normals(s)
    space = np.array([np.cos(pi / teeth), np.sin(pi / teeth)])

    def loads_in(j: int) -> list[LineLoad]:
        turn = rotation(-2 * pi * j / teeth)
        return [LineLoad(turn @ x, -(turn @ n), turn @ space) for x, n in zip(at, normal, strict=True)]

    hub_points = mesh.points[mesh.hub]

    def hub(j: int) -> Array:
        fields = [-load.displacement(hub_points, moduli.modulus, moduli.poisson).ravel() for load in loads_in(j)]
        return np.array(fields).T

    def forces(j: int) -> Array:
        return _regular_forces(quadrature, loads_in(j))

    reach = min(REACH, (teeth - 1) // 2)
    offsets = np.arange(-reach, reach + 1)
    response = ring_response(ring, forces, hub, offsets % teeth)
    kernels = np.empty((2, len(offsets), len(s), len(s)))
    for side in (0, 1):
        mirror = MIRROR if side else np.ones(2)
        trace = flank_trace(shape, mesh.points, mesh.boundary_edges, s, side)
        for m, offset in enumerate(offsets):
            regular = (trace @ response[m]).T
            own = side == 0 and offset == 0
            for i, load in enumerate(loads_in(int(offset))):
                kernels[side, m, i] = regular[i] + _half_plane(
                    load, at * mirror, -normal * mirror, moduli, s, i if own else None
                )
    return kernels[0], kernels[1]


def _regular_forces(quadrature: BoundaryQuadrature, loads: list[LineLoad]) -> Array:
    tractions = [-load.traction(quadrature.points, quadrature.normals).ravel() for load in loads]
    return np.asarray(quadrature.load @ np.array(tractions).T)


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
