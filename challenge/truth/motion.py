"""Equations of motion of the truth rig and their fourth-order Runge-Kutta integration, compiled.

dte = rb1 theta1 - rb2 theta2 - (rb1 + rb2) phi - (l - l0), to first order rb1 theta1 - rb2 theta2 + (y1 - y2) cos a +
(x1 - x2) sin a; docs/physics.md, "Axes, signs, zeros". The common tangent of the base circles, wherever the geometric
centres are, has the length l and has turned by phi (`_line`). A pair begins where the driven gear's tip meets it and
ends where the driver's does. Friction acts across the line of action against the sliding velocity rho1 theta1' - rho2
theta2' + (y1' - y2') sin a - (x1' - x2') cos a of each pair. The back flanks touch along the mirrored line of action
once the backlash is used up; they carry no friction, and their teeth no errors but eccentricity and profile.
"""

from __future__ import annotations

from math import atan2, cos, floor, pi, sin, sqrt, tanh
from typing import NamedTuple

import numpy as np

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.packing import Mesh, Record, pack
from gearbench.challenge.truth.plant import (
    DEGREES,
    DRIVEN,
    DRIVER,
    LOAD,
    MODE_1,
    MODE_2,
    OUTPUTS,
    ROTOR,
    STATES,
    TWIST,
    X_DRIVEN,
    X_DRIVER,
    Y_DRIVEN,
    Y_DRIVER,
    Array,
    Plant,
    Seen,
)
from gearbench.kernels.compiled import ROUNDING, compiled

# Python's error model orders the operations as they were in every record made so far: with numpy's, last digits differ.
_compiled = compiled(fastmath=ROUNDING, error_model="python")


def integrate(
    plant: Plant, torque: Array, state: Array, *, step: float, first: int, outputs: int, stride: int
) -> tuple[Array, Array]:
    """Run `outputs` x `stride` steps of `step` [s] from step number `first` (time `first` x `step`) and `state`.

    `torque` (2 n,) [N m] acts on the rotor: entry 2 i belongs to step i, the odd ones to the middles; it repeats.
    Returns the final state (STATES,) and the outputs (outputs, len(OUTPUTS)) at the start of every `stride`-th step.
    Pure; releases the GIL. Raises ChallengeError when the integration overflows.
    """
    if torque.size == 0 or torque.size % 2:
        raise ChallengeError(f"the torque table has {torque.size} entries; the half-step grid needs an even number")
    final = np.array(state, dtype=float)
    if final.shape != (STATES,):
        raise ChallengeError(f"the state has shape {final.shape}, not ({STATES},)")
    out = np.empty((outputs, len(OUTPUTS)))
    numbers, mesh = pack(plant)
    _run(numbers, mesh, np.ascontiguousarray(torque), final, step, first, stride, out)
    if not np.isfinite(final).all():
        raise ChallengeError(f"the truth rig's integration overflowed: steps of {step:.3g} s are too long")
    return final, out


def derivative(plant: Plant, time: float, torque: float, state: Array) -> tuple[Array, Seen]:
    """Rate (STATES,) of the state at `time` [s] under a `torque` [N m] on the rotor, and what is seen there."""
    rate = np.empty(STATES)
    numbers, mesh = pack(plant)
    seen = _derivative(numbers, mesh, time, torque, np.asarray(state, dtype=float), rate)
    return rate, seen


@_compiled
def _pair_force(
    c: Record, mesh: Mesh, number: int, v: float, sweep: float, dte: float, rate: float, scale: float
) -> float:
    """Normal force of the pair `number` at position `v`, which moves by `sweep` pitches a second."""
    table, one, two = mesh.table, mesh.driver, mesh.driven
    place = (v - c.teeth.first) / c.teeth.pitch
    cell = int(place)
    if place < 0.0 or cell >= table.shape[0] - 1:
        return 0.0
    part = place - cell
    tooth1, tooth2 = number % one.shape[0], number % two.shape[0]
    slope = table[cell + 1].excess - table[cell].excess
    delta = dte + table[cell].excess + part * slope + one[tooth1].error + two[tooth2].error
    if delta <= 0.0:
        return 0.0
    closing = rate + slope / c.teeth.pitch * sweep
    k = table[cell].stiffness + part * (table[cell + 1].stiffness - table[cell].stiffness)
    share1 = table[cell].share_driver + part * (table[cell + 1].share_driver - table[cell].share_driver)
    share2 = table[cell].share_driven + part * (table[cell + 1].share_driven - table[cell].share_driven)
    k *= scale / (1.0 + share1 * one[tooth1].crack + share2 * two[tooth2].crack)
    relative = delta / c.teeth.reference
    tangent = k * relative ** c.teeth.exponent
    elastic = tangent * delta
    tangent *= 1.0 + c.teeth.exponent
    damping = c.teeth.damping * (1.0 - c.teeth.damping_load + c.teeth.damping_load * relative)
    damping += c.teeth.damping_quadratic * abs(closing)
    if delta < c.teeth.damping_onset:
        damping *= delta / c.teeth.damping_onset
    return max(elastic + damping * tangent * closing, 0.0)


