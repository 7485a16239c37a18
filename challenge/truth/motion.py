"""Equations of motion of the truth rig and their fourth-order Runge-Kutta integration, compiled.

dte = rb1 theta1 - rb2 theta2 + (y1 - y2) cos a + (x1 - x2) sin a; docs/physics.md, "Axes, signs, zeros". Friction acts
across the line of action against the sliding velocity rho1 theta1' - rho2 theta2' + (y1' - y2') sin a - (x1' - x2')
cos a of each pair. The back flanks touch along the mirrored line of action once the backlash is used up; they carry
no friction, and their teeth no errors but eccentricity and profile.
"""

from __future__ import annotations

from math import cos, floor, pi, sin, sqrt, tanh

import numpy as np

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.packing import (
    BACKLASH,
    BASE_DRIVEN,
    BASE_DRIVER,
    BASE_PITCH,
    COSINE,
    COUPLING,
    DRIFT,
    ECCENTRICITY,
    ECCENTRICITY_ANGLE,
    EXCESS,
    FRICTION,
    FRICTION_SHAPE,
    FRICTION_SPEED,
    GOVERNOR,
    INERTIA,
    LINE_OF_ACTION,
    LOAD_TORQUE,
    MASS,
    MODE_DAMPING,
    MODE_MASS,
    MODE_SHAPE,
    MODE_STIFFNESS,
    PAIR_DAMPING,
    PAIR_DAMPING_LOAD,
    PAIR_DAMPING_ONSET,
    PAIR_DAMPING_QUADRATIC,
    PAIR_EXPONENT,
    PAIR_REFERENCE,
    RIPPLE,
    RIPPLE_ORDER,
    RIPPLES,
    ROLL_PITCH,
    SENSOR_ON_HOUSING,
    SHAFT,
    SHARE_DRIVEN,
    SHARE_DRIVER,
    SINE,
    SPEED_DRIVEN,
    SPEED_DRIVER,
    STIFFNESS,
    SUPPORT,
    SUPPORT_DAMPING,
    SUPPORT_EXPONENT,
    SUPPORT_REFERENCE,
    TABLE_FIRST,
    TABLE_PITCH,
    TONE,
    Mesh,
    pack,
)
from gearbench.challenge.truth.plant import DEGREES, OUTPUTS, STATES, Array, Plant
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


def derivative(plant: Plant, time: float, torque: float, state: Array) -> tuple[Array, Array]:
    """Rate (STATES,) of the state at `time` [s] under a `torque` [N m] on the rotor, and the OUTPUTS there."""
    rate, seen = np.empty(STATES), np.empty(len(OUTPUTS))
    numbers, mesh = pack(plant)
    _derivative(numbers, mesh, time, torque, np.asarray(state, dtype=float), rate, seen)
    return rate, seen


@_compiled
def _pair_force(
    c: Array, mesh: Mesh, number: int, v: float, sweep: float, dte: float, rate: float, scale: float
) -> float:
    """Normal force of the pair `number` at position `v`, which moves by `sweep` pitches a second."""
    table, one, two = mesh
    place = (v - c[TABLE_FIRST]) / c[TABLE_PITCH]
    cell = int(place)
    if place < 0.0 or cell >= table.shape[0] - 1:
        return 0.0
    part = place - cell
    tooth1, tooth2 = number % one.shape[0], number % two.shape[0]
    slope = table[cell + 1, EXCESS] - table[cell, EXCESS]
    delta = dte + table[cell, EXCESS] + part * slope + one[tooth1, 0] + two[tooth2, 0]
    if delta <= 0.0:
        return 0.0
    closing = rate + slope / c[TABLE_PITCH] * sweep
    k = table[cell, STIFFNESS] + part * (table[cell + 1, STIFFNESS] - table[cell, STIFFNESS])
    share1 = table[cell, SHARE_DRIVER] + part * (table[cell + 1, SHARE_DRIVER] - table[cell, SHARE_DRIVER])
    share2 = table[cell, SHARE_DRIVEN] + part * (table[cell + 1, SHARE_DRIVEN] - table[cell, SHARE_DRIVEN])
    k *= scale / (1.0 + share1 * one[tooth1, 1] + share2 * two[tooth2, 1])
    relative = delta / c[PAIR_REFERENCE]
    tangent = k * relative ** c[PAIR_EXPONENT]
    elastic = tangent * delta
    tangent *= 1.0 + c[PAIR_EXPONENT]
    damping = c[PAIR_DAMPING] * (1.0 - c[PAIR_DAMPING_LOAD] + c[PAIR_DAMPING_LOAD] * relative)
    damping += c[PAIR_DAMPING_QUADRATIC] * abs(closing)
    if delta < c[PAIR_DAMPING_ONSET]:
        damping *= delta / c[PAIR_DAMPING_ONSET]
    return max(elastic + damping * tangent * closing, 0.0)


