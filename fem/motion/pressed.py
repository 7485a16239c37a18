"""What tooth pairs press with in a step, given where everything else leaves their flanks."""

from __future__ import annotations

from gearbench.fem.contact.coupling import couple
from gearbench.fem.contact.sharing import share
from gearbench.fem.motion.effective import accelerate
from gearbench.fem.motion.machine import Machine
from gearbench.fem.motion.scheme import Scheme
from gearbench.fem.motion.stage import Room, Stage
from gearbench.fem.motion.yielding import rubs
from gearbench.kernels.compiled import INLINED, ROUNDING, compiled


@compiled(fastmath=ROUNDING, **INLINED)
def soften(
    machine: Machine, scheme: Scheme, new: Stage, n: int, q: int, gain: float, soft: float, room: Room
) -> None:
    """Fill column q of cross and flexibility for n pairs; soft: one over the factor on the mesh force."""
    late, hubs = 1.0 - scheme.alpha_f, machine.hubs
    rows, moved = room.rows, room.moved
    couple(machine.law, new.pairs, n, room.places, q, room.cross)
    for i in range(rows.shape[1]):
        room.push[i] = rows[q, i]
    if machine.loaded_at >= 0:
        room.push[machine.loaded_at] -= room.lean[q]
    if rubs(machine):
        for i in range(hubs):
            room.push[i] += room.turned[q] * room.rub[q, i]
    accelerate(room, room.push, moved[q])
    pushed = rows[q, hubs:]
    for p in range(n):
        modal, pressed = 0.0, rows[p, hubs:]
        for k in range(len(room.ease)):
            modal += pressed[k] * pushed[k] * room.ease[k]
        room.cross[p, q] = room.cross[p, q] * soft - modal
        shift = 0.0
        for i in range(rows.shape[1]):
            shift += rows[p, i] * moved[q, i]
        room.flexibility[p, q] = gain * room.cross[p, q] + scheme.beta * scheme.step * scheme.step * late * shift
    room.desk.known[q] = True


@compiled(fastmath=ROUNDING, **INLINED)
def overlap(machine: Machine, new: Stage, n: int, gain: float, room: Room) -> None:
    """Overlaps of n pairs that rigid motion, modes and what the residual carries over leave to new forces."""
    slow, moved = 1.0 - gain, new.d[machine.hubs :]
    for p in range(n):
        if room.arrived[p]:
            # A pair that is new comes with the residual that its neighbours' forces hold it at.
            room.held[p] = 0.0
            for q in range(n):
                if new.before[q] > 0.0:
                    room.held[p] += room.cross[p, q] * new.before[q]
            room.memory[p] = slow * room.held[p]
        over = -new.pairs[p].gap - room.memory[p]
        for i in range(machine.hubs):
            over -= room.rows[p, i] * (new.d[i] - room.sought[i])
        row = room.rows[p, machine.hubs :]
        for k in range(len(moved)):
            over -= row[k] * moved[k]
        room.over[p] = over


@compiled(fastmath=ROUNDING, **INLINED)
def press(machine: Machine, scheme: Scheme, new: Stage, n: int, gain: float, soft: float, room: Room) -> bool:
    """The forces of n pairs; whether they were found. Only the columns of the flexibility that forces need are made:
    first those of the forces to expect."""
    column = 0
    while True:
        while column < n and not new.force[column] > 0.0:
            column += 1
        wanted = column
        if column >= n:
            if column == n:
                overlap(machine, new, n, gain, room)
                column += 1
            shared = share(
                machine.law.curves, new.pairs, n, room.over, room.flexibility, gain, soft, new.force, room.desk
            )
            if shared.wanted < 0:
                return shared.found
            wanted = shared.wanted
        else:
            column += 1
        soften(machine, scheme, new, n, wanted, gain, soft, room)
