"""How tooth pairs near contact share a load: unilateral contact with each pair's own curve, by Newton's method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import Curves, Cut, along_cut, load_node, pair_cut
from gearbench.fem.contact.law import PAIRS, Meetings, contact_in
from gearbench.kernels.compiled import INNER, compiled
from gearbench.kernels.small import solve_in_place

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CUT = np.dtype([(name, np.int64 if name == "node" else np.float64) for name in Cut._fields])

ENTERS = 1e-15  # overlap [m] left by a pair without force from which on it carries
FIRST = 1e-6  # [N]: force with which a pair begins to carry
LEAVES = 1e-9  # [N]: force below which it no longer does
ITERATIONS = 100
CALM = 20  # iterations after which the steps of Newton's method are shortened
CLOSE = 1e-8  # relative change of the forces; Newton's method squares it once more


class Shared(NamedTuple):
    """How the pairs share a load: forces (n,) [N], flexibility (n, n) [m/N] tangent to that state, flags (n,) of the
    pairs that carry, and whether it was found."""

    force: Array
    flexibility: Array
    active: Flags
    converged: bool


class Desk(NamedTuple):
    """Room to work in: flags (PAIRS,) of the pairs that carry and of those whose column of the flexibility is known,
    the curves where they touch, the approach [m] of each alone and its slope [m/N], what the forces of the other pairs
    and of all leave of the overlaps, and the equations of Newton's method."""

    active: Flags
    known: Flags
    cuts: NDArray[np.void]
    own: Array
    slope: Array
    alone: Array
    left: Array
    tangent: Array
    system: Array
    change: Array


class Outcome(NamedTuple):
    """Whether forces were found, or else the pair whose column of the flexibility they need (-1: none)."""

    found: bool
    wanted: int


def desk() -> Desk:
    """Room for PAIRS pairs, no column known."""
    active, known = np.zeros(PAIRS, np.bool_), np.zeros(PAIRS, np.bool_)
    own, slope, alone, left, change = np.zeros((5, PAIRS))
    square, wide = np.zeros((PAIRS, PAIRS)), np.zeros((PAIRS, PAIRS + 1))
    return Desk(active, known, np.zeros(PAIRS, CUT), own, slope, alone, left, square, wide, change)


@compiled(forceinline=True, **INNER)
def own_approach(curves: Curves, pairs: Meetings, cuts: NDArray[np.void], p: int, force: float):
    """Approach [m] of pair p alone under a force [N], and its slope [m/N], by its cut, renewed where it must be."""
    node = load_node(curves.driver, force)
    if cuts[p].node != node:
        new = pair_cut(curves, contact_in(pairs, p), node)
        at = cuts[p]
        at.node, at.c0, at.c1, at.c2, at.c3 = new
    at = cuts[p]
    return along_cut(curves.driver, Cut(at.node, at.c0, at.c1, at.c2, at.c3), force)


@compiled(forceinline=True, **INNER)
def newton_change(n: int, left: Array, tangent: Array, active: Flags, system: Array, change: Array) -> None:
    """Write the change of the active forces that closes what is left of the first n overlaps, to first order, into
    `change`; zero for the others."""
    m = 0 * n  # to Numba a plain 0 is a type of its own, for which the solver would be compiled once more
    for p in range(n):
        m += active[p]
    row = 0
    for p in range(n):
        if active[p]:
            column = 0
            for q in range(n):
                if active[q]:
                    system[row, column] = tangent[p, q]
                    column += 1
            system[row, m] = left[p]
            row += 1
    solve_in_place(system, m)
    row = 0
    for p in range(n):
        change[p] = 0.0
        if active[p]:
            change[p] = system[row, m]
            row += 1


@compiled(**INNER)
def newton_step(left: Array, tangent: Array, active: Flags) -> Array:
    """Change (n,) of the active forces that closes what is left (n,) to first order; zero elsewhere."""
    n = len(left)
    out = np.zeros(n)
    newton_change(n, left, tangent, active, np.empty((n, n + 1)), out)
    return out


@compiled(forceinline=True, **INNER)
def improve(n: int, force: Array, desk: Desk, turn: int) -> bool:
    """One step of Newton's method; whether it hardly changed the forces."""
    newton_change(n, desk.left, desk.tangent, desk.active, desk.system, desk.change)
    settled = True
    for p in range(n):
        if not desk.active[p]:
            continue
        new = force[p] + (desk.change[p] if turn < CALM else 0.5 * desk.change[p])
        if new <= 0.0:
            settled = False
            # The curve has a logarithm at zero: while others move, only a pair without overlap leaves at once.
            new = 0.1 * force[p]
            if new < LEAVES or (turn < CALM and desk.alone[p] <= ENTERS):
                desk.active[p] = False
                new = 0.0
        elif not abs(new - force[p]) <= CLOSE * max(new, FIRST):
            settled = False
        # The last change is so small that the approach goes along its tangent.
        desk.own[p] += desk.slope[p] * (new - force[p])
        force[p] = new
    return settled


@compiled(forceinline=True)
def share(
    curves: Curves, pairs: Meetings, n: int, over: Array, flexibility: Array, gain: float, soft: float, force: Array,
    desk: Desk,
) -> Outcome:  # fmt: skip
    """Forces >= 0 of the first n pairs with over = flexibility F + gain D(soft F) on loaded pairs and over <=
    flexibility F on the others, where D is each pair's own curve: Newton's method with an active set.

    over (n,) [m]; flexibility (n, n) [m/N], columns of the pairs that `desk` knows; force (n,) [N]: guess, overwritten.
    """
    for p in range(n):
        desk.active[p] = force[p] > 0.0
        if desk.active[p] and not desk.known[p]:
            return Outcome(False, p)
        desk.cuts[p].node = -1
    for turn in range(ITERATIONS):
        changed = False
        for p in range(n):
            left, taken = over[p], 0.0
            for q in range(n):
                if desk.active[q]:
                    if q != p:
                        left -= flexibility[p, q] * force[q]
                    desk.tangent[p, q] = flexibility[p, q]
            desk.alone[p] = left
            if desk.active[p]:
                desk.own[p], slope = own_approach(curves, pairs, desk.cuts, p, soft * force[p])
                desk.slope[p] = soft * slope
                taken = flexibility[p, p] * force[p] + gain * desk.own[p]
                desk.tangent[p, p] += gain * desk.slope[p]
            elif left > ENTERS:
                if not desk.known[p]:
                    return Outcome(False, p)
                desk.active[p] = changed = True
                force[p] = FIRST
            desk.left[p] = left - taken
        if not changed and improve(n, force, desk, turn):
            return Outcome(True, -1)
    return Outcome(False, -1)


@compiled
def share_load(
    curves: Curves, pairs: Meetings, over: Array, flexibility: Array, gain: float, guess: Array
) -> Shared:
    """`share` with all of the flexibility (n, n) [m/N] given; guess (n,) [N]."""
    n = len(over)
    room = Desk(
        np.zeros(n, np.bool_), np.ones(n, np.bool_), np.zeros(n, CUT), np.zeros(n), np.zeros(n), np.zeros(n),
        np.zeros(n), np.zeros((n, n)), np.zeros((n, n + 1)), np.zeros(n),
    )  # fmt: skip
    force = guess[:n].copy()
    outcome = share(curves, pairs, n, over, flexibility, gain, 1.0, force, room)
    tangent = flexibility.copy()
    for p in range(n):
        if room.active[p]:
            tangent[p, p] += gain * room.slope[p]
    return Shared(force, tangent, room.active, outcome.found)