@_compiled
def _sliding(c: Array, speed: float) -> float:
    """Regularised sign of a sliding speed."""
    if c[FRICTION_SHAPE] == 0:
        return tanh(speed / c[FRICTION_SPEED])
    return speed / sqrt(speed * speed + c[FRICTION_SPEED] * c[FRICTION_SPEED])


@_compiled
def _working(
    c: Array, mesh: Mesh, s: Array, turn: float, speed1: float, speed2: float, dte: float, rate: float, scale: float
) -> tuple[float, float, float, float]:
    """Of all pairs on the working flanks: normal force, friction, and friction's moments on both gears."""
    last = c[TABLE_FIRST] + c[TABLE_PITCH] * (mesh[0].shape[0] - 1)
    across = (s[DEGREES + 5] - s[DEGREES + 7]) * c[SINE] - (s[DEGREES + 4] - s[DEGREES + 6]) * c[COSINE]
    sweep = c[BASE_DRIVER] / c[BASE_PITCH] * speed1
    normal, rubbing, moment1, moment2 = 0.0, 0.0, 0.0, 0.0
    for number in range(floor(turn - last) + 1, floor(turn - c[TABLE_FIRST]) + 1):
        v = turn - number
        force = _pair_force(c, mesh, number, v, sweep, dte, rate, scale)
        if force > 0.0:
            rho1 = c[ROLL_PITCH] + v * c[BASE_PITCH]
            rho2 = c[LINE_OF_ACTION] - rho1
            rub = c[FRICTION] * force * _sliding(c, rho1 * speed1 - rho2 * speed2 + across)
            normal += force
            rubbing += rub
            moment1 += rub * rho1
            moment2 += rub * rho2
    return normal, rubbing, moment1, moment2


@_compiled
def _back(c: Array, mesh: Mesh, turn: float, speed1: float, dte: float, rate: float, scale: float) -> float:
    """Normal force of the back flanks, whose contacts run from tip to root and pass the pitch point half a pitch
    later; `dte` closes them and is counted from their contact."""
    last = c[TABLE_FIRST] + c[TABLE_PITCH] * (mesh[0].shape[0] - 1)
    sweep = -c[BASE_DRIVER] / c[BASE_PITCH] * speed1
    force = 0.0
    for number in range(floor(turn - 0.5 + c[TABLE_FIRST]), floor(turn - 0.5 + last) + 1):
        clean = dte - mesh[1][number % mesh[1].shape[0], 0] - mesh[2][number % mesh[2].shape[0], 0]
        force += _pair_force(c, mesh, number, number + 0.5 - turn, sweep, clean, rate, scale)
    return force


