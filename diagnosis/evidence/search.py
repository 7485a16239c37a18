"""The search: the background alone, then every hypothesis that could matter, each refitted with everything else."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.effects.effect import Hypothesis, widened
from gearbench.diagnosis.effects.free_forms import free_forms
from gearbench.diagnosis.effects.library import hypotheses
from gearbench.diagnosis.evidence.fit import Fit, refit, score
from gearbench.diagnosis.evidence.prediction import predicted_factors, starts
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.unknowns import Unknowns

Array = NDArray[np.float64]
Report = Callable[[str], None]

PROMISING = -1.5  # predicted log Bayes factor below which a hypothesis is not refitted
MOST = 6  # refits of single hypotheses
STEPS_BASE, STEPS = 16, 12
RADIAL_TRIALS = (-0.6, -0.2, 0.2, 0.7)  # logarithms of stiffness over the prior's
COARSE = (4.0,)  # lambda of the first rounds


@dataclass(frozen=True)
class Tried:
    """A hypothesis, its log Bayes factor over the background alone, its fit (None: not promising), and how large the
    fit takes the effect to be: rms of its unknowns over their background's standard deviations."""

    hypothesis: Hypothesis
    log_bayes_factor: float
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
        return next((one for one in self.tried if one.hypothesis.effect is None and one.fit is not None), None)


def search(problem: Problem, without: Sequence[str] = (), report: Report = lambda step: None) -> Search:
    """Fit the background, then refit the hypotheses that its quadratic predicts to be worth it."""
    unknowns = problem.unknowns
    report("background")
    begin = begin_of(problem)
    effects = hypotheses(problem.model, without)
    # Groups that are wide as a whole; single entries are alternatives to one another, or numbers of the background.
    sd = widened(unknowns, [wide for one in effects for wide in one.wide if wide.at is None], unknowns.prior())
    alone, everything = (unknowns.prior(), STEPS_BASE), (sd, STEPS)
    base, free = side_by_side(
        lambda one: refit(problem, one[0], begin, most=one[1], coarse=COARSE), [alone, everything]
    )
    again = refit(problem, unknowns.prior(), free.p, free.factors, most=STEPS_BASE)
    base = again if again.cost < base.cost else base
    listed = effects + free_forms()
    promised = predicted_factors(base, unknowns, listed)
    promised = np.maximum(promised, [min(factor, 1.0) for factor in predicted_factors(free, unknowns, listed)])
    begun: dict[int, tuple[Start, float]] = {}
    for number, hypothesis in enumerate(listed):
        if not _always(hypothesis) and (promised[number] >= PROMISING or starts(hypothesis, unknowns)):
            begun[number] = _start(problem, (base, free), hypothesis)
            promised[number] = max(promised[number], begun[number][1])
    chosen = _promising(listed, promised)

    def tried_one(number: int) -> Tried:
        hypothesis, factor = listed[number], float(promised[number])
        if number not in chosen:
            return Tried(hypothesis, min(factor, 0.0), None)
        report(hypothesis.name)
        sd = hypothesis.prior(unknowns)
        try:
            if number in begun:
                fit = refit(problem, sd, *begun[number][0], most=STEPS)
            else:
                fit = refit(problem, sd, begin, most=STEPS, coarse=COARSE)
        except ValueError:  # a fit that leads nowhere costs its hypothesis, not the verdict
            return Tried(hypothesis, 0.0, None)
        evidence = fit.log_evidence - float(np.log(hypothesis.choices))
        return Tried(hypothesis, evidence, fit, relative_size(unknowns, hypothesis, fit))

    tried = side_by_side(tried_one, range(len(listed)))
    base, tried = _level(problem, base, tried)
    return Search(base, tuple(sorted(tried, key=lambda one: -one.log_bayes_factor)))


def _always(hypothesis: Hypothesis) -> bool:
    return hypothesis.effect is not None and hypothesis.effect.always


def begin_of(problem: Problem) -> Array:
    """Where to begin (size,): the radial supports, whose resonances may lie anywhere in the band, by trial."""
    unknowns, sd = problem.unknowns, problem.unknowns.prior()
    even = [np.full((len(b.with_mesh), len(b.count)), COARSE[0]) for b in problem.blocks]
    best, least = np.zeros(unknowns.size), np.inf
    for first in RADIAL_TRIALS:
        for second in RADIAL_TRIALS:
            trial = np.zeros(unknowns.size)
            trial[unknowns["radial"]] = (first, second, 0.0, 0.0)
            cost = score(problem, trial, sd, even, rounds=0)[0]
            if cost < least:
                best, least = trial, cost
    return best


