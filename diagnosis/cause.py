"""Which unmodelled effect causes the gap: search, audits, decision, and the rigs that follow from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.apply import Estimate, Unknowns, apply_effect, recalibrated
from gearbench.diagnosis.decision import PLACE_OF_ROW, Decision, decide
from gearbench.diagnosis.fit import Fit, Problem
from gearbench.diagnosis.intake import Measurement
from gearbench.diagnosis.problem import problem_of
from gearbench.diagnosis.search import Search, Tried, missing_by_row, search
from gearbench.diagnosis.steadiness import unsteadiness
from gearbench.diagnosis.verdict import Candidate, Effect, Parameter, Share
from gearbench.rig import Case

Array = NDArray[np.float64]
Report = Callable[[str], None]


@dataclass(frozen=True)
class Finding:
    """What the search found: fields of the verdict, and the nominal case recalibrated and with the effect added."""

    verdict: str
    probability: dict[str, float]
    effects: tuple[Effect, ...]
    candidates: tuple[Candidate, ...]
    place: str
    where: tuple[Share, ...]
    recalibrated: Case
    with_effect: Case | None
    because: str
    indistinguishable: tuple[tuple[str, ...], ...] = ()
    advice: tuple[str, ...] = ()
    evidence: dict[str, float] = field(default_factory=dict)
    audits: dict[str, tuple[float, ...]] = field(default_factory=dict)


def find_cause(
    measurements: Sequence[Measurement],
    nominal: Case,
    *,
    held_out: Measurement | None = None,
    without: Sequence[str] = (),
    report: Report = lambda step: None,
) -> Finding:
    """The cause of the gap between the measurements and the nominal case.

    `without` leaves effects out of the library. Raises DiagnosisError for measurements that cannot be used.
    """
    problem, _ = problem_of(measurements, nominal)
    found = search(problem, without, report)
    best = found.best(free=False)
    silent = missing_by_row(problem, best.fit if best and best.fit else found.base)
    report("steadiness")
    band = problem.conditions[0].band
    unsteady = unsteadiness(problem.machine, measurements, problem.where, (best.fit if best and best.fit else found.base).p, band)
    decision = decide(found, silent, unsteady)
    plain = recalibrated(nominal, _unknowns(problem, found.base))
    effects, updated = _effects(problem, nominal, decision)
    return Finding(
        verdict=decision.verdict,
        probability=decision.probability,
        effects=effects,
        candidates=_candidates(found),
        place=decision.place,
        where=_places(problem, found.base),
        recalibrated=plain,
        with_effect=updated,
        because=decision.because,
        evidence={one.hypothesis.name: one.gain for one in found.tried},
        audits={"silent": tuple(silent), "unsteady": tuple(unsteady), "base": tuple(missing_by_row(problem, found.base))},
    )


def _unknowns(problem: Problem, fit: Fit) -> Unknowns:
    mean = float(np.mean([condition.torque_mean for condition in problem.conditions]))
    return Unknowns(problem.machine, problem.where, fit.p, fit.std, mean)


def with_hypothesis(problem: Problem, nominal: Case, tried: Tried) -> tuple[Case, tuple[Estimate, ...]]:
    """The nominal case recalibrated under a hypothesis of the library with its effect added, and the parameters."""
    assert tried.fit is not None
    unknowns = _unknowns(problem, tried.fit)
    return apply_effect(recalibrated(nominal, unknowns), tried.hypothesis, unknowns)


def _effects(problem: Problem, nominal: Case, decision: Decision) -> tuple[tuple[Effect, ...], Case | None]:
    if decision.winner is None:
        return (), None
    updated, estimates = with_hypothesis(problem, nominal, decision.winner)
    parameters = {e.name: Parameter(value=e.value, std=e.std, unit=e.unit) for e in estimates}
    effect = Effect(
        name=decision.winner.hypothesis.effect, probability=decision.probability["effect"], parameters=parameters
    )
    return (effect,), updated


def _candidates(found: Search) -> tuple[Candidate, ...]:
    """The best hypothesis of each effect, and the background alone."""
    best: dict[tuple[str, ...], float] = {(): 0.0}
    for one in found.tried:
        if one.hypothesis.effect:
            key = (one.hypothesis.effect,)
            best[key] = max(best.get(key, -np.inf), one.gain)
    ranked = sorted(best.items(), key=lambda item: -item[1])
    return tuple(Candidate(effects=effects, log_evidence=float(gain)) for effects, gain in ranked)


def _places(problem: Problem, base: Fit) -> tuple[Share, ...]:
    """Shares of what the background leaves unexplained, by place."""
    missing = missing_by_row(problem, base)
    total = float(missing.sum())
    if total <= 0.0:
        return ()
    return tuple(
        Share(kind="place", name=name, share=float(value) / total, floor=None)
        for name, value in zip(PLACE_OF_ROW, missing, strict=True)
    )
