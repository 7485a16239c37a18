"""One gear with all its finite-element unknowns, in its own rotating frame.

Displacements are relative to the rigid motion of the hub, so that they vanish on the hub circle. Fields are those of
`sector_solver`; mass, stiffness and loads are the whole gear's, not per unit of face width.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix

from gearbench.fem.full.columns import symmetric_sweeps
from gearbench.fem.full.outline import Outline, make_outline
from gearbench.fem.full.sector_solver import SectorSolver, flexibility, make_solver
from gearbench.fem.gear.elasticity import assemble, plane_moduli
from gearbench.fem.gear.flexibility import REACH
from gearbench.fem.gear.ring import Solver, unknowns
from gearbench.fem.limits import rounded
from gearbench.geometry.mesh.element_size import flank_size
from gearbench.geometry.mesh.grading import Grading, half_boundary
from gearbench.geometry.mesh.sector_mesh import sector_within
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Gear, Material

Array = NDArray[np.float64]

# Elements a module on the flanks where no size is given: their local answer is found analytically, so that they carry
# the inertia and the bending of the teeth only.
PER_MODULE = 4
GRADING = Grading(growth=0.7, bend=0.9, cut_edges=6, fine_tips=False)


@dataclass(frozen=True)
class FullGear:
    """Mass [kg] and stiffness [N/m] (u, u) of one sector; `rigid` (u, teeth, 3): forces [kg, kg, kg m] per unit
    acceleration of the hub in x and y of the gear's frame and about its axis; `static`: the inverse of the stiffness;
    `compliance` (2 reach + 1, m, m): static flexibility of the outline [m/N], as `flexibility` returns it; `free`:
    unknowns of the whole gear."""

    teeth: int
    sector: SectorMesh
    outline: Outline
    mass: csr_matrix
    stiffness: csr_matrix
    rigid: Array
    static: SectorSolver
    compliance: Array
    free: int

    @property
    def reach(self) -> int:
        """Number of neighbouring teeth on either side to which `compliance` reaches."""
        return (len(self.compliance) - 1) // 2

    @property
    def loaded(self) -> NDArray[np.int64]:
        """The outline's unknowns among those of the sector."""
        return unknowns(self.outline.nodes)


def make_gear(
    gear: Gear,
    material: Material,
    element_size: float | None = None,
    factorise: Callable[[csc_matrix], Solver] = symmetric_sweeps,
) -> FullGear:
    """Mesh, assemble and factorise one sound gear; element_size [m] on the flanks (None: module / 4).

    Raises GeometryError.
    """
    gear = rounded(gear)
    shape = profile(gear)
    size = flank_size(gear.module, gear.module / PER_MODULE if element_size is None else element_size)
    sector = sector_within(gear.teeth, half_boundary(shape, gear.hub_radius, size, GRADING))
    stiffness, mass = assemble(sector, plane_moduli(material))
    stiffness = (stiffness * gear.face_width).tocsr()
    mass = (mass * (material.density * gear.face_width)).tocsr()
    outline = make_outline(shape, sector)
    static = make_solver(sector, stiffness, factorise)
    reach = min(REACH, (gear.teeth - 1) // 2)
    ring = static.ring
    return FullGear(
        teeth=gear.teeth,
        sector=sector,
        outline=outline,
        mass=mass,
        stiffness=stiffness,
        rigid=_rigid_forces(sector.points, mass, ring.hub, gear.teeth),
        static=static,
        compliance=flexibility(static, unknowns(outline.nodes), reach),
        free=gear.teeth * (len(ring.inner) + len(ring.high)),
    )


def _rigid_forces(points: Array, mass: csr_matrix, hub: NDArray[np.int64], teeth: int) -> Array:
    """Inertia forces (unknowns, teeth, 3) per unit acceleration of the hub; none on the hub itself."""
    out = np.empty((2 * len(points), teeth, 3))
    spin = np.column_stack([-points[:, 1], points[:, 0]]).ravel()
    for j in range(teeth):
        back = rotation(-2 * pi * j / teeth)
        for c in range(2):
            out[:, j, c] = mass @ np.tile(back[:, c], len(points))
        out[:, j, 2] = mass @ spin
    out[hub] = 0.0
    return out


@dataclass(frozen=True)
class Effective:
    """The effective matrix of a gear under one time scheme, factorised: `solver`, its flexibility (2 reach + 1, m, m)
    of the outline, its answer (u, teeth, 3) to `rigid`, and the product (3, 3) of both."""

    solver: SectorSolver
    flexibility: Array
    answer: Array
    product: Array


def effective(
    gear: FullGear, mass: float, stiffness: float, factorise: Callable[[csc_matrix], Solver] = symmetric_sweeps
) -> Effective:
    """Factorise mass M + stiffness K of a gear."""
    solver = make_solver(gear.sector, (mass * gear.mass + stiffness * gear.stiffness).tocsr(), factorise)
    answer = np.stack([solver.solve(gear.rigid[:, :, c]) for c in range(3)], axis=2)
    product = np.tensordot(gear.rigid, answer, ((0, 1), (0, 1)))
    return Effective(solver, flexibility(solver, gear.loaded, gear.reach), answer, product)