def _calm(free: Fit, sd: Array) -> Array:
    """The unknowns of everything at once, with what `sd` holds for background put back to its size."""
    return np.where(sd < free.sd, np.clip(free.p, -2 * sd, 2 * sd), free.p)


Start = tuple[Array, tuple[Array, ...]]


def _start(problem: Problem, fits: tuple[Fit, Fit], hypothesis: Hypothesis) -> tuple[Start, float]:
    """Where to begin the refit: unknowns (size,) and lambda, those of the background's fit or of everything at once or
    a departure from the former; and by how much the cost there lies below that of the background's fit."""
    base, free = fits
    sd = hypothesis.prior(problem.unknowns)
    low, high = problem.unknowns.bounds()
    trials = [base.p + move for move in starts(hypothesis, problem.unknowns)]
    candidates = [(base.p, base.factors), (_calm(free, sd), free.factors), *((trial, base.factors) for trial in trials)]
    costs = [score(problem, np.clip(p, low, high), sd, factors)[0] for p, factors in candidates]
    best = int(np.argmin(costs))
    p, factors = candidates[best]
    return (np.clip(p, low, high), factors), costs[0] - costs[best] if best else -np.inf


def relief(unknowns: Unknowns, hypothesis: Hypothesis, fit: Fit) -> float:
    """What widening its own prior can add to the evidence at most: the background, taken to where the fit is, would
    pay this for the effect. Whatever a refit gains beyond has come from a better way down, open to the background."""
    at = hypothesis.entries(unknowns)
    narrow = unknowns.prior()[at]
    return 0.5 * float((fit.p[at] ** 2 * (narrow**-2.0 - fit.sd[at] ** -2.0)).sum())


def relative_size(unknowns: Unknowns, hypothesis: Hypothesis, fit: Fit) -> float:
    """Rms of what a hypothesis makes wide, in standard deviations of the background, each unknown by how much of its
    prior variance the records have taken away: what they do not show has no size."""
    at = hypothesis.entries(unknowns)
    weights = told(fit.std[at], fit.sd[at])
    return float(np.sqrt(np.average((fit.p[at] / unknowns.prior()[at]) ** 2, weights=weights)))


def told(std: Array, sd: Array) -> Array:
    """By how much of its prior variance (n,) the records have taken away of each unknown, from standard deviations."""
    return np.asarray(np.clip(1.0 - (std / np.maximum(sd, 1e-300)) ** 2, 1e-6, 1.0))


def _level(problem: Problem, base: Fit, tried: list[Tried]) -> tuple[Fit, list[Tried]]:
    """The background fitted again from the best refit, which may have found a way that it had missed, and the log
    Bayes factors over it of all that was tried."""
    refits = [one for one in tried if one.fit is not None]
    if refits:
        best = max(refits, key=lambda one: one.log_bayes_factor)
        assert best.fit is not None
        again = refit(problem, base.sd, best.fit.p, best.fit.factors, most=STEPS)
        base = again if again.cost < base.cost else base
    return base, [replace(one, log_bayes_factor=_over(problem, one, base)) for one in tried]


def _over(problem: Problem, one: Tried, base: Fit) -> float:
    if one.fit is None:
        return one.log_bayes_factor
    return min(one.log_bayes_factor - base.log_evidence, relief(problem.unknowns, one.hypothesis, one.fit))


def _promising(listed: Sequence[Hypothesis], promised: Array) -> set[int]:
    """Numbers of the hypotheses to refit."""
    chosen = {number for number, hypothesis in enumerate(listed) if _always(hypothesis)}
    ranked: Counter[str] = Counter()
    for number in np.argsort(-promised):
        if promised[number] < PROMISING or len(chosen) >= MOST:
            break
        effect = listed[number].effect
        if effect is not None and effect.most_refits is not None:
            ranked[effect.name] += 1
            if ranked[effect.name] > effect.most_refits:
                continue
        chosen.add(int(number))
    return chosen


def missing_by_equation(problem: Problem, fit: Fit) -> Array:
    """What a fit leaves unexplained, by equation, the mesh last (equations + 1,): sum over blocks of bins times log
    lambda."""
    total = np.zeros(len(PLACES))
    for blocks, factor in zip(problem.blocks, fit.factors, strict=True):
        total[blocks.with_mesh] += (np.log(factor) * blocks.count).sum(axis=1)
    return total
