"""Forces that are not linear: friction between the flanks and non-linear supports, linearised anew in every pass of a
step, and what the flanks press with, on which an exponent of the mesh force depends.

Friction of a pair opposes the sliding velocity of its flanks at that instant, vibration included, by F mu tanh(v/v0).
On the common normal n, with the arms of both gears from the feet of their base circles' tangents to the contact,

    v = arm1 (Omega1 + d theta1') - arm2 (Omega2 + d theta2') + (c1' - c2') . (-n_y, n_x)

for both flank sides, c' being the centres' velocities; arm1 + arm2 is the centre distance along n, so that friction's
moments balance about any point.
"""

from __future__ import annotations

from math import tanh

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.kinematics import CORNER1, EDGE1
from gearbench.fem.motion.machine import Machine, Pace, Vector
from gearbench.fem.motion.scheme import Scheme
from gearbench.fem.motion.stage import Room, Stage
from gearbench.kernels.compiled import INLINED, ROUNDING, compiled

Array = NDArray[np.float64]

SETTLED = 1e-9  # relative error of a linearised force that is left
AT_REST = 1e-6  # of the reference deflection: within it a support's tangent stiffness is that there


@compiled(**INLINED)
def rubs(machine: Machine) -> bool:
    """Whether there is friction."""
    return machine.rubbing.coefficient > 0.0


@compiled(**INLINED)
def yields(machine: Machine) -> bool:
    """Whether forces are not linear, on the hubs or by the exponent of the mesh."""
    return rubs(machine) or len(machine.springs.stiffness) > 0 or machine.correction.exponent != 0.0


@compiled(**INLINED)
def pressing(stage: Stage, n: int) -> float:
    """What n pairs press with in all [N]."""
    total = 0.0
    for p in range(n):
        total += stage.force[p]
    return total


@compiled(fastmath=ROUNDING, **INLINED)
def write_slides(machine: Machine, new: Stage, n: int, apart: Vector, nominal: Pace, room: Room) -> None:
    """How the hubs' unknowns make n pairs slide, and how friction acts on them, the load's balance of it included."""
    at, ratio = machine.at, machine.law.driven.rb / machine.law.driver.rb
    for p in range(n):
        k = new.pairs[p]
        along_normal = apart.x * k.nx + apart.y * k.ny
        # The master's arm is the roll length of the foot on its involute.
        arm1 = along_normal - k.xi2 if k.slave == EDGE1 or k.slave == CORNER1 else k.xi1
        arm2 = along_normal - arm1
        room.arm1[p], room.arm2[p] = arm1, arm2
        room.steady[p] = arm1 * nominal.speed1 - arm2 * nominal.speed2
        slide = room.slide[p]
        slide[at.driver] = arm1
        if at.driven >= 0:
            slide[at.driven] = -arm2
        along = k.nx * machine.axis_y - k.ny * machine.axis_x
        slide[at.y1], slide[at.y2] = along, -along
        if at.x1 >= 0:
            across = -k.ny * machine.axis_y - k.nx * machine.axis_x
            slide[at.x1], slide[at.x2] = across, -across
        for i in range(machine.hubs):
            room.rub[p, i] = -slide[i]
        if machine.loaded_at >= 0:
            room.rub[p, machine.loaded_at] -= machine.balance.losses * (arm2 - ratio * arm1)


@compiled(fastmath=ROUNDING, **INLINED)
def sliding_speed(machine: Machine, rates: Array, p: int, room: Room) -> float:
    """Sliding velocity [m/s] of pair p at the rates of the unknowns."""
    total = room.steady[p]
    for i in range(machine.hubs):
        total += room.slide[p, i] * rates[i]
    return total


@compiled(fastmath=ROUNDING, **INLINED)
def stretch(machine: Machine, d: Array, m: int) -> float:
    """Deflection [m] of non-linear support m at the unknowns d."""
    total = 0.0
    for i in range(machine.hubs):
        total += machine.springs.rows[m, i] * d[i]
    return total


@compiled(fastmath=ROUNDING, **INLINED)
def pull(machine: Machine, m: int, s: float) -> float:
    """Force [N] of non-linear support m at the deflection s [m]."""
    springs = machine.springs
    return springs.stiffness[m] * s * abs(s / springs.reference[m]) ** springs.exponent[m]


