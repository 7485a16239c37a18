"""Settings of rigs whose mesh needs no finite elements, on the non-linear lumped model."""

from __future__ import annotations

# Two values of the stiffness, for one tooth pair and for two.
RECTANGULAR = (
    'simulation.mesh_stiffness="rectangular"',
    "simulation.stiffness_single_n_per_m=2.5e8",
    "simulation.stiffness_double_n_per_m=3.5e8",
)
# A scale beside 1 is an effect, which the linear model has not.
NONLINEAR = (*RECTANGULAR, "rig.mesh.stiffness_scale=1.0001")
# Stiff supports along the line of action: one mass on one spring.
SUPPORT = 1e10  # [N/m]
ONE_SPRING = (
    *NONLINEAR,
    "simulation.stiffness_edge=0.1",
    f"rig.support.stiffness_n_per_m={SUPPORT}",
    'rig.support.direction="line-of-action"',
)
