"""Motion of both gears together where nothing holds their rotation: it must begin right, or they drift away.

Ripple and, where the load's torque does not follow the driver's, the multisine turn all inertias alike. The periodic
motion is known in closed form: what turns is the sum of all inertias, since friction and load are in balance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.lumped.nonlinear.coordinates import NAMES
from gearbench.lumped.nonlinear.model import NonLinear

Array = NDArray[np.float64]

_TURNING = np.array([name in ("u1", "u2", "w", "load") for name in NAMES], dtype=float)


def under_ripple(model: NonLinear, mesh_frequency: float, phase: float) -> Array:
    """State (2 size,) of the motion under the drive's ripple at a mesh phase [cycles]; frequency in Hz."""
    ripple, moved, moving = model.rig.drive.ripple, 0.0, 0.0
    if ripple is None or not model.free:
        return np.zeros(2 * model.size)
    total = _mass(model)
    radius, z1 = model.base_radii[0], model.rig.driver.teeth
    speed = 2 * np.pi * mesh_frequency / z1
    for order, size, angle in zip(ripple.orders, ripple.amplitude, ripple.phase, strict=True):
        turn = 2 * np.pi * order * phase / z1 + angle
        rate = order * speed
        push = size / radius / total
        moved -= push * np.cos(turn) / rate**2
        moving += push * np.sin(turn) / rate
    return _all(model, moved, moving)


def under_excitation(model: NonLinear, force: Array, step: float, at: int) -> Array:
    """State (2 size,) at entry `at` of the motion under T1/rb1 = force (n,) [N], which repeats, `step` [s] apart."""
    lines = np.fft.rfft(force)[1:] / force.size
    lines[: (force.size - 1) // 2] *= 2.0  # the highest of an even number has no mirror image
    number = np.arange(1, len(lines) + 1)
    rate = 2 * np.pi * number / (force.size * step)
    turned = lines * np.exp(2j * np.pi * number * at / force.size) / _mass(model)
    return _all(model, float((-turned / rate**2).real.sum()), float((turned / (1j * rate)).real.sum()))


def _mass(model: NonLinear) -> float:
    """What turns with both gears, on their base circles [kg]."""
    return sum(model.masses[:3]) + model.outer


def _all(model: NonLinear, moved: float, moving: float) -> Array:
    turning = _TURNING[: model.size]
    return np.concatenate([turning * moved, turning * moving])
