"""Motion of both gears together where nothing holds their rotation: it must begin right, or they drift away.

Ripple and, where the load's torque does not follow the driver's, the multisine turn all inertias alike. The periodic
motion is known in closed form: what turns is the sum of all inertias, since friction and load are in balance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.together import under_signal, under_waves
from gearbench.fem.motion.hubs import ABSENT
from gearbench.fem.motion.machine import Machine
from gearbench.fem.motion.start import State

Array = NDArray[np.float64]


def _turning(machine: Machine) -> Array:
    """How far each unknown (d,) moves where both gears turn by 1 rad of the driver."""
    at, law = machine.at, machine.law
    out = np.zeros(len(machine.mass))
    ratio = law.driver.rb / law.driven.rb
    for end, turn in ((at.driver, 1.0), (at.drive_end, 1.0), (at.driven, ratio), (at.load_end, ratio)):
        if end != ABSENT:
            out[end] = turn
    return out


def _moved(machine: Machine, state: State, angle: float, speed: float) -> State:
    """The state with both gears turned and turning further, by these angle [rad] and speed [rad/s] of the driver."""
    turning = _turning(machine)
    return state._replace(d=state.d + angle * turning, v=state.v + speed * turning)


def _inertia(machine: Machine) -> float:
    """Of all that turns with both gears, seen from the driver [kg m^2]."""
    return float(machine.mass @ _turning(machine) ** 2)


def _free(machine: Machine) -> bool:
    return machine.driven_at != ABSENT and machine.loaded_at != ABSENT


def under_ripple(machine: Machine, state: State) -> State:
    """The state with the motion under the drive's ripple."""
    waves = machine.ripple
    if not _free(machine) or not len(waves.order):
        return state
    rate = waves.order * machine.speed1
    turn = waves.order * (machine.speed1 * state.t + state.d[machine.at.driver]) + waves.phase
    return _moved(machine, state, *under_waves(waves.torque / _inertia(machine), rate, turn))


def under_excitation(machine: Machine, state: State, torque: Array, step: float, at: int) -> State:
    """The state with the motion under a driver torque (n,) [N m] that repeats, `step` [s] apart; entry `at` is that one
    step after the state."""
    if not _free(machine) or machine.balance.follow:
        return state
    return _moved(machine, state, *under_signal(torque / _inertia(machine), step, at - 1))