class _Line(NamedTuple):
    """The line of action: how far its centres' motion has closed the flanks [m], its normal force's direction on the
    driven gear, its length [m] and by what angle it has turned."""

    closed: float
    nx: float
    ny: float
    length: float
    turned: float


@_compiled
def _line(c: Record, apart_x: float, apart_y: float) -> _Line:
    """That of gears whose geometric centres have come closer by these parts [m], driver's less driven gear's."""
    both, alpha = c.base_driver + c.base_driven, atan2(c.sine, c.cosine)
    x, y = both / c.cosine - apart_x, -apart_y
    length = sqrt(x * x + y * y - both * both)
    turned = atan2(y, x) - atan2(length, both) + alpha
    closed = c.line_of_action - length - both * turned
    return _Line(closed, sin(alpha - turned), cos(alpha - turned), length, turned)


@_compiled
def _sliding(c: Record, speed: float) -> float:
    """Regularised sign of a sliding speed."""
    if c.teeth.friction_shape == 0:
        return tanh(speed / c.teeth.friction_speed)
    return speed / sqrt(speed * speed + c.teeth.friction_speed * c.teeth.friction_speed)


@_compiled
def _working(
    c: Record, mesh: Mesh, s: Array, turn1: float, turn2: float, at: _Line, speed1: float, speed2: float, dte: float,
    rate: float, scale: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Of all pairs on the working flanks: normal force, friction, and friction's moments on both gears. turn1, turn2:
    by what part of a pitch each gear has turned beyond the line of action, where tooth 0 passes the pitch point."""
    span = c.teeth.pitch * (mesh.table.shape[0] - 1)
    d = DEGREES
    across = (s[d + Y_DRIVER] - s[d + Y_DRIVEN]) * at.nx - (s[d + X_DRIVER] - s[d + X_DRIVEN]) * at.ny
    sweep = c.base_driver / c.base_pitch * speed1
    normal, rubbing, moment1, moment2 = 0.0, 0.0, 0.0, 0.0
    for number in range(floor(turn2 - c.teeth.first - span), floor(turn2 - c.teeth.first) + 1):
        v = c.teeth.first + (turn2 - number - c.teeth.first) * span / (span - turn1 + turn2)
        force = _pair_force(c, mesh, number, v, sweep, dte, rate, scale)
        if force > 0.0:
            rho1 = c.roll_pitch + (turn1 - number) * c.base_pitch
            rho2 = at.length - rho1
            rub = c.teeth.friction * force * _sliding(c, rho1 * speed1 - rho2 * speed2 + across)
            normal += force
            rubbing += rub
            moment1 += rub * rho1
            moment2 += rub * rho2
    return normal, rubbing, moment1, moment2


@_compiled
def _back(c: Record, mesh: Mesh, turn: float, speed1: float, dte: float, rate: float, scale: float) -> float:
    """Normal force of the back flanks, whose contacts run from tip to root and pass the pitch point half a pitch
    later; `dte` closes them and is counted from their contact."""
    last = c.teeth.first + c.teeth.pitch * (mesh.table.shape[0] - 1)
    sweep = -c.base_driver / c.base_pitch * speed1
    force = 0.0
    for number in range(floor(turn - 0.5 + c.teeth.first), floor(turn - 0.5 + last) + 1):
        tooth1, tooth2 = number % len(mesh.driver), number % len(mesh.driven)
        clean = dte - mesh.driver[tooth1].error - mesh.driven[tooth2].error
        force += _pair_force(c, mesh, number, number + 0.5 - turn, sweep, clean, rate, scale)
    return force


@_compiled
def _lift(c: Record, s: Array, coordinate: int) -> float:
    """Motion [m] of the housing at a support."""
    i = coordinate - X_DRIVER
    return c.mode_shape[0, i] * s[MODE_1] + c.mode_shape[1, i] * s[MODE_2]


@_compiled
def _supports(c: Record, s: Array, progress: float, force: Array) -> None:
    """Forces (4,) of the supports on the gears' centres, with opposite sign."""
    for i in range(4):
        lift = _lift(c, s, X_DRIVER + i)
        lift_rate = c.mode_shape[0, i] * s[DEGREES + MODE_1] + c.mode_shape[1, i] * s[DEGREES + MODE_2]
        y = s[X_DRIVER + i] - lift
        k = c.support[i] * (1.0 + progress * (c.drift.driver if X_DRIVER + i < X_DRIVEN else c.drift.driven))
        if c.support_exponent[i] != 0.0:
            k *= (abs(y) / c.support_reference[i]) ** c.support_exponent[i]
        force[i] = k * y + c.support_damping[i] * (s[DEGREES + X_DRIVER + i] - lift_rate)


@_compiled
def _drive(c: Record, time: float, torque: float, s: Array, rate: Array) -> float:
    """Torque on the driver from the coupling; sets the rates of the rotor and of the coupling's twist."""
    if c.tone.amplitude != 0.0:
        torque += c.tone.amplitude * cos(c.tone.frequency * time + c.tone.phase)
    angle = c.ripple_order * (c.speed_driver * time + s[ROTOR])
    cosine, sine = cos(angle), sin(angle)
    a, b = 1.0, 0.0
    for k in range(len(c.ripple)):
        a, b = a * cosine - b * sine, a * sine + b * cosine
        torque += c.ripple[k, 0] * a + c.ripple[k, 1] * b
    elastic = c.coupling.stiffness * s[TWIST]
    turning = s[DEGREES + ROTOR] - s[DEGREES + DRIVER]
    slip = 0.0
    if c.coupling.limit > 0.0:
        if elastic > c.coupling.limit:
            slip = (elastic - c.coupling.limit) / c.coupling.slip
        elif elastic < -c.coupling.limit:
            slip = (elastic + c.coupling.limit) / c.coupling.slip
    passed = elastic + c.coupling.damping * (turning - slip)
    rate[DEGREES + ROTOR] = (torque - passed) / c.inertia.rotor
    rate[TWIST] = turning - slip
    return passed


@_compiled
def _derivative(c: Record, mesh: Mesh, time: float, torque: float, s: Array, rate: Array) -> Seen:
    """Fill the rate of the state `s`; returns what is seen there."""
    d = DEGREES
    progress = max(time, 0.0) / c.drift.duration
    angle1, angle2 = c.speed_driver * time + s[DRIVER], c.speed_driven * time + s[DRIVEN]
    speed1, speed2 = c.speed_driver + s[d + DRIVER], c.speed_driven + s[d + DRIVEN]
    # Geometric centres off the axes: polar angles of both.
    pole1, pole2 = c.eccentricity_angle.driver + angle1, c.eccentricity_angle.driven - angle2
    e1, e2 = c.eccentricity.driver, c.eccentricity.driven
    x1, y1 = e1 * cos(pole1), e1 * sin(pole1)
    x2, y2 = e2 * cos(pole2), e2 * sin(pole2)
    u1, w1 = -y1 * speed1 + s[d + X_DRIVER], x1 * speed1 + s[d + Y_DRIVER]
    u2, w2 = y2 * speed2 + s[d + X_DRIVEN], -x2 * speed2 + s[d + Y_DRIVEN]
    apart_x, apart_y = s[X_DRIVER] + x1 - s[X_DRIVEN] - x2, s[Y_DRIVER] + y1 - s[Y_DRIVEN] - y2
    apart_u, apart_w = u1 - u2, w1 - w2
    twist = c.base_driver * s[DRIVER] - c.base_driven * s[DRIVEN]
    twist_rate = c.base_driver * s[d + DRIVER] - c.base_driven * s[d + DRIVEN]
    at = _line(c, apart_x, apart_y)
    dte = twist + at.closed
    dte_rate = twist_rate + apart_w * at.ny + apart_u * at.nx
    turn1 = mesh.driver.shape[0] * (angle1 - at.turned) / (2.0 * pi)
    turn2 = mesh.driven.shape[0] * (angle2 + at.turned) / (2.0 * pi)
    scale = 1.0 + progress * c.drift.mesh
    force, rub, moment1, moment2 = _working(c, mesh, s, turn1, turn2, at, speed1, speed2, dte, dte_rate, scale)
    # Levers about the axes: derivatives of dte to each angle.
    pull1 = force * (c.base_driver + x1 * at.ny - y1 * at.nx) + moment1
    pull2 = force * (c.base_driven - x2 * at.ny + y2 * at.nx) + moment2
    fy = force * at.ny + rub * at.nx
    fx = force * at.nx - rub * at.ny
    back = _line(c, apart_x, -apart_y)  # in the mirror
    closed = back.closed - twist - c.teeth.backlash
    if closed > -2e-5:  # errors and profile of the back flanks are smaller
        closing = -twist_rate - apart_w * back.ny + apart_u * back.nx
        turn = mesh.driver.shape[0] * (angle1 + back.turned) / (2.0 * pi)
        push = _back(c, mesh, turn, speed1, closed, closing, scale)
        pull1 -= push * (c.base_driver + x1 * back.ny + y1 * back.nx)
        pull2 -= push * (c.base_driven - x2 * back.ny - y2 * back.nx)
        fy -= push * back.ny
        fx += push * back.nx
    for i in range(d):
        rate[i] = s[d + i]
    passed = _drive(c, time, torque, s, rate)
    shaft = c.shaft.stiffness * (s[DRIVEN] - s[LOAD]) + c.shaft.damping * (s[d + DRIVEN] - s[d + LOAD])
    rate[d + DRIVER] = (passed - pull1) / c.inertia.driver
    rate[d + DRIVEN] = (pull2 - shaft) / c.inertia.driven
    held = c.governor.stiffness * s[LOAD] + c.governor.damping * s[d + LOAD]
    rate[d + LOAD] = (shaft - c.load_torque - held) / c.inertia.load
    # The four slots of the supports are filled first with their forces, then with the accelerations.
    supports = rate[d + X_DRIVER : d + MODE_1]
    _supports(c, s, progress, supports)
    for j in range(2):
        total = -c.mode_damping[j] * s[d + MODE_1 + j] - c.mode_stiffness[j] * s[MODE_1 + j]
        for i in range(4):
            total += c.mode_shape[j, i] * supports[i]
        rate[d + MODE_1 + j] = total / c.mode_mass[j]
    rate[d + X_DRIVER] = (-fx - rate[d + X_DRIVER]) / c.mass.driver
    rate[d + Y_DRIVER] = (-fy - rate[d + Y_DRIVER]) / c.mass.driver
    rate[d + X_DRIVEN] = (fx - rate[d + X_DRIVEN]) / c.mass.driven
    rate[d + Y_DRIVEN] = (fy - rate[d + Y_DRIVEN]) / c.mass.driven
    y_driver = s[Y_DRIVER] - c.sensor_on_housing * _lift(c, s, Y_DRIVER)
    y_driven = s[Y_DRIVEN] - c.sensor_on_housing * _lift(c, s, Y_DRIVEN)
    return Seen(s[DRIVER], s[DRIVEN], y_driver, y_driven, shaft, force, dte)


@_compiled
def _run(c: Record, mesh: Mesh, torque: Array, s: Array, h: float, first: int, stride: int, out: Array) -> None:
    """Advance the state `s` in place and fill `out`."""
    k1, k2, k3, k4 = np.empty(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    trial = np.empty(STATES)
    last = torque.size
    j = (2 * first) % last
    for row in range(out.shape[0]):
        for inner in range(stride):
            time = (first + row * stride + inner) * h
            seen = _derivative(c, mesh, time, torque[j], s, k1)
            if inner == 0:
                for i in range(len(seen)):
                    out[row, i] = seen[i]
            middle = torque[j + 1]
            j = j + 2 if j + 2 < last else 0
            for i in range(STATES):
                trial[i] = s[i] + 0.5 * h * k1[i]
            _derivative(c, mesh, time + 0.5 * h, middle, trial, k2)
            for i in range(STATES):
                trial[i] = s[i] + 0.5 * h * k2[i]
            _derivative(c, mesh, time + 0.5 * h, middle, trial, k3)
            for i in range(STATES):
                trial[i] = s[i] + h * k3[i]
            _derivative(c, mesh, time + h, torque[j], trial, k4)
            for i in range(STATES):
                s[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