@_compiled
def _supports(c: Array, s: Array, progress: float, force: Array) -> None:
    """Forces (4,) of the supports on the gears' centres, with opposite sign."""
    for i in range(4):
        lift = c[MODE_SHAPE + 0 + i] * s[8] + c[MODE_SHAPE + 4 + i] * s[9]
        lift_rate = c[MODE_SHAPE + 0 + i] * s[DEGREES + 8] + c[MODE_SHAPE + 4 + i] * s[DEGREES + 9]
        y = s[4 + i] - lift
        k = c[SUPPORT + i] * (1.0 + progress * c[DRIFT + 1 + i // 2])
        if c[SUPPORT_EXPONENT + i] != 0.0:
            k *= (abs(y) / c[SUPPORT_REFERENCE + i]) ** c[SUPPORT_EXPONENT + i]
        force[i] = k * y + c[SUPPORT_DAMPING + i] * (s[DEGREES + 4 + i] - lift_rate)


@_compiled
def _drive(c: Array, time: float, torque: float, s: Array, rate: Array) -> float:
    """Torque on the driver from the coupling; sets the rates of the rotor and of the coupling's twist."""
    if c[TONE] != 0.0:
        torque += c[TONE] * cos(c[TONE + 1] * time + c[TONE + 2])
    angle = c[RIPPLE_ORDER] * (c[SPEED_DRIVER] * time + s[0])
    cosine, sine = cos(angle), sin(angle)
    a, b = 1.0, 0.0
    for k in range(RIPPLES):
        a, b = a * cosine - b * sine, a * sine + b * cosine
        torque += c[RIPPLE + 2 * k] * a + c[RIPPLE + 2 * k + 1] * b
    elastic = c[COUPLING] * s[2 * DEGREES]
    turning = s[DEGREES] - s[DEGREES + 1]
    slip = 0.0
    if c[COUPLING + 2] > 0.0:
        if elastic > c[COUPLING + 2]:
            slip = (elastic - c[COUPLING + 2]) / c[COUPLING + 3]
        elif elastic < -c[COUPLING + 2]:
            slip = (elastic + c[COUPLING + 2]) / c[COUPLING + 3]
    passed = elastic + c[COUPLING + 1] * (turning - slip)
    rate[DEGREES] = (torque - passed) / c[INERTIA]
    rate[2 * DEGREES] = turning - slip
    return passed


@_compiled
def _derivative(c: Array, mesh: Mesh, time: float, torque: float, s: Array, rate: Array, seen: Array) -> None:
    d = DEGREES
    progress = max(time, 0.0) / c[DRIFT + 3]
    angle1, angle2 = c[SPEED_DRIVER] * time + s[1], c[SPEED_DRIVEN] * time + s[2]
    speed1, speed2 = c[SPEED_DRIVER] + s[d + 1], c[SPEED_DRIVEN] + s[d + 2]
    # Geometric centres off the axes: polar angles of both.
    pole1, pole2 = c[ECCENTRICITY_ANGLE] + angle1, c[ECCENTRICITY_ANGLE + 1] - angle2
    e1, e2 = c[ECCENTRICITY], c[ECCENTRICITY + 1]
    x1, y1 = e1 * cos(pole1), e1 * sin(pole1)
    x2, y2 = e2 * cos(pole2), e2 * sin(pole2)
    # Their part in the levers: derivative of dte to each angle.
    lever1 = c[BASE_DRIVER] + x1 * c[COSINE] - y1 * c[SINE]
    lever2 = c[BASE_DRIVEN] - x2 * c[COSINE] + y2 * c[SINE]
    u1, w1 = -y1 * speed1 + s[d + 4], x1 * speed1 + s[d + 5]
    u2, w2 = y2 * speed2 + s[d + 6], -x2 * speed2 + s[d + 7]
    apart_x, apart_y = s[4] + x1 - s[6] - x2, s[5] + y1 - s[7] - y2
    apart_u, apart_w = u1 - u2, w1 - w2
    twist = c[BASE_DRIVER] * s[1] - c[BASE_DRIVEN] * s[2]
    twist_rate = c[BASE_DRIVER] * s[d + 1] - c[BASE_DRIVEN] * s[d + 2]
    dte = twist + apart_y * c[COSINE] + apart_x * c[SINE]
    dte_rate = twist_rate + apart_w * c[COSINE] + apart_u * c[SINE]
    turn = mesh[1].shape[0] * angle1 / (2.0 * pi)
    scale = 1.0 + progress * c[DRIFT]
    force, rub, moment1, moment2 = _working(c, mesh, s, turn, speed1, speed2, dte, dte_rate, scale)
    pull1, pull2 = force * lever1 + moment1, force * lever2 + moment2
    fy = force * c[COSINE] + rub * c[SINE]
    fx = force * c[SINE] - rub * c[COSINE]
    closed = -twist - apart_y * c[COSINE] + apart_x * c[SINE] - c[BACKLASH]
    if closed > -2e-5:  # errors and profile of the back flanks are smaller
        closing = -twist_rate - apart_w * c[COSINE] + apart_u * c[SINE]
        push = _back(c, mesh, turn, speed1, closed, closing, scale)
        pull1 -= push * (c[BASE_DRIVER] + x1 * c[COSINE] + y1 * c[SINE])
        pull2 -= push * (c[BASE_DRIVEN] - x2 * c[COSINE] - y2 * c[SINE])
        fy -= push * c[COSINE]
        fx += push * c[SINE]
    for i in range(d):
        rate[i] = s[d + i]
    passed = _drive(c, time, torque, s, rate)
    shaft = c[SHAFT] * (s[2] - s[3]) + c[SHAFT + 1] * (s[d + 2] - s[d + 3])
    rate[d + 1] = (passed - pull1) / c[INERTIA + 1]
    rate[d + 2] = (pull2 - shaft) / c[INERTIA + 2]
    held = c[GOVERNOR] * s[3] + c[GOVERNOR + 1] * s[d + 3]
    rate[d + 3] = (shaft - c[LOAD_TORQUE] - held) / c[INERTIA + 3]
    # The four slots of the supports are filled first with their forces, then with the accelerations.
    supports = rate[d + 4 : d + 8]
    _supports(c, s, progress, supports)
    for j in range(2):
        total = -c[MODE_STIFFNESS + j] * s[8 + j] - c[MODE_DAMPING + j] * s[d + 8 + j]
        for i in range(4):
            total += c[MODE_SHAPE + 4 * j + i] * supports[i]
        rate[d + 8 + j] = total / c[MODE_MASS + j]
    supports[0] = (-fx - supports[0]) / c[MASS]
    supports[1] = (-fy - supports[1]) / c[MASS]
    supports[2] = (fx - supports[2]) / c[MASS + 1]
    supports[3] = (fy - supports[3]) / c[MASS + 1]
    seen[0], seen[1] = s[1], s[2]
    base1 = c[MODE_SHAPE + 1] * s[8] + c[MODE_SHAPE + 5] * s[9]
    base2 = c[MODE_SHAPE + 3] * s[8] + c[MODE_SHAPE + 7] * s[9]
    seen[2] = s[5] - c[SENSOR_ON_HOUSING] * base1
    seen[3] = s[7] - c[SENSOR_ON_HOUSING] * base2
    seen[4], seen[5], seen[6] = shaft, force, dte


@_compiled
def _run(c: Array, mesh: Mesh, torque: Array, s: Array, h: float, first: int, stride: int, out: Array) -> None:
    """Advance the state `s` in place and fill `out`."""
    k1, k2, k3, k4 = np.empty(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    trial = np.empty(STATES)
    unused = np.empty(len(OUTPUTS))
    last = torque.size
    j = (2 * first) % last
    for row in range(out.shape[0]):
        for inner in range(stride):
            time = (first + row * stride + inner) * h
            _derivative(c, mesh, time, torque[j], s, k1, out[row] if inner == 0 else unused)
            middle = torque[j + 1]
            j = j + 2 if j + 2 < last else 0
            for i in range(STATES):
                trial[i] = s[i] + 0.5 * h * k1[i]
            _derivative(c, mesh, time + 0.5 * h, middle, trial, k2, unused)
            for i in range(STATES):
                trial[i] = s[i] + 0.5 * h * k2[i]
            _derivative(c, mesh, time + 0.5 * h, middle, trial, k3, unused)
            for i in range(STATES):
                trial[i] = s[i] + h * k3[i]
            _derivative(c, mesh, time + h, torque[j], trial, k4, unused)
            for i in range(STATES):
                s[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