@compiled(fastmath=ROUNDING, **INLINED)
def expect(machine: Machine, scheme: Scheme, old: Stage, n: int, room: Room) -> None:
    """Where to linearise first: where old rates and accelerations lead."""
    h = scheme.step
    for p in range(n):
        speed = room.steady[p]
        for i in range(machine.hubs):
            speed += room.slide[p, i] * (old.v[i] + h * old.a[i])
        room.sliding[p] = speed
    for m in range(len(machine.springs.stiffness)):
        s = 0.0
        for i in range(machine.hubs):
            s += machine.springs.rows[m, i] * (old.d[i] + h * old.v[i] + 0.5 * h * h * old.a[i])
        room.stretched[m] = s


@compiled(fastmath=ROUNDING, **INLINED)
def linearise(machine: Machine, scheme: Scheme, new: Stage, n: int, room: Room) -> None:
    """What the forces add to the effective mass and to what the new accelerations must balance."""
    h, late, hubs = scheme.step, 1.0 - scheme.alpha_f, machine.hubs
    viscous, elastic = late * h * scheme.gamma, late * h * h * scheme.beta
    rubbing, springs = machine.rubbing, machine.springs
    for i in range(hubs):
        room.extra[i] = 0.0
        for j in range(hubs):
            room.extra_block[i, j] = 0.0
    for p in range(n):
        turned = tanh(room.sliding[p] * rubbing.steepness)
        room.turned[p] = rubbing.coefficient * turned
        room.grip[p] = rubbing.coefficient * new.force[p] * rubbing.steepness * (1.0 - turned * turned)
        faster = sliding_speed(machine, room.v, p, room) - room.sliding[p]
        for i in range(hubs):
            room.extra[i] += late * room.grip[p] * room.rub[p, i] * faster
            for j in range(hubs):
                room.extra_block[i, j] -= viscous * room.grip[p] * room.rub[p, i] * room.slide[p, j]
    for m in range(len(springs.stiffness)):
        s, e = room.stretched[m], springs.exponent[m]
        far = max(abs(s), AT_REST * springs.reference[m]) / springs.reference[m]
        tangent = springs.stiffness[m] * (1.0 + e) * far**e
        room.tangent[m] = tangent
        further = pull(machine, m, s) + tangent * (stretch(machine, room.d, m) - s)
        for i in range(hubs):
            room.extra[i] -= late * springs.rows[m, i] * further
            for j in range(hubs):
                room.extra_block[i, j] += elastic * tangent * springs.rows[m, i] * springs.rows[m, j]


@compiled(fastmath=ROUNDING, **INLINED)
def settled(machine: Machine, new: Stage, n: int, room: Room) -> bool:
    """Whether the forces were linearised where the step led; if not, they will be there. A sliding velocity that has
    turned round is linearised at rest: between the saturated ends tangents would lead to and fro for ever, from the
    middle, where friction is steepest, they lead outwards step by step."""
    rubbing, springs, close = machine.rubbing, machine.springs, True
    for p in range(n):
        speed, force = sliding_speed(machine, new.v, p, room), new.force[p]
        taken = room.turned[p] * force + room.grip[p] * (speed - room.sliding[p])
        true = rubbing.coefficient * tanh(speed * rubbing.steepness)
        if abs(true * force - taken) > SETTLED * rubbing.coefficient * force:
            close = False
        room.turned[p] = true
        room.sliding[p] = speed if speed * room.sliding[p] >= 0.0 else 0.0
    for m in range(len(springs.stiffness)):
        s = stretch(machine, new.d, m)
        force = pull(machine, m, s)
        taken = pull(machine, m, room.stretched[m]) + room.tangent[m] * (s - room.stretched[m])
        if abs(force - taken) > SETTLED * max(abs(force), AT_REST * springs.stiffness[m] * springs.reference[m]):
            close = False
        room.stretched[m] = s
    return close


@compiled(fastmath=ROUNDING, **INLINED)
def yield_to(machine: Machine, new: Stage, n: int, room: Room) -> None:
    """Add the forces as they are to the generalised forces of the new stage."""
    for p in range(n):
        for i in range(machine.hubs):
            new.load[i] += room.turned[p] * new.force[p] * room.rub[p, i]
    for m in range(len(machine.springs.stiffness)):
        force = pull(machine, m, room.stretched[m])
        for i in range(machine.hubs):
            new.load[i] -= machine.springs.rows[m, i] * force
