"""The search: the background alone, then every hypothesis that could matter, each refitted with everything else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.fit import Fit, Problem, refit, score
from gearbench.diagnosis.evidence.hypotheses import Hypothesis, free_forms, library, predicted_gains, starts
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.unknowns import ROWS

Array = NDArray[np.float64]
Report = Callable[[str], None]

PROMISING = -1.5  # predicted gain below which a hypothesis is not refitted
MOST = 6  # refits of single hypotheses
MOST_TEETH = 2  # of these, single cracked teeth
FROM_BEGINNING = ("friction",)  # always refitted, as it trades with the mesh's shape
STEPS_BASE, STEPS = 16, 12
RADIAL_TRIALS = (-0.6, -0.2, 0.2, 0.7)  # logarithms of stiffness over the prior's
COARSE = (4.0,)  # lambda of the first rounds


@dataclass(frozen=True)
class Tried:
    """A hypothesis, how much log evidence it adds to the background alone, its fit (None: not promising), and how large
    the fit takes the effect to be: rms of its unknowns over their background's standard deviations."""

    hypothesis: Hypothesis
    gain: float
    fit: Fit | None
    size: float = 0.0


@dataclass(frozen=True)
class Search:
    """The background's fit and all hypotheses tried, the best first."""

    base: Fit
    tried: tuple[Tried, ...]

    @property
    def best_free(self) -> Tried | None:
        """The best free form; None if none was worth a refit."""
        return next((one for one in self.tried if not one.hypothesis.effect and one.fit is not None), None)


def search(problem: Problem, without: Sequence[str] = (), report: Report = lambda step: None) -> Search:
    """Fit the background, then refit the hypotheses that its quadratic predicts to be worth it."""
    where = problem.where
    report("background")
    begin = begin_of(problem)
    base = refit(problem, where.prior(), begin, most=STEPS_BASE, coarse=COARSE)
    report("everything at once")
    effects = library(where, tuple(without))
    sd = where.prior({group for effect in effects for group in effect.groups})
    free = refit(problem, sd, begin, most=STEPS, coarse=COARSE)
    again = refit(problem, where.prior(), free.p, free.factors, most=STEPS_BASE)
    base = again if again.cost < base.cost else base
    hypotheses = effects + free_forms()
    gains = predicted_gains(base, where, hypotheses)
    gains = np.maximum(gains, [min(gain, 1.0) for gain in predicted_gains(free, where, hypotheses)])
    begun: dict[int, tuple[Start, float]] = {}
    for number, hypothesis in enumerate(hypotheses):
        if hypothesis.name not in FROM_BEGINNING and (gains[number] >= PROMISING or starts(hypothesis, where)):
            begun[number] = _start(problem, (base, free), hypothesis)
            gains[number] = max(gains[number], begun[number][1])
    chosen = _promising(hypotheses, gains)
    tried = []
    for number, (hypothesis, gain) in enumerate(zip(hypotheses, gains, strict=True)):
        if number not in chosen:
            tried.append(Tried(hypothesis, min(float(gain), 0.0), None))
            continue
        report(hypothesis.name)
        sd = hypothesis.prior(where)
        if number in begun:
            fit = refit(problem, sd, *begun[number][0], most=STEPS)
        else:
            fit = refit(problem, sd, begin, most=STEPS, coarse=COARSE)
        evidence = fit.log_evidence - float(np.log(hypothesis.choices))
        tried.append(Tried(hypothesis, evidence, fit, relative_size(where, hypothesis, fit)))
    base, tried = _level(problem, base, tried)
    return Search(base, tuple(sorted(tried, key=lambda one: -one.gain)))


def begin_of(problem: Problem) -> Array:
    """Where to begin (P,): the radial supports, whose resonances may lie anywhere in the band, by trial."""
    where, sd = problem.where, problem.where.prior()
    even = [np.full((len(b.rows) + 1, len(b.count)), COARSE[0]) for b in problem.blocks]
    best, least = np.zeros(where.size), np.inf
    for first in RADIAL_TRIALS:
        for second in RADIAL_TRIALS:
            trial = np.zeros(where.size)
            trial[where["radial"]] = (first, second, 0.0, 0.0)
            cost = score(problem, trial, sd, even, rounds=0)[0]
            if cost < least:
                best, least = trial, cost
    return best


