"""A small rig whose inertias and radii are written down, for the non-linear lumped model."""

from __future__ import annotations

from collections.abc import Callable
from math import cos
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shared.hat_mesh import ALPHA, RADII, hat_law

from gearbench.lumped import equivalent_mass
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.pressing import Instants
from gearbench.lumped.nonlinear.step import Outputs, columns, integrate
from gearbench.lumped.nonlinear.tables import Motion, instants, tables
from gearbench.rig import Coupling, Damping, Gear, Rig, Support, Supports

Array = NDArray[np.float64]

GEARS = (2.3e-4, 1.2e-3)  # inertias [kg m^2]
MASSES = (2.0, 3.0)
ZETA = 0.05
FORCE = 3500.0  # T1 / rb1 [N]
PATH = -0.8, 0.8  # of contact, in base pitches


def make_rig(driver: dict[str, Any] | None = None, driven: dict[str, Any] | None = None, **fields: Any) -> Rig:
    gear = {"module": 3e-3, "face_width": 0.023, "hub_radius": 0.016}
    supports = Supports(driver=Support(stiffness=1e8, damping=3e3), driven=Support(stiffness=1.4e8, damping=2e3))
    values: dict[str, Any] = {"support": supports, "damping": Damping(mesh_ratio=ZETA), **fields}
    one, two = Gear(teeth=20, **gear, **(driver or {})), Gear(teeth=30, **gear, **(driven or {}))
    return Rig(driver=one, driven=two, **values)


def along_line_of_action(rig: Rig) -> Rig:
    return rig.model_copy(update={"support": rig.support.model_copy(update={"direction": "line-of-action"})})


def make_model(rig: Rig, law: MeshLaw | None = None) -> NonLinear:
    """The model with inertias of its own, written down here: shafts, boundaries and direction as the rig says."""
    rotor, turning1, beyond1 = _shaft(rig.drive.coupling, GEARS[0])
    brake, turning2, beyond2 = _shaft(rig.load.coupling, GEARS[1])
    squares = RADII[0] ** 2, RADII[1] ** 2
    masses = (turning1 / squares[0], turning2 / squares[1], beyond1 / squares[0], *MASSES)
    inertias = GEARS[0] + rotor, GEARS[1] + brake
    mesh_mass = equivalent_mass(RADII, inertias, rig.load.boundary)
    if rig.drive.boundary == "speed":
        mesh_mass = inertias[1] / squares[1]
    factor = cos(ALPHA) if rig.support.direction == "tangential" else 1.0
    outer = beyond2 / squares[1] if rig.load.boundary != "speed" else 0.0
    return NonLinear(rig, law or hat_law(), RADII, ALPHA, factor, masses, mesh_mass, PATH, outer)


def _shaft(coupling: Coupling | None, gear: float) -> tuple[float, float, float]:
    """Inertia beyond a shaft, what of it and the gear turns as one, and what turns for itself [kg m^2]."""
    inertia = coupling.inertia if coupling else 0.0
    elastic = coupling is not None and coupling.stiffness is not None
    return inertia, gear + (0.0 if elastic else inertia), inertia if elastic else 0.0


def run(
    model: NonLinear, force: Callable[[Array], Array], state: Array, *, mesh_frequency: float, cycles: float, steps: int
) -> tuple[Array, Outputs]:
    """Time [s] and outputs (steps,) of a run from mesh phase 0 under a force over time."""
    step = cycles / mesh_frequency / steps
    table = tables(model, Motion(cycles=cycles, entries=2 * steps, step=step))
    excitation = force(np.arange(2 * steps) * step / 2)
    _, out = integrate(model, table, excitation, state, step=step, substeps=1, mesh_frequency=mesh_frequency)
    return np.arange(steps) * step, columns(out)


def steady_dte(rig: Rig, *, frequency: float = 4.0, swing: float = 0.0) -> tuple[Array, Array]:
    """Mesh phase and DTE over one hunting period at constant torque, turning so slowly that the rig follows."""
    model = make_model(rig, hat_law(swing=swing, bend=0.0))
    state = model.equilibrium(FORCE, first_entry(model))
    steps = 60 * 8000
    time, out = run(model, lambda t: np.full(t.shape, FORCE), state, mesh_frequency=frequency, cycles=60.0, steps=steps)
    dte = out.u1 - out.u2 + cos(ALPHA) * (out.y1 - out.y2)
    return time[::40] * frequency, dte[::40]


def first_entry(model: NonLinear) -> Instants:
    return instants(model, tables(model, Motion(1.0, 2, 1.0)), 1)
