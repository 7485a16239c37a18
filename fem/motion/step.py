"""One step of the reduced rig in time: generalised-alpha for the linear part, implicit contact with a damped residual.

Chung and Hulbert (1993), eqs. 9-17. The flanks carry no mass: their residual flexibility obeys
u + beta u' = R(F), integrated by the second-order backward difference, so contact does not chatter. Nothing is
allocated: a step reads one `Stage`, writes another one, and works in a `Room`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.coupling import find_places
from gearbench.fem.contact.law import meet
from gearbench.fem.contact.static import MARGIN
from gearbench.fem.motion.effective import accelerate, factorise
from gearbench.fem.motion.imposed import (
    common_excess,
    hardened,
    impose,
    lag,
    lean,
    load_torque,
    stiffness_factor,
    thicken,
)
from gearbench.fem.motion.machine import Machine, Pace, angles, centres, pace, write_hub_coupling, write_rows
from gearbench.fem.motion.pressed import press
from gearbench.fem.motion.scheme import Scheme
from gearbench.fem.motion.stage import Room, Stage
from gearbench.fem.motion.yielding import (
    SETTLED,
    expect,
    linearise,
    pressing,
    rubs,
    settled,
    write_slides,
    yield_to,
    yields,
)
from gearbench.kernels.compiled import INLINED, ROUNDING, compiled

Array = NDArray[np.float64]


PASSES = 20  # in which forces that are not linear are linearised
LOOKS = 3  # for the tooth pairs near contact, the first one where old rates and accelerations lead
STRAYED = 1e-3  # of the base pitch: how far the step may take the flanks from there for contact to stay as found there


class Torques(NamedTuple):
    """Torques on the outer ends of drive and load [N m]: that which holds the driver at its speed, where that is
    prescribed, and the one on the driven gear."""

    driver: float
    driven: float


class Tried(NamedTuple):
    """How a step went: whether contact was found, and how many tooth pairs are near contact."""

    found: bool
    pairs: int


@compiled(fastmath=ROUNDING, **INLINED)
def predict(machine: Machine, scheme: Scheme, old: Stage, room: Room) -> None:
    """What the next step would bring without new accelerations: d, v and rest of the room."""
    h, am, af, gamma, beta = scheme.step, scheme.alpha_m, scheme.alpha_f, scheme.gamma, scheme.beta
    late, hubs, modes = 1.0 - af, machine.hubs, len(room.soft)
    d, v, rest, corner = room.d, room.v, room.rest, room.corner
    for i in range(len(d)):
        d[i] = old.d[i] + h * old.v[i] + h * h * (0.5 - beta) * old.a[i]
    for i in range(len(d)):
        v[i] = old.v[i] + h * (1.0 - gamma) * old.a[i]
    for i in range(len(d)):
        rest[i] = late * room.outer[i] + af * old.load[i] - am * machine.mass[i] * old.a[i]
    d_modes, v_modes, d_old, v_old = d[hubs:], v[hubs:], old.d[hubs:], old.v[hubs:]
    a_old, behind = old.a[hubs:], rest[hubs:]
    for k in range(modes):
        moving = machine.beta * (late * v_modes[k] + af * v_old[k]) + late * d_modes[k] + af * d_old[k]
        behind[k] -= machine.squares[k] * moving
    for i in range(hubs):
        total, push = rest[i], am * old.a[i]
        for k in range(modes):
            total -= am * corner[i, k] * a_old[k]
        for k in range(modes):
            behind[k] -= corner[i, k] * push
        for j in range(hubs):
            total -= machine.hub_damping[i, j] * (late * v[j] + af * old.v[j])
            total -= machine.hub_stiffness[i, j] * (late * d[j] + af * old.d[j])
        rest[i] = total


@compiled(fastmath=ROUNDING, **INLINED)
def recall(old: Stage, known: int, new: Stage, n: int, machine: Machine, h: float, lately: float, room: Room) -> float:
    """What the last step left of the n pairs of the new stage, of which it knew `known`: forces to expect and what they
    were, held and memory; returns the part of a residual that follows the force at once.

    The backward difference of u + beta u' = R with steps h, after `lately`, is
    (1 + slow) u = R + beta/h ((1 + w) u_1 - w^2/(1 + w) u_2), w = h/lately, slow = beta/h (1 + 2 w)/(1 + w).
    """
    w = h / lately if lately > 0.0 else 1.0
    rate = machine.beta / h
    slow = rate * (1.0 + 2.0 * w) / (1.0 + w)
    gain = 1.0 / (1.0 + slow)
    for p in range(n):
        new.before[p] = new.force[p] = 0.0
        room.memory[p] = room.held[p] = 0.0
        room.arrived[p], room.desk.known[p] = True, False
        for q in range(known):
            if old.pairs[q].side == new.pairs[p].side and old.pairs[q].tooth == new.pairs[p].tooth:
                force = old.force[q]
                ahead = force + w * (force - old.before[q])
                new.before[p] = force
                new.force[p] = ahead if 0.0 < ahead < 2.0 * force else force
                room.held[p] = old.residual[q]
                u1, u2 = old.residual[q], old.older[q]
                room.memory[p] = gain * rate * ((1.0 + w) * u1 - w * w / (1.0 + w) * u2)
                room.arrived[p] = False
                break
    return gain


@compiled(fastmath=ROUNDING, **INLINED)
def conclude(machine: Machine, scheme: Scheme, new: Stage, n: int, gain: float, room: Room) -> None:
    """Unknowns, rates, accelerations, generalised forces and residuals under the forces that were found."""
    h, late = scheme.step, 1.0 - scheme.alpha_f
    for i in range(len(new.d)):
        new.load[i] = room.outer[i]
    for p in range(n):
        force = new.force[p]
        if force > 0.0:
            for i in range(len(new.d)):
                new.load[i] += force * room.rows[p, i]
            for i in range(len(new.d)):
                new.a[i] += late * force * room.moved[p, i]
            if machine.loaded_at >= 0:
                new.load[machine.loaded_at] -= force * room.lean[p]
    for i in range(len(new.d)):
        new.d[i] = room.d[i] + scheme.beta * h * h * new.a[i]
    for i in range(len(new.d)):
        new.v[i] = room.v[i] + scheme.gamma * h * new.a[i]
    for p in range(n):
        pushed = 0.0
        for q in range(n):
            if new.force[q] > 0.0:
                pushed += room.cross[p, q] * new.force[q]
        if new.force[p] > 0.0:
            pushed += room.desk.own[p]
        new.residual[p] = room.memory[p] + gain * pushed
        new.older[p] = room.held[p]


@compiled(fastmath=ROUNDING, **INLINED)
def torques(machine: Machine, new: Stage, n: int, torque: float, nominal: Pace, room: Room) -> Torques:
    """Torques on the outer ends of drive and load after a step that found n pairs, under the driver torque [N m]."""
    at, hubs = machine.at, machine.hubs
    n1, n2 = machine.hub1.shape[1], machine.hub2.shape[1]
    load = load_torque(machine, torque)
    one, two, balanced, ratio = 0.0, 0.0, 0.0, machine.law.driven.rb / machine.law.driver.rb
    for p in range(n):
        sign = 1.0 - 2.0 * new.pairs[p].side
        one += sign * new.pairs[p].lever1 * new.force[p]
        two += sign * new.pairs[p].lever2 * new.force[p]
        balanced += new.force[p] * room.lean[p]
        if rubs(machine):
            rubbed = room.turned[p] * new.force[p]
            one += rubbed * room.arm1[p]
            two += rubbed * room.arm2[p]
            balanced += rubbed * machine.balance.losses * (room.arm2[p] - ratio * room.arm1[p])
    for k in range(n1):
        one += machine.hub1[2, k] * new.a[hubs + k]
    for k in range(n2):
        two += machine.hub2[2, k] * new.a[hubs + n1 + k]
    stiffness, damping = machine.drive_shaft
    if stiffness > 0.0:
        one = -stiffness * new.d[at.driver] - damping * new.v[at.driver]
    stiffness, damping = machine.load_shaft
    if machine.loaded_at >= 0:
        two = load + balanced
    elif stiffness > 0.0:
        two = stiffness * new.d[at.driven] + damping * new.v[at.driven]
    course = machine.course
    return Torques(one + course.inertia1 * nominal.pull1, two - course.inertia2 * nominal.pull2)


@compiled(fastmath=ROUNDING, **INLINED)
def seek(machine: Machine, new: Stage, theta1: float, theta2: float, nominal: Pace, room: Room) -> int:
    """Find the tooth pairs near contact where they are sought; returns how many."""
    apart = centres(machine, room.sought)
    pitch = machine.law.driven.pitch
    excess = common_excess(machine.correction, theta2 / pitch)
    n = meet(machine.law, theta1, theta2, apart.x, apart.y, MARGIN + excess.value, new.pairs)
    thicken(new.pairs, n, excess.value, excess.slope / pitch)
    find_places(machine.law, new.pairs, n, room.places)
    write_rows(machine, new.pairs, n, room.places, room.rows)
    lean(machine, new.pairs, n, room.lean)
    if rubs(machine):
        write_slides(machine, new, n, apart, nominal, room)
    return n


@compiled(fastmath=ROUNDING, **INLINED)
def strayed(machine: Machine, new: Stage, room: Room) -> bool:
    """Whether the step led so far from where tooth pairs were sought that others touch, or the same elsewhere."""
    at, law, d, sought = machine.at, machine.law, new.d, room.sought
    turned = law.driver.rb * (d[at.driver] - sought[at.driver])
    if at.driven >= 0:
        turned -= law.driven.rb * (d[at.driven] - sought[at.driven])
    moved = abs(turned) + abs(d[at.y1] - sought[at.y1] - d[at.y2] + sought[at.y2])
    if at.x1 >= 0:
        moved += abs(d[at.x1] - sought[at.x1] - d[at.x2] + sought[at.x2])
    return bool(moved > STRAYED * law.driver.rb * law.driver.pitch)


@compiled(fastmath=ROUNDING, **INLINED)
def let_go(machine: Machine, scheme: Scheme, new: Stage, room: Room) -> None:
    """Accelerations and unknowns of the new stage without new contact forces."""
    factorise(machine, scheme, room)
    for i in range(len(room.push)):
        room.push[i] = room.rest[i]
    for i in range(machine.hubs):
        room.push[i] += room.extra[i]
    accelerate(room, room.push, new.a)
    for i in range(len(new.d)):
        new.d[i] = room.d[i] + scheme.beta * scheme.step * scheme.step * new.a[i]


# Taken into its one caller before types are inferred: compiled apart it would be compiled twice.
@compiled(inline="always")
def try_step(
    machine: Machine, scheme: Scheme, old: Stage, known: int, new: Stage, t: float, lately: float, torque: float,
    room: Room,
) -> Tried:  # fmt: skip
    """The stage a step after `old`, which is that of the time t [s], knows `known` pairs and came about by a step of
    `lately` [s] (0: by rest), under the driver torque [N m] at the step's end."""
    h = scheme.step
    # The modes turn with their gear: the balance is that of the instant within the step at which it is struck.
    late = (1.0 - scheme.alpha_f) * h
    theta1, theta2 = angles(machine, old.d, t)
    before, nominal = pace(machine, t), pace(machine, t + h)
    write_hub_coupling(machine, theta1 + late * before.speed1, theta2 + late * before.speed2, room.corner)
    impose(machine, torque, theta1 + h * (before.speed1 + old.v[0]), room.outer)
    if len(machine.course.time) > 0:
        lag(machine, nominal, room.outer)
    predict(machine, scheme, old, room)
    # To Numba a plain 0 is a type of its own, for which helpers would be compiled once more.
    n, gain, soft, factor, found, looks, look, fresh = 0 * known, 1.0, 1.0, 1.0, False, 0, True, True
    # The first pass finds the pairs, and another one where the step led far from there; where forces are not linear
    # others follow until they are linearised where it leads. Each helper is called at one place: every other one would
    # be compiled once more.
    for _ in range(PASSES):
        if yields(machine):
            if fresh:
                expect(machine, scheme, old, n, room)
                fresh = False
            linearise(machine, scheme, new, n, room)
        let_go(machine, scheme, new, room)
        if look:
            if looks == 0:
                for i in range(machine.hubs):
                    room.sought[i] = old.d[i] + h * old.v[i] + 0.5 * h * h * old.a[i]
            look, looks = False, looks + 1
            theta1, theta2 = angles(machine, room.sought, t + h)
            factor = stiffness_factor(machine.correction, theta2 / machine.law.driven.pitch, t + h)
            soft = 1.0 / hardened(machine.correction, factor, pressing(old, known))
            n = seek(machine, new, theta1, theta2, nominal, room)
            gain = recall(old, known, new, n, machine, h, lately, room)
            if rubs(machine):
                fresh = True
                continue
        found = press(machine, scheme, new, n, gain, soft, room)
        conclude(machine, scheme, new, n, gain, room)
        if found and strayed(machine, new, room):
            found = False
            if looks == LOOKS:
                break
            look = True
            for i in range(machine.hubs):
                room.sought[i] = new.d[i]
            continue
        if not found or not yields(machine):
            break
        last, done = soft, settled(machine, new, n, room)
        if machine.correction.exponent != 0.0:
            soft = 1.0 / hardened(machine.correction, factor, pressing(new, n))
        if done and abs(soft - last) <= SETTLED * last:
            break
        found = False
        for p in range(n):
            room.desk.known[p] = False
    if yields(machine):
        yield_to(machine, new, n, room)
    return Tried(found, n)