def _calm(free: Fit, sd: Array) -> Array:
    """The unknowns of everything at once, with what `sd` holds for background put back to its size."""
    return np.where(sd < free.sd, np.clip(free.p, -2 * sd, 2 * sd), free.p)


Start = tuple[Array, tuple[Array, ...]]


def _start(problem: Problem, fits: tuple[Fit, Fit], hypothesis: Hypothesis) -> tuple[Start, float]:
    """Where to begin the refit: unknowns (P,) and lambda, those of the background's fit or of everything at once or
    a departure from the former; and by how much the cost there lies below that of the background's fit."""
    base, free = fits
    sd = hypothesis.prior(problem.where)
    low, high = problem.where.bounds()
    trials = [base.p + move for move in starts(hypothesis, problem.where)]
    candidates = [(base.p, base.factors), (_calm(free, sd), free.factors), *((trial, base.factors) for trial in trials)]
    costs = [score(problem, np.clip(p, low, high), sd, factors)[0] for p, factors in candidates]
    best = int(np.argmin(costs))
    p, factors = candidates[best]
    return (np.clip(p, low, high), factors), costs[0] - costs[best] if best else -np.inf


def relief(where: Layout, hypothesis: Hypothesis, fit: Fit) -> float:
    """What widening its own prior can add to the evidence at most: the background, taken to where the fit is, would
    pay this for the effect. Whatever a refit gains beyond has come from a better way down, open to the background."""
    at = _own(where, hypothesis)
    narrow = where.prior()[at]
    return 0.5 * float((fit.p[at] ** 2 * (narrow**-2.0 - fit.sd[at] ** -2.0)).sum())


def relative_size(where: Layout, hypothesis: Hypothesis, fit: Fit) -> float:
    """Rms of what a hypothesis makes wide, in standard deviations of the background, each unknown by how much of its
    prior variance the records have taken away: what they do not show has no size."""
    at = _own(where, hypothesis)
    told = np.clip(1.0 - (fit.std[at] / fit.sd[at]) ** 2, 1e-6, 1.0)
    return float(np.sqrt(np.average((fit.p[at] / where.prior()[at]) ** 2, weights=told)))


def _own(where: Layout, hypothesis: Hypothesis) -> NDArray[np.int64]:
    """Indices of the unknowns that a hypothesis makes wide."""
    groups = [where.members(group) for group in hypothesis.groups]
    return np.concatenate([*groups, np.array(hypothesis.entries, dtype=np.int64)])


def _level(problem: Problem, base: Fit, tried: list[Tried]) -> tuple[Fit, list[Tried]]:
    """The background fitted again from the best refit, which may have found a way that it had missed, and the gains
    over it of all that was tried."""
    refits = [one for one in tried if one.fit is not None]
    if refits:
        best = max(refits, key=lambda one: one.gain)
        assert best.fit is not None
        again = refit(problem, base.sd, best.fit.p, best.fit.factors, most=STEPS)
        base = again if again.cost < base.cost else base
    return base, [replace(one, gain=_gain(problem, one, base)) for one in tried]


def _gain(problem: Problem, one: Tried, base: Fit) -> float:
    if one.fit is None:
        return one.gain
    return min(one.gain - base.log_evidence, relief(problem.where, one.hypothesis, one.fit))


def _promising(hypotheses: Sequence[Hypothesis], gains: Array) -> set[int]:
    """Numbers of the hypotheses to refit."""
    chosen = {number for number, hypothesis in enumerate(hypotheses) if hypothesis.name in FROM_BEGINNING}
    teeth = 0
    for number in np.argsort(-gains):
        if gains[number] < PROMISING or len(chosen) >= MOST:
            break
        if hypotheses[number].entries:
            teeth += 1
            if teeth > MOST_TEETH:
                continue
        chosen.add(int(number))
    return chosen


def missing_by_row(problem: Problem, fit: Fit) -> Array:
    """What a fit leaves unexplained, by row, the mesh last (rows + 1,): sum over blocks of bins times log lambda."""
    total = np.zeros(len(ROWS) + 1)
    for blocks, factor in zip(problem.blocks, fit.factors, strict=True):
        total[[*blocks.rows, len(ROWS)]] += (np.log(factor) * blocks.count).sum(axis=1)
    return total
