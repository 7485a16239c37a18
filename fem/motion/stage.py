"""What steps of the reduced rig start from, end at and work in: everything that a loop needs to be allocated once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.coupling import PLACE, Places
from gearbench.fem.contact.law import MEETING, PAIRS, Meetings
from gearbench.fem.contact.sharing import Desk, desk
from gearbench.fem.motion.machine import Machine

Array = NDArray[np.float64]


class Stage(NamedTuple):
    """What a step starts from or ends at.

    d, v, a, load (d,): unknowns, rates, accelerations and generalised forces; pairs (PAIRS,): tooth pairs near contact;
    of each (PAIRS,): force, its value a step before [N], residual and its value a step before [m].
    """

    d: Array
    v: Array
    a: Array
    load: Array
    pairs: Meetings
    force: Array
    before: Array
    residual: Array
    older: Array


class Room(NamedTuple):
    """Where a step works.

    corner, spread (hubs, modes): coupling mass, and its part of the effective mass over the modes' own; soft (modes,):
    inverse effective mass of the modes; ease (modes,): their static flexibility; block, inverse (hubs, hubs): of the
    effective mass after elimination of the modes, and its inverse. d, v, rest, free, outer, inertia (d,): displacements
    and rates that old accelerations bring, forces that the new accelerations must balance, these without new contact
    forces, imposed forces, M a.
    rows, moved (PAIRS, d): contact rows and the accelerations by a unit force on each; cross, flexibility (PAIRS,
    PAIRS): residual and effective flexibility [m/N]; over, memory, held (PAIRS,): overlap, the residual that a pair
    carries over, and the residual of the step before [m]; arrived (PAIRS,): pairs that the step before did not know.
    sought (hubs,): hubs' unknowns at which pairs were sought; lean
    (PAIRS,): what the load's torque takes up of a pair's force [m]. Of forces on the hubs that are not linear: extra,
    extra_block: what they add to rest and block; slide, rub (PAIRS, hubs): sliding velocity by the rates, and friction
    on the unknowns per force of it; arm1, arm2, steady, sliding (PAIRS,): arms of friction [m], sliding velocity of the
    steady rotation and that at which it was linearised [m/s]; turned, grip (PAIRS,): friction over force there, and its
    derivative by the velocity [N s/m]; stretched, tangent (springs,): likewise of non-linear supports.
    """

    corner: Array
    spread: Array
    soft: Array
    ease: Array
    block: Array
    inverse: Array
    d: Array
    v: Array
    rest: Array
    outer: Array
    push: Array
    rows: Array
    moved: Array
    cross: Array
    flexibility: Array
    over: Array
    memory: Array
    held: Array
    sought: Array
    lean: Array
    extra: Array
    extra_block: Array
    slide: Array
    rub: Array
    arm1: Array
    arm2: Array
    steady: Array
    sliding: Array
    turned: Array
    grip: Array
    stretched: Array
    tangent: Array
    arrived: NDArray[np.bool_]
    places: Places
    desk: Desk


def make_stage(size: int) -> Stage:
    """A stage of `size` unknowns at rest."""
    d, v, a, load = (np.zeros(size) for _ in range(4))
    force, before, residual, older = (np.zeros(PAIRS) for _ in range(4))
    return Stage(d, v, a, load, np.zeros(PAIRS, MEETING), force, before, residual, older)


def make_room(machine: Machine) -> Room:
    """Room for a machine's steps."""
    hubs, modes, size = machine.hubs, len(machine.squares), len(machine.mass)
    pair, square, springs = (PAIRS,), (PAIRS, PAIRS), (len(machine.springs.stiffness),)
    return Room(
        corner=np.zeros((hubs, modes)),
        spread=np.zeros((hubs, modes)),
        soft=np.zeros(modes),
        ease=1.0 / machine.squares,
        block=np.zeros((hubs, hubs)),
        inverse=np.zeros((hubs, hubs)),
        d=np.zeros(size),
        v=np.zeros(size),
        rest=np.zeros(size),
        outer=np.zeros(size),
        push=np.zeros(size),
        rows=np.zeros((PAIRS, size)),
        moved=np.zeros((PAIRS, size)),
        cross=np.zeros(square),
        flexibility=np.zeros(square),
        over=np.zeros(pair),
        memory=np.zeros(pair),
        held=np.zeros(pair),
        sought=np.zeros(hubs),
        lean=np.zeros(pair),
        extra=np.zeros(hubs),
        extra_block=np.zeros((hubs, hubs)),
        slide=np.zeros((PAIRS, hubs)),
        rub=np.zeros((PAIRS, hubs)),
        arm1=np.zeros(pair),
        arm2=np.zeros(pair),
        steady=np.zeros(pair),
        sliding=np.zeros(pair),
        turned=np.zeros(pair),
        grip=np.zeros(pair),
        stretched=np.zeros(springs),
        tangent=np.zeros(springs),
        arrived=np.zeros(pair, np.bool_),
        places=np.zeros(pair, PLACE),
        desk=desk(),
    )
