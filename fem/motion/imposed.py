"""What is imposed on the reduced rig: torques of drive and load, corrections that are common to all tooth pairs."""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.law import Meetings
from gearbench.fem.motion.machine import Correction, Machine, Pace
from gearbench.kernels.compiled import INLINED, ROUNDING, compiled

Array = NDArray[np.float64]

LEAST_LEVEL = 1e-4  # of the reference force: below it the exponent's factor stays, or flanks that part would have none


@compiled(**INLINED)
def load_torque(machine: Machine, torque: float) -> float:
    """The load's torque under the driver torque [N m], without what balances losses [N m]."""
    balance = machine.balance
    return machine.law.driven.rb / machine.law.driver.rb * (balance.follow * torque + balance.constant * balance.mean)


@compiled(**INLINED)
def impose(machine: Machine, torque: float, theta1: float, outer: Array) -> None:
    """Write the generalised forces of drive and load into `outer`, under the driver torque [N m] at a rotation of the
    driver."""
    ripple = machine.ripple
    if machine.driven_at >= 0:
        outer[machine.driven_at] = torque
        for i in range(len(ripple.order)):
            outer[machine.driven_at] += ripple.torque[i] * cos(ripple.order[i] * theta1 + ripple.phase[i])
    if machine.loaded_at >= 0:
        outer[machine.loaded_at] = -load_torque(machine, torque)


@compiled(**INLINED)
def lag(machine: Machine, now: Pace, outer: Array) -> None:
    """Take off `outer`, which holds the torques of drive and load, what it takes to speed up all that turns with the
    nominal rotation: the unknowns are departures from it. Where neither speed is prescribed, the load's torque makes up
    for that."""
    at, n1 = machine.at, machine.hub1.shape[1]
    one, two = now.pull1, now.pull2
    for i, pull in ((at.driver, one), (at.drive_end, one), (at.driven, two), (at.load_end, two)):
        if i >= 0:
            torque = outer[i] if i == machine.driven_at or i == machine.loaded_at else 0.0
            outer[i] = torque - machine.mass[i] * pull
    if machine.loaded_at >= 0:
        outer[machine.loaded_at] += machine.course.inertia2 * now.pull2
    for k in range(n1):
        outer[machine.hubs + k] = -machine.hub1[2, k] * now.pull1
    for k in range(machine.hub2.shape[1]):
        outer[machine.hubs + n1 + k] = machine.hub2[2, k] * now.pull2


class Excess(NamedTuple):
    """Excess of all working flanks [m], and its derivative by the mesh phase [m]."""

    value: float
    slope: float


@compiled(forceinline=True)
def stiffness_factor(correction: Correction, phase: float, t: float) -> float:
    """Factor on the mesh force at a mesh phase of the driven gear [cycles] and a time [s]."""
    series = 1.0
    for n in range(len(correction.stiffness_cos)):
        angle = 2 * pi * (n + 1) * phase
        series += correction.stiffness_cos[n] * cos(angle) + correction.stiffness_sin[n] * sin(angle)
    passed = min(max(t / correction.duration, 0.0), 1.0)
    return correction.scale * series * (1.0 + correction.drift * passed)


@compiled(forceinline=True)
def hardened(correction: Correction, factor: float, force: float) -> float:
    """The factor on the mesh force with the exponent, if there is one, where the teeth press with a force [N] in all:
    with F = factor G (G/reference)^e that on G has (F/(factor reference))^(e/(1 + e)) besides."""
    if correction.exponent == 0.0:
        return factor
    level = max(force / factor / correction.reference, LEAST_LEVEL)
    return factor * level ** (correction.exponent / (1.0 + correction.exponent))


@compiled(forceinline=True)
def common_excess(correction: Correction, phase: float) -> Excess:
    """Excess of all working flanks at a mesh phase of the driven gear [cycles]."""
    value, slope = correction.error_mean, 0.0
    for n in range(len(correction.error_cos)):
        rate = 2 * pi * (n + 1)
        one, two = correction.error_cos[n], correction.error_sin[n]
        value += one * cos(rate * phase) + two * sin(rate * phase)
        slope += rate * (two * cos(rate * phase) - one * sin(rate * phase))
    return Excess(value, slope)


@compiled(fastmath=ROUNDING, **INLINED)
def thicken(pairs: Meetings, n: int, excess: float, slope: float) -> None:
    """Move the working ones of n pairs together by an excess [m] whose derivative by the driven rotation is `slope`:
    what tilts the common normal changes the driven gear's lever."""
    for p in range(n):
        k = pairs[p]
        if k.side == 0:
            k.gap -= excess
            k.lever2 -= slope


@compiled(fastmath=ROUNDING, **INLINED)
def lean(machine: Machine, pairs: Meetings, n: int, out: Array) -> None:
    """Write what the load's torque takes up per force of each of n pairs [m], where nothing else holds both rotations:
    off the line of action the gears' levers are not in the ratio of their base circles."""
    ratio, part = machine.law.driven.rb / machine.law.driver.rb, machine.balance.losses
    for p in range(n):
        out[p] = part * (1.0 - 2.0 * pairs[p].side) * (pairs[p].lever2 - ratio * pairs[p].lever1)
