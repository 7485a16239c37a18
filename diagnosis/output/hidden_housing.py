"""A housing on which the displacement sensors stand: they see none of its motion, so that nothing but the transmission
error shows where it resonates.

What a housing of little compliance c adds to a line at a frequency w is to first order c E(w) g(w), with g its answer
over its compliance, 1 / (1 - r^2 + 2 i zeta r) and r the ratio of w to its own frequency. So one simulation of a stiff
one tells E, and resonances of any frequency and damping follow without a simulation: many are compared on the excited
lines, and only the best are simulated.
"""

from __future__ import annotations

from itertools import product
from math import exp, log, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.signals import frequencies
from gearbench.diagnosis.output.simulator import Simulator
from gearbench.diagnosis.output.structure import (
    ACROSS,
    ACROSS_BEGIN,
    HOUSING,
    HOUSING_RATIO,
    MODE,
    MOTIONS,
    OBLIQUE,
    SIDES,
    STIFFEST,
    pace_of,
    seated,
    with_motion,
)
from gearbench.diagnosis.output.target import Target

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

# Of the motion that tells E: logarithm of its frequency over the supports', and its compliance.
STIFF_AT, STIFF = 1.8, 0.01
# Where resonances are looked for: logarithms of the frequency, damping ratios, and compliances over the supports'.
SOUGHT_AT = tuple(np.linspace(-2.2, 1.0, 97))
RATIOS = (0.02, 0.035, 0.06)
PARTS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1)


class Lines(NamedTuple):
    """Excited lines, block after block: their numbers (n,) among those of a target, angular frequencies (n,) [rad/s],
    and of the blocks where they begin, floors, independent counts and sizes (blocks,)."""

    at: Integers
    omega: Array
    begin: Integers
    floors: Array
    counts: Array
    sizes: Array

    def costs(self, residual: Complex) -> Array:
        """Nats (...) that residuals (..., n) cost."""
        sums = np.add.reduceat(np.abs(residual) ** 2, self.begin, axis=-1)
        return np.asarray((self.counts * np.log1p(sums / self.sizes / self.floors)).sum(axis=-1))


class Resonance(NamedTuple):
    """A motion of the housing: its kind, shares across (2,), logarithm of its frequency, damping ratio and
    compliance."""

    kind: int
    across: tuple[float, ...]
    at: float
    ratio: float
    part: float


def hidden_housings(simulator: Simulator, p: Array) -> list[Array]:
    """`p` (size,) with sensors on a housing whose resonances explain the excited lines best, one and two of them;
    nothing where a rig has none to find, or no line is excited."""
    unknowns = simulator.layout.unknowns
    if HOUSING not in unknowns.slices:
        return []
    plain, lines = _without(unknowns, p), excited_lines(simulator.target)
    here = simulator.lines(plain)
    if lines is None or here is None:
        return []
    left = (simulator.target.lines - here)[lines.at]
    shares = _shares(simulator, plain, here, lines)
    if not shares:
        return []
    pace = pace_of(simulator.layout.model)
    alone, rest = _best(shares, left, lines, pace)
    pair, parts = [alone, alone], [left - rest, np.zeros_like(left)]
    # Each beside the other, the new one first.
    for number in (1, 0, 1):
        beside = left - parts[1 - number]
        pair[number], rest = _best(shares, beside, lines, pace)
        parts[number] = beside - rest
    one, two = (pair if pair[0].kind <= pair[1].kind else reversed(pair))
    return [
        _with(unknowns, plain, alone, alone.kind),
        _with(unknowns, _with(unknowns, plain, one, 0), two, 1),
    ]


def excited_lines(target: Target) -> Lines | None:
    """The excited lines of a target; None without any."""
    omega = np.concatenate([2 * pi * frequencies(target.measurements[number])[bins] for number, _, bins in target.plan])
    excited = np.array([block.kind == "excited" for block in target.blocks])
    at = target.order[excited[target.of_line[target.order]]]
    if not at.size:
        return None
    kept, begin = np.unique(target.of_line[at], return_index=True)
    return Lines(at, omega[at], begin, target.floors[kept], target.counts[kept], target.sizes[kept])


def _without(unknowns: Unknowns, p: Array) -> Array:
    """`p` (size,) without a housing, its sensors where they would stand on one, with supports that yield across."""
    plain, soft = seated(unknowns, p), p[unknowns[ACROSS]]
    plain[unknowns[HOUSING]], plain[unknowns[OBLIQUE]] = 0.0, 0.0
    plain[unknowns[ACROSS]] = np.where(soft > STIFFEST, soft, ACROSS_BEGIN)
    return plain


def _shares(
    simulator: Simulator, plain: Array, here: Complex, lines: Lines
) -> dict[tuple[int, tuple[float, ...]], Complex]:
    """E (n,) by kind of motion and shares across."""
    unknowns, pace = simulator.layout.unknowns, pace_of(simulator.layout.model)
    answer = STIFF * _answer(lines.omega, pace * exp(STIFF_AT), HOUSING_RATIO)
    out = {}
    for kind, across in product(range(len(MOTIONS)), product((1.0, -1.0), repeat=len(SIDES))):
        trial = _with(unknowns, plain, Resonance(kind, across, STIFF_AT, HOUSING_RATIO, STIFF), kind)
        moved = simulator.lines(trial)
        if moved is not None:
            out[kind, across] = (moved - here)[lines.at] / answer
    return out


def _answer(omega: Array, own: float, ratio: float) -> Complex:
    r = omega / own
    return np.asarray(1.0 / (1.0 - r**2 + 2j * ratio * r))


def _best(
    shares: dict[tuple[int, tuple[float, ...]], Complex], left: Complex, lines: Lines, pace: float
) -> tuple[Resonance, Complex]:
    """The resonance that explains most of what is `left` (n,), and what it leaves."""
    parts = np.array(PARTS)[:, None]
    best: tuple[float, Resonance, Complex] | None = None
    for ((kind, across), share), at, ratio in product(shares.items(), SOUGHT_AT, RATIOS):
        rest = left - parts * share * _answer(lines.omega, pace * exp(at), ratio)
        costs = lines.costs(rest)
        number = int(np.argmin(costs))
        if best is None or costs[number] < best[0]:
            found = Resonance(kind, across, float(at), ratio, PARTS[number])
            best = float(costs[number]), found, rest[number]
    assert best is not None
    return best[1], best[2]


def _with(unknowns: Unknowns, p: Array, found: Resonance, motion: int) -> Array:
    """`p` (size,) with a resonance as that motion of its housing."""
    out = with_motion(unknowns, p, motion, found.at, found.part, found.kind)
    out[unknowns[MODE].start + 2 * motion + 1] = log(found.ratio / HOUSING_RATIO)
    first = unknowns[OBLIQUE].start + len(SIDES) * motion
    out[first : first + len(SIDES)] = found.across
    return out
