"""What identification of a lumped rig should find: the exact and the frozen transfer function from F to DTE.

The lumped model hands over its periodic matrices, identification solves them: here both meet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.bench.plan.schedule import schedule
from gearbench.bench.refusals.effects import is_nonlinear
from gearbench.geometry import pair
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import PeriodicSystem, frozen_itf
from gearbench.lumped import Lumped, lumped_model, periodic_matrices
from gearbench.rig import Case

Array = NDArray[np.float64]
Complexes = NDArray[np.complex128]

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

        a, b, c = linearised_matrices(case, meshing, FEWEST_PHASES)
        return PeriodicSystem(plan.mesh_period, a, b, c)
    return periodic_system(lumped_model(case.rig, meshing, case.simulation), plan.mesh_period)


def periodic_system(model: Lumped, mesh_period: float) -> PeriodicSystem:
    """A lumped model that meshes with the given period [s] as a periodic system from F [N] to DTE [m]."""
    edge = float(getattr(model.stiffness, "edge", 0.0))
    phases = MOST_PHASES if edge == 0.0 else int(np.clip(POINTS_PER_EDGE / edge, FEWEST_PHASES, MOST_PHASES))
    a, b, c = periodic_matrices(model, phases)
    return PeriodicSystem(mesh_period, a, b, c, interpolation="trigonometric" if edge else "piecewise")


def exact_and_frozen(case: Case, frequency: ArrayLike, phase: ArrayLike) -> tuple[Complexes, Complexes]:
    """Exact and frozen ITF (frequency, phase) [m/N] of a lumped case at frequencies [Hz], phases [cycles].

    The exact one is the periodic response of the periodic system; the frozen one holds k at each phase and
    is what the exact one tends to for a mesh that turns infinitely slowly. Report both, score against the
    exact one only. Raises PeriodicSystemError if the mesh makes the rig unstable.
    """
    system = lumped_periodic_system(case)
    # The default step follows the fastest mode alone; a fast mesh would have it stride over the switches.
    exact = exact_itf(system, frequency, phase, steps=system.phases)
    return exact, frozen_itf(system, frequency, phase)
