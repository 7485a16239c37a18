"""A housing on which the displacement sensors stand: they see none of its motion, so that nothing but the transmission
error shows where it resonates.

What a housing of little compliance c adds to a line at a frequency w is to first order c E(w) g(w), with g its answer
over its compliance, 1 / (1 - r^2 + 2 i zeta r) and r the ratio of w to its own frequency. So one simulation of a stiff
one tells E, and resonances of any frequency and damping follow without a simulation: many are compared on the excited
lines, and only the best are simulated.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from math import exp, log, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.signals import frequencies
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import Target
from gearbench.diagnosis.structure.structure import (
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

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
# E (K,) of lines by kind of motion and shares across.
Shares = Mapping[tuple[int, tuple[float, ...]], Complex]

# Of the motion that tells E: logarithm of its frequency over the supports', and its compliance.
STIFF_AT, STIFF = 1.8, 0.01
# Where resonances are looked for: logarithms of the frequency, damping ratios, and compliances over the supports'.
SOUGHT_AT = tuple(float(at) for at in np.linspace(-2.2, 1.0, 97))
RATIOS = (0.02, 0.035, 0.06)
PARTS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1)


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
    unknowns, whole = simulator.layout.unknowns, simulator.target
    if HOUSING not in unknowns.slices or not whole.excited.any():
        return []
    excited, plain = simulator.of_target(whole.of_lines(whole.excited[whole.of_line])), _without(unknowns, p)
    target, here = excited.target, excited.lines(plain)
    if here is None:
        return []
    over = _frequencies(target) / pace_of(simulator.layout.model)
    shares = _shares(excited, plain, here, over)
    if not shares:
        return []
    answers = {(at, ratio): _answer(over, at, ratio) for at, ratio in product(SOUGHT_AT, RATIOS)}
    left = target.lines - here
    alone, rest = _best(target, shares, answers, left)
    pair, parts = [alone, alone], [left - rest, np.zeros_like(left)]
    # Each beside the other, the new one first.
    for number in (1, 0, 1):
        beside = left - parts[1 - number]
        pair[number], rest = _best(target, shares, answers, beside)
        parts[number] = beside - rest
    one, two = (pair if pair[0].kind <= pair[1].kind else reversed(pair))
    return [
        _with(unknowns, plain, alone, alone.kind),
        _with(unknowns, _with(unknowns, plain, one, 0), two, 1),
    ]


def _frequencies(target: Target) -> Array:
    """Angular frequencies (K,) [rad/s] of the lines of a target."""
    return np.concatenate([2 * pi * frequencies(target.measurements[number])[bins] for number, _, bins in target.plan])


def _without(unknowns: Unknowns, p: Array) -> Array:
    """`p` (size,) without a housing, its sensors where they would stand on one, with supports that yield across."""
    plain, soft = seated(unknowns, p), p[unknowns[ACROSS]]
    plain[unknowns[HOUSING]], plain[unknowns[OBLIQUE]] = 0.0, 0.0
    plain[unknowns[ACROSS]] = np.where(soft > STIFFEST, soft, ACROSS_BEGIN)
    return plain


def _shares(excited: Simulator, plain: Array, here: Complex, over: Array) -> Shares:
    """E (K,) of the lines of a simulator, which are `here` those of `plain` and lie at the frequencies `over` those of
    the supports (K,)."""
    unknowns, answer, out = excited.layout.unknowns, STIFF * _answer(over, STIFF_AT, HOUSING_RATIO), {}
    for kind, across in product(range(len(MOTIONS)), product((1.0, -1.0), repeat=len(SIDES))):
        trial = _with(unknowns, plain, Resonance(kind, across, STIFF_AT, HOUSING_RATIO, STIFF), kind)
        moved = excited.lines(trial)
        if moved is not None:
            out[kind, across] = (moved - here) / answer
    return out


def _answer(over: Array, at: float, ratio: float) -> Complex:
    """g (K,) at frequencies `over` those of the supports (K,)."""
    r = over / exp(at)
    return np.asarray(1.0 / (1.0 - r**2 + 2j * ratio * r))


def _best(
    target: Target, shares: Shares, answers: Mapping[tuple[float, float], Complex], left: Complex
) -> tuple[Resonance, Complex]:
    """The resonance that explains most of what is `left` (K,) of the lines of a target, and what it leaves."""
    best: tuple[float, Resonance, Complex] | None = None
    for ((kind, across), share), ((at, ratio), answer) in product(shares.items(), answers.items()):
        made = share * answer
        for part in PARTS:
            rest = left - part * made
            cost = target.cost(rest)
            if best is None or cost < best[0]:
                best = cost, Resonance(kind, across, at, ratio, part), rest
    assert best is not None
    return best[1], best[2]


def _with(unknowns: Unknowns, p: Array, found: Resonance, motion: int) -> Array:
    """`p` (size,) with a resonance as that motion of its housing."""
    out = with_motion(unknowns, p, motion, found.at, found.part, found.kind)
    out[unknowns[MODE].start + 2 * motion + 1] = log(found.ratio / HOUSING_RATIO)
    first = unknowns[OBLIQUE].start + len(SIDES) * motion
    out[first : first + len(SIDES)] = found.across
    return out
