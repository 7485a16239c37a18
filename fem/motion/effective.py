"""The effective mass of a step: the accelerations that balance generalised forces at its instant of balance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.motion.machine import Machine
from gearbench.fem.motion.scheme import Scheme
from gearbench.fem.motion.stage import Room
from gearbench.kernels.compiled import INLINED, ROUNDING, compiled
from gearbench.kernels.small import invert

Array = NDArray[np.float64]


@compiled(fastmath=ROUNDING, **INLINED)
def factorise(machine: Machine, scheme: Scheme, room: Room) -> None:
    """The effective mass, ready to be solved: soft, spread and inverse of the room."""
    h, keep, hubs = scheme.step, 1.0 - scheme.alpha_m, machine.hubs
    viscous = (1.0 - scheme.alpha_f) * h * scheme.gamma
    elastic = (1.0 - scheme.alpha_f) * h * h * scheme.beta
    corner, spread, soft, block, mass = room.corner, room.spread, room.soft, room.block, machine.mass[hubs:]
    for k in range(len(soft)):
        soft[k] = 1.0 / (keep * mass[k] + (viscous * machine.beta + elastic) * machine.squares[k])
    for i in range(hubs):
        for k in range(len(soft)):
            spread[i, k] = keep * corner[i, k] * soft[k]
    for i in range(hubs):
        for j in range(i + 1):
            shared = 0.0
            for k in range(len(soft)):
                shared += spread[i, k] * corner[j, k]
            block[i, j] = block[j, i] = -keep * shared
        block[i, i] += keep * machine.mass[i]
    for i in range(hubs):
        for j in range(hubs):
            total = viscous * machine.hub_damping[i, j] + elastic * machine.hub_stiffness[i, j]
            block[i, j] += total + room.extra_block[i, j]
    for i in range(hubs):
        if machine.held[i]:
            for j in range(hubs):
                block[i, j] = block[j, i] = 0.0
            block[i, i] = 1.0
    invert(block, room.inverse)
    for i in range(hubs):
        if machine.held[i]:
            room.inverse[i, i] = 0.0


@compiled(fastmath=ROUNDING, **INLINED)
def accelerate(room: Room, push: Array, out: Array) -> None:
    """Accelerations (d,) by generalised forces (d,)."""
    hubs, modes = room.corner.shape
    spread, soft, inverse = room.spread, room.soft, room.inverse
    push_modes, out_modes = push[hubs:], out[hubs:]
    for i in range(hubs):
        out[i] = 0.0
    for j in range(hubs):
        head = push[j]
        for k in range(modes):
            head -= spread[j, k] * push_modes[k]
        for i in range(hubs):
            out[i] += inverse[i, j] * head
    for k in range(modes):
        out_modes[k] = push_modes[k] * soft[k]
    for i in range(hubs):
        moved = out[i]
        for k in range(modes):
            out_modes[k] -= spread[i, k] * moved
