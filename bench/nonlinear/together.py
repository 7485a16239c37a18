"""Motion of both gears together where nothing holds their rotation: it must begin right, or they drift away.

Ripple and, where the load's torque does not follow the driver's, the multisine turn all inertias alike. The periodic
motion is known in closed form: what turns is the sum of all inertias, since friction and load are in balance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.together import under_signal, under_waves
from gearbench.lumped.nonlinear.coordinates import NAMES
from gearbench.lumped.nonlinear.model import NonLinear

Array = NDArray[np.float64]

_TURNING = np.array([name in ("u1", "u2", "w", "load") for name in NAMES], dtype=float)


def under_ripple(model: NonLinear, mesh_frequency: float, phase: float) -> Array:
    """State (2 size,) of the motion under the drive's ripple at a mesh phase [cycles]; frequency in Hz."""
    ripple = model.rig.drive.ripple
    if ripple is None or not model.free:
        return np.zeros(2 * model.size)
    z1, orders = model.rig.driver.teeth, np.array(ripple.orders, dtype=float)
    turn = 2 * np.pi * orders * phase / z1 + np.array(ripple.phase)
    push = np.array(ripple.amplitude) / model.base_radii[0] / _mass(model)
    return _all(model, *under_waves(push, 2 * np.pi * orders * mesh_frequency / z1, turn))


def under_excitation(model: NonLinear, force: Array, step: float, at: int) -> Array:
    """State (2 size,) at entry `at` of the motion under T1/rb1 = force (n,) [N], which repeats, `step` [s] apart."""
    return _all(model, *under_signal(force / _mass(model), step, at))


def _mass(model: NonLinear) -> float:
    """What turns with both gears, on their base circles [kg]."""
    return sum(model.masses[:3]) + model.outer


def _all(model: NonLinear, moved: float, moving: float) -> Array:
    turning = _TURNING[: model.size]
    return np.concatenate([turning * moved, turning * moving])
