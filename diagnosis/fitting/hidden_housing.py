"""A housing on which the displacement sensors stand: they see none of its motion, so that nothing but the transmission
error shows where it resonates.

What a motion of the housing with the shares s (4,) of both supports, along and across, and little compliance adds to a
line at a frequency w is to first order the sum of s_i s_j E_ij(w) g(w), with g its answer over its compliance,
1 / (1 - r^2 + 2 i zeta r) and r the ratio of w to its own frequency. So ten simulations of stiff ones tell E, and any
resonance follows without a simulation: many are compared on the excited lines, each with all other unknowns where they
fit best beside it (what was fitted without a housing has made up for a part of it).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import log, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gearbench.diagnosis.fitting.fit import Optimum, Sensitivity, fit_afresh, gone_on, refreshed, sensitivity_of
from gearbench.diagnosis.intake.signals import frequencies
from gearbench.diagnosis.simulation.quadratic import real_parts
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import Target
from gearbench.diagnosis.structure.structure import (
    ACROSS,
    ACROSS_BEGIN,
    EQUAL,
    HOUSING,
    HOUSING_RATIO,
    HOUSING_SD,
    LEAST_STEP,
    MODE,
    MODE_LARGEST,
    MODE_SD,
    MOTIONS,
    NONE,
    OBLIQUE,
    OBLIQUE_SD,
    SEAT,
    SHAPE,
    STIFFEST,
    pace_of,
    seated,
)

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Of the motions that tell E: logarithm of their frequency over the supports', and their compliance.
STIFF_AT, STIFF = 1.8, 0.01
# Where resonances are looked for: logarithms of the frequency, and damping ratios.
SOUGHT_AT = tuple(float(at) for at in np.linspace(-MODE_LARGEST, 1.0, 121))
RATIOS = (0.02, 0.035, 0.06)
RENEWALS = 3
# Compliance that a motion begins with at least: fits let stand what a rig does not feel.
LEAST = 2 * LEAST_STEP[HOUSING]
# Shares of driver and driven along, then across: ten whose products with themselves tell those of any.
TOLD_BY = np.array([
    (1, 0, 0, 0), (0, 1, 0, 0), (1, 1, 0, 0), (1, 0, 1, 0), (1, 0, -1, 0),
    (1, 0, 0, 1), (1, 0, 0, -1), (0, 1, 1, 0), (0, 1, 0, 1), (1, 0, 1, 1),
], dtype=float)  # fmt: skip
# Shares that are compared: angles along and across, and root mean squares across over those along.
ANGLES, OVER = 24, (0.0, 0.25, 0.5, 1.0)
PAIRS = tuple((i, j) for i in range(4) for j in range(i, 4))


class Resonance(NamedTuple):
    """Logarithm of the frequency of a motion of the housing over the supports', and its damping ratio."""

    at: float
    ratio: float


def on_a_housing(simulator: Simulator, found: Optimum, tell: Callable[[], None] = lambda: None) -> Optimum | None:
    """The fit with sensors on a housing, one motion of it after the other as long as it comes closer by each, which is
    told; None where a rig has none."""
    unknowns = simulator.layout.unknowns
    p, best = without_housing(simulator, found.p), None
    if p is None:
        return None
    tell()
    free = ~unknowns.of((HOUSING,))
    for motion in range(len(MOTIONS)):
        # One whose resonance is not looked for yet would grow at another's meanwhile.
        free[unknowns[HOUSING].start + motion] = True
        begin = with_hidden_motion(simulator, p, found.sd, motion)
        again = fit_afresh(simulator, begin, found.sd, renewals=RENEWALS, chosen=free) if begin is not None else None
        if again is None or (best is not None and again.evidence <= best.evidence):
            break
        p, best = again.p, again
        if best.cost - best.left > found.cost:  # another motion would not catch up
            break
    if best is None or best.evidence <= found.evidence:
        return best
    return gone_on(simulator, refreshed(simulator, best, unknowns.of((HOUSING,)) & (best.p <= NONE)), RENEWALS)


def without_housing(simulator: Simulator, p: Array) -> Array | None:
    """`p` (size,) without a housing, its sensors where they would stand on one, with supports that yield across; None
    where a rig has none to find, as one whose case gives it."""
    unknowns = simulator.layout.unknowns
    if HOUSING not in unknowns.slices:
        return None
    plain, soft = seated(unknowns, p), p[unknowns[ACROSS]]
    plain[unknowns[HOUSING]], plain[unknowns[OBLIQUE]] = 0.0, 0.0
    plain[unknowns[ACROSS]] = np.where(soft > STIFFEST, soft, ACROSS_BEGIN)
    return plain


def with_hidden_motion(simulator: Simulator, p: Array, sd: Array, motion: int) -> Array | None:
    """`p` (size,) with that motion of a housing its sensors stand on, whose resonance explains the excited lines best
    under the prior `sd` (size,); None where no line is excited, or no such rig can be."""
    whole = simulator.target
    if not whole.excited.any():
        return None
    excited = simulator.of_target(whole.of_lines(whole.excited[whole.of_line]))
    over = _over(excited)
    try:
        told = _told(excited, p, motion, over)
        sensitivity = sensitivity_of(excited, p, sd)
    except ValueError:
        return None
    if told is None or sensitivity is None:
        return None
    found, shares, compliance = _likeliest(excited, p, sd, told, sensitivity, over)
    return _with(simulator, p, motion, found, shares, compliance)


