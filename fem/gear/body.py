"""The condensed elastic gear: rigid hub coordinates, fixed-hub modes and the flanks' static flexibility."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.gear.crack import CrackedTooth, condense_crack
from gearbench.fem.gear.elasticity import assemble, plane_moduli
from gearbench.fem.gear.flank import flank_trace
from gearbench.fem.gear.flexibility import flank_kernels, kernel_samples
from gearbench.fem.gear.ring import make_ring, ring_modes
from gearbench.fem.limits import rounded
from gearbench.geometry.mesh.sector import Element, meshed_sector, refuse_crack
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Gear, Material

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CondensedGear:
    """One gear, condensed. Kernels are per unit thickness [m per N/m]; modes are normalised to the whole gear.

    s (n,): arc lengths of the samples on the working flank, up to and over the tip edge [m]; last: index of the one
        where the involute ends.
    front, back (2 reach + 1, n, n): inward normal displacement of the working (back) flank of the tooth that lies
        m - reach teeth counter-clockwise of the loaded one, [m, load at s_i, response at s_j]; front[reach] is G.
    omega (q,) [rad/s]; mode_front, mode_back (q, teeth, n): inward normal modal displacement [kg^-1/2];
    mode_hub (q, 3): coupling mass with the hub's x, y (gear frame) and rotation [kg^1/2, kg^1/2 m].
    unknowns: of the whole gear's mesh. crack: what a crack in one tooth adds to all this; None: all teeth are sound.
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
    crack: CrackedTooth | None = None

    @property
    def reach(self) -> int:
        """Number of neighbouring teeth kept on either side."""
        return (len(self.front) - 1) // 2


def condense(
    gear: Gear,
    material: Material,
    element_size: float | None = None,
    modes: int = 8,
    element: Element = "triangle",
) -> CondensedGear:
    """Mesh one sector of the gear and condense the whole gear to hub and flanks.

    element_size [m] on the flanks (None: module / 12). A crack in the mesh of one tooth is condensed on its own and
    kept beside; the modes stay those of the sound gear. Raises GeometryError for an impossible gear, and for a crack
    among quadrilaterals.
    """
    refuse_crack(gear, element)
    gear = rounded(gear)
    shape = profile(gear)
    mesh = meshed_sector(shape, gear, element_size, element)
    moduli = plane_moduli(material)
    stiffness, mass = assemble(mesh, moduli)
    ring = make_ring(mesh, stiffness, mass)
    s, last = kernel_samples(shape, gear.module / 7)
    front, back = flank_kernels(ring, mesh, shape, moduli, s)
    areal = material.density * gear.face_width
    found = ring_modes(ring, areal, gear.face_width, modes)
    traces = [flank_trace(shape, mesh, s, side) for side in (0, 1)]
    rigid = _rigid_shapes(mesh.points, gear.teeth)
    n = len(s)
    crack = None
    if gear.crack is not None and gear.crack.meshed:
        crack = condense_crack(gear, shape, ring, mesh, moduli, s, element_size)
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
        crack=crack,
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
