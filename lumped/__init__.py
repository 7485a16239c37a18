"""The lumped model: mesh stiffness, equations of motion, Runge-Kutta integration.

`stiffness`: analytic mesh stiffness and standards. `linear`: the periodic model with three degrees of freedom.
`nonlinear`: the model with one mesh spring and the effects of real rigs. Time integration loads Numba and is therefore
imported by its own name only (`gearbench.lumped.linear.runge_kutta`, `gearbench.lumped.nonlinear.model`).
"""

from gearbench.lumped.errors import LumpedError
from gearbench.lumped.linear.model import Lumped, equivalent_mass, lumped_model, periodic_matrices
from gearbench.lumped.linear.time_step import choose_substeps, largest_step
from gearbench.lumped.stiffness.mesh_stiffness import (
    MeshStiffness,
    PairStiffness,
    TabulatedStiffness,
    mesh_stiffness,
    potential_energy_stiffness,
    rectangular_stiffness,
    tabulated_stiffness,
)
from gearbench.lumped.stiffness.potential_energy import ToothCompliance, pair_stiffness, tooth_compliance

__all__ = [
    "Lumped",
    "LumpedError",
    "MeshStiffness",
    "PairStiffness",
    "TabulatedStiffness",
    "ToothCompliance",
    "choose_substeps",
    "equivalent_mass",
    "largest_step",
    "lumped_model",
    "mesh_stiffness",
    "pair_stiffness",
    "periodic_matrices",
    "potential_energy_stiffness",
    "rectangular_stiffness",
    "tabulated_stiffness",
    "tooth_compliance",
]