def _told(excited: Simulator, p: Array, motion: int, over: Array) -> Complex | None:
    """E (10, K) of the lines of a simulator, at frequencies `over` those of the supports (K,), by PAIRS of shares of
    that motion; None where a rig cannot be."""
    here, stiff = excited.lines(p), Resonance(STIFF_AT, HOUSING_RATIO)
    if here is None:
        return None
    moved = []
    for shares in TOLD_BY:
        compliance = STIFF * float((shares[:2] ** 2).mean())
        lines = excited.lines(_with(excited, p, motion, stiff, shares, compliance))
        if lines is None:
            return None
        moved.append(lines - here)
    return np.asarray(np.linalg.solve(_products(TOLD_BY), np.array(moved) / (STIFF * _answer(over, stiff))))


def _likeliest(
    excited: Simulator, p: Array, sd: Array, told: Complex, sensitivity: Sensitivity, over: Array
) -> tuple[Resonance, Array, float]:
    """The resonance, shares (4,) and compliance along that explain most, with all other unknowns where they are best
    beside it."""
    target, unknowns, quadratic, here = excited.target, excited.layout.unknowns, sensitivity.quadratic, excited.lines(p)
    assert here is not None
    step, _, _ = quadratic.best(p, sd, unknowns.bounds())
    root = np.sqrt(quadratic.weights(step)[target.of_line])
    active = quadratic.active
    # A motion that is not there yet would compete.
    aside = unknowns.of((SEAT,)) | (unknowns.of((HOUSING,)) & (p <= NONE))
    kept = active[(sd[active] > 0.0) & ~aside[active]]
    others = real_parts(sensitivity.jacobian[kept] * root) * sd[kept, None]
    # About the centre of the others' priors.
    left = real_parts((target.lines - here) * root) + p[kept] / sd[kept] @ others
    inner = cho_factor(np.eye(len(kept)) + others @ others.T, lower=True)
    shares = _shares()
    products, across = _products(shares), 0.5 * (shares[:, 2:] ** 2).sum(axis=1) / OBLIQUE_SD**2
    best = -np.inf, Resonance(0.0, HOUSING_RATIO), shares[0], 0.0
    for found in map(Resonance._make, product(SOUGHT_AT, RATIOS)):
        made = HOUSING_SD * real_parts(told * _answer(over, found) * root)
        alone = made - cho_solve(inner, others @ made.T).T @ others
        slopes = products @ (alone @ left)
        curved = 1.0 + np.einsum("ni,ij,nj->n", products, alone @ made.T, products, optimize=True)
        sizes = np.maximum(slopes / curved, LEAST / HOUSING_SD)
        gains = sizes * (slopes - 0.5 * sizes * curved) - across
        most = int(np.argmax(gains))
        gain = float(gains[most]) - 0.5 * (found.at**2 + log(found.ratio / HOUSING_RATIO) ** 2) / MODE_SD**2
        if gain > best[0]:
            best = gain, found, shares[most], HOUSING_SD * float(sizes[most])
    return best[1:]


def _shares() -> Array:
    """Shares (n, 4) that are compared, whose root mean square along is 1."""
    along, across = (np.arange(ANGLES) * turn / ANGLES for turn in (pi, 2 * pi))
    return np.array([
        (sqrt(2) * np.cos(one), sqrt(2) * np.sin(one), over * sqrt(2) * np.cos(two), over * sqrt(2) * np.sin(two))
        for one, over in product(along, OVER)
        for two in (across if over > 0.0 else across[:1])
    ])  # fmt: skip


def _products(shares: Array) -> Array:
    """Those (n, 10) of shares (n, 4) with themselves, by PAIRS."""
    return np.stack([shares[:, i] * shares[:, j] for i, j in PAIRS], axis=1)


def _over(excited: Simulator) -> Array:
    """Frequencies (K,) of the lines of a simulator over those of the supports."""
    target: Target = excited.target
    lines = [frequencies(target.measurements[number])[bins] for number, _, bins in target.plan]
    return 2 * pi * np.concatenate(lines) / pace_of(excited.layout.model)


def _answer(over: Array, found: Resonance) -> Complex:
    """g (K,) at frequencies `over` those of the supports (K,)."""
    r = over / np.exp(found.at)
    return np.asarray(1.0 / (1.0 - r**2 + 2j * found.ratio * r))


def _with(simulator: Simulator, p: Array, motion: int, found: Resonance, shares: Array, compliance: float) -> Array:
    """`p` (size,) with a resonance of those shares (4,) as that motion of its housing, `compliance` along."""
    unknowns = simulator.layout.unknowns
    turned = float(np.arctan2(shares[1], shares[0])) - EQUAL[motion]
    low, high = (bound[unknowns[SHAPE].start + motion] for bound in unknowns.bounds())
    across = shares[2:] / sqrt(float((shares[:2] ** 2).mean()))
    # Shares of the other sign are the same motion.
    turn = next((turned + k * pi for k in (0, 1, -1) if low <= turned + k * pi <= high), turned)
    out = p.copy()
    out[unknowns[HOUSING].start + motion] = compliance
    mode, first = unknowns[MODE].start + 2 * motion, unknowns[OBLIQUE].start + 2 * motion
    out[mode : mode + 2] = found.at, log(found.ratio / HOUSING_RATIO)
    out[unknowns[SHAPE].start + motion] = turn
    out[first : first + 2] = across if turn == turned else -across
    return out
