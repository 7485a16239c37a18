"""What identification of a lumped rig should find: the exact and the frozen transfer function from F to DTE.

The lumped model hands over its periodic matrices, identification solves them: here both meet.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import schedule
from gearbench.bench.refusals.effects import is_nonlinear
from gearbench.geometry import pair
from gearbench.identification.truth.periodic import PeriodicSystem
from gearbench.lumped import Lumped, lumped_model, periodic_matrices
from gearbench.rig import Case

Array = NDArray[np.float64]

# Phase grid of the periodic matrices, and steps of the exact solution: the switches of k(t) decide. With
# 80 points a switch the lumped case at the paper's settings is exact to 1e-5.
POINTS_PER_EDGE = 80
FEWEST_PHASES = 1024
MOST_PHASES = 8192


def lumped_periodic_system(case: Case) -> PeriodicSystem:
    """The case's lumped model at its operating speed, as a periodic system from F [N] to DTE [m].

    Phase 0 is mesh phase 0. Smooth switches of k(t) give a trigonometric system, sharp ones a piecewise
    constant one. The non-linear model is linearised about its static deflection under the mean torque, all teeth
    sound and free of errors.
    """
    meshing = pair(case.rig)
    plan = schedule(case.experiment, case.rig)
    if is_nonlinear(case):
        # Imported on use: it brings in the mesher.
        from gearbench.bench.nonlinear.static import linearised_matrices

        smooth = case.simulation.mesh_stiffness == "finite-element" or case.simulation.stiffness_edge > 0.0
        phases = FEWEST_PHASES if smooth else MOST_PHASES
        return _on_grid(plan.mesh_period, partial(linearised_matrices, case, meshing), phases, smooth)
    return periodic_system(lumped_model(case.rig, meshing, case.simulation), plan.mesh_period)


def periodic_system(model: Lumped, mesh_period: float) -> PeriodicSystem:
    """A lumped model that meshes with the given period [s] as a periodic system from F [N] to DTE [m]."""
    edge = float(getattr(model.stiffness, "edge", 0.0))
    phases = MOST_PHASES if edge == 0.0 else int(np.clip(POINTS_PER_EDGE / edge, FEWEST_PHASES, MOST_PHASES))
    return _on_grid(mesh_period, partial(periodic_matrices, model), phases, edge > 0.0)


def _on_grid(
    mesh_period: float, matrices: Callable[[int, float], tuple[Array, Array, Array]], phases: int, smooth: bool
) -> PeriodicSystem:
    """The periodic system of `matrices(phases, first phase)`, from phase 0 on where it is smooth. A piece of another is
    that of its middle: of its beginning it would lag by half a piece."""
    if smooth:
        return PeriodicSystem(mesh_period, *matrices(phases, 0.0), interpolation="trigonometric")
    return PeriodicSystem(mesh_period, *matrices(phases, 0.5 / phases), interpolation="piecewise")
