"""Which unmodelled effect causes the gap: search, audits, decision, and the rigs that follow from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Estimate, Fitted, added
from gearbench.diagnosis.effects.recalibrated import recalibrated
from gearbench.diagnosis.evidence.decision import Decision, decide, named
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.problem import Problem, problem_of
from gearbench.diagnosis.evidence.search import Search, Tried, missing_by_equation, search
from gearbench.diagnosis.evidence.separable import alike, representatives
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import unsteadiness
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels, simulated_channels
from gearbench.diagnosis.replay.refine import Addition
from gearbench.diagnosis.replay.replays import replays
from gearbench.diagnosis.verdict import Candidate, Effect, Outcome, Parameter, Share
from gearbench.rig import Case
from gearbench.rig.contract import Place

Array = NDArray[np.float64]
Report = Callable[[str], None]


@dataclass(frozen=True)
class Finding:
    """What the search found: fields of the verdict, the nominal case recalibrated and with the effect added, and how
    to add the effect to any case."""

    verdict: Outcome
    probability: dict[str, float]
    effects: tuple[Effect, ...]
    candidates: tuple[Candidate, ...]
    place: Place
    where: tuple[Share, ...]
    recalibrated: Case
    with_effect: Case | None
    because: str
    addition: Addition | None = None
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
    problem = problem_of(measurements, nominal)
    result = search(problem, without, report)
    best = named(result)
    fit = best.fit if best and best.fit else result.base
    silent = missing_by_equation(problem, fit)
    report("steadiness")
    band = problem.conditions[0].band
    unsteady = unsteadiness(problem.model, measurements, problem.unknowns, fit.p, band)
    decision = decide(result, silent, unsteady)
    plain = recalibrated(nominal, fitted(problem, result.base))
    effects, updated = _effects(problem, nominal, decision)
    return Finding(
        verdict=decision.verdict,
        probability=decision.probability,
        effects=effects,
        candidates=_candidates(result, _gaps_held_out(problem, nominal, plain, result, held_out)),
        place=decision.place,
        where=_places(problem, result.base),
        recalibrated=plain,
        with_effect=updated,
        because=decision.because,
        addition=_addition(problem, decision.winner),
        indistinguishable=alike(fit, problem.unknowns, representatives(problem, without)),
        evidence={one.hypothesis.name: one.log_bayes_factor for one in result.tried},
        audits={"silent": tuple(silent), "unsteady": tuple(unsteady)},
    )


def fitted(problem: Problem, fit: Fit) -> Fitted:
    """What a fit says of the unknowns of a problem."""
    means = {condition.name: condition.torque_mean for condition in problem.conditions}
    return Fitted(problem.model, problem.unknowns, fit.p, fit.std, means)


def with_hypothesis(problem: Problem, nominal: Case, tried: Tried) -> tuple[Case, tuple[Estimate, ...]]:
    """The nominal case recalibrated under a hypothesis of the library with its effect added, and the parameters."""
    assert tried.fit is not None
    values = fitted(problem, tried.fit)
    return added(recalibrated(nominal, values), tried.hypothesis, values)


def _addition(problem: Problem, winner: Tried | None) -> Addition | None:
    if winner is None or winner.fit is None or winner.hypothesis.effect is None:
        return None
    values, hypothesis = fitted(problem, winner.fit), winner.hypothesis
    return Addition(lambda case: added(case, hypothesis, values)[0], winner.hypothesis.effect.fields)


def _effects(problem: Problem, nominal: Case, decision: Decision) -> tuple[tuple[Effect, ...], Case | None]:
    if decision.winner is None:
        return (), None
    updated, estimates = with_hypothesis(problem, nominal, decision.winner)
    effect = decision.winner.hypothesis.effect
    assert effect is not None
    parameters = {e.name: Parameter(value=e.value, std=effect.stated(e), unit=e.unit) for e in estimates}
    return (Effect(name=effect.name, probability=decision.probability["effect"], parameters=parameters),), updated


def _candidates(result: Search, gaps: dict[str, float]) -> tuple[Candidate, ...]:
    """The best hypothesis of each effect, and the background alone; `gaps` by the names of hypotheses."""
    best: dict[tuple[str, ...], Tried | None] = {(): None}
    for one in result.tried:  # the best first
        if one.hypothesis.effect:
            best.setdefault((one.hypothesis.effect.name,), one)
    listed = [
        Candidate(
            effects=names,
            log_evidence=float(one.log_bayes_factor) if one else 0.0,
            held_out=gaps.get(one.hypothesis.name if one else ""),
        )
        for names, one in best.items()
    ]
    return tuple(sorted(listed, key=lambda candidate: -candidate.log_evidence))


def _gaps_held_out(
    problem: Problem, nominal: Case, plain: Case, result: Search, held_out: Measurement | None
) -> dict[str, float]:
    """Rms of what is left of the transmission error on the held-out record over its own fluctuation, by hypothesis
    ("": the background alone), for those that were refitted and add evidence."""
    if held_out is None or not held_out.phase_known:
        return {}
    simulate = replays(problem.model.law)
    measured = measured_channels(held_out)["dte"].mean(axis=0)

    def left(case: Case) -> float:
        rest = measured - simulated_channels(held_out, simulate(case, held_out.record))["dte"]
        return float(np.std(rest) / np.std(measured))

    out = {"": left(plain)}
    for one in result.tried:
        if one.hypothesis.effect and one.fit is not None and one.log_bayes_factor > 0.0:
            out[one.hypothesis.name] = left(with_hypothesis(problem, nominal, one)[0])
    return out


def _places(problem: Problem, base: Fit) -> tuple[Share, ...]:
    """Shares of what the background leaves unexplained, by place."""
    missing = missing_by_equation(problem, base)
    total = float(missing.sum())
    if total <= 0.0:
        return ()
    return tuple(
        Share(kind="place", name=name, share=float(value) / total, floor=None)
        for name, value in zip(PLACES, missing, strict=True)
    )
