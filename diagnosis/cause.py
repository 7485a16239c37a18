"""Which unmodelled effect causes the gap: search, audits, decision, and the rigs that follow from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.apply import Estimate, Unknowns, apply_effect, recalibrated
from gearbench.diagnosis.evidence.calibration import stated
from gearbench.diagnosis.evidence.decision import PLACE_OF_ROW, Decision, decide, named
from gearbench.diagnosis.evidence.fit import Fit, Problem
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.evidence.search import Search, Tried, missing_by_row, search
from gearbench.diagnosis.evidence.separable import alike, representatives
from gearbench.diagnosis.forces.steadiness import unsteadiness
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels, simulated_channels
from gearbench.diagnosis.replay.replays import replays
from gearbench.diagnosis.verdict import Candidate, Effect, Parameter, Share
from gearbench.rig import Case

Array = NDArray[np.float64]
Report = Callable[[str], None]


@dataclass(frozen=True)
class Finding:
    """What the search found: fields of the verdict, the nominal case recalibrated and with the effect added, and `add`,
    which puts the effect that was found into any case."""

    verdict: str
    probability: dict[str, float]
    effects: tuple[Effect, ...]
    candidates: tuple[Candidate, ...]
    place: str
    where: tuple[Share, ...]
    recalibrated: Case
    with_effect: Case | None
    because: str
    add: Callable[[Case], Case] | None = None
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
    found = search(problem, without, report)
    best = named(found)
    fit = best.fit if best and best.fit else found.base
    silent = missing_by_row(problem, fit)
    report("steadiness")
    band = problem.conditions[0].band
    unsteady = unsteadiness(problem.machine, measurements, problem.where, fit.p, band)
    decision = decide(found, silent, unsteady)
    plain = recalibrated(nominal, _unknowns(problem, found.base))
    effects, updated = _effects(problem, nominal, decision)
    return Finding(
        verdict=decision.verdict,
        probability=decision.probability,
        effects=effects,
        candidates=_candidates(found, _gaps_held_out(problem, nominal, plain, found, held_out)),
        place=decision.place,
        where=_places(problem, found.base),
        recalibrated=plain,
        with_effect=updated,
        because=decision.because,
        add=_adding(problem, decision.winner),
        indistinguishable=alike(fit, problem.where, representatives(problem, without)),
        evidence={one.hypothesis.name: one.gain for one in found.tried},
        audits={"silent": tuple(silent), "unsteady": tuple(unsteady)},
    )


def _unknowns(problem: Problem, fit: Fit) -> Unknowns:
    means = {condition.name: condition.torque_mean for condition in problem.conditions}
    return Unknowns(problem.machine, problem.where, fit.p, fit.std, means)


def with_hypothesis(problem: Problem, nominal: Case, tried: Tried) -> tuple[Case, tuple[Estimate, ...]]:
    """The nominal case recalibrated under a hypothesis of the library with its effect added, and the parameters."""
    assert tried.fit is not None
    unknowns = _unknowns(problem, tried.fit)
    return apply_effect(recalibrated(nominal, unknowns), tried.hypothesis, unknowns)


def _adding(problem: Problem, winner: Tried | None) -> Callable[[Case], Case] | None:
    if winner is None or winner.fit is None:
        return None
    unknowns, hypothesis = _unknowns(problem, winner.fit), winner.hypothesis
    return lambda case: apply_effect(case, hypothesis, unknowns)[0]


def _effects(problem: Problem, nominal: Case, decision: Decision) -> tuple[tuple[Effect, ...], Case | None]:
    if decision.winner is None:
        return (), None
    updated, estimates = with_hypothesis(problem, nominal, decision.winner)
    name = decision.winner.hypothesis.effect
    parameters = {
        e.name: Parameter(value=e.value, std=stated(name, e.name, e.value, e.std), unit=e.unit) for e in estimates
    }
    effect = Effect(name=name, probability=decision.probability["effect"], parameters=parameters)
    return (effect,), updated


def _candidates(found: Search, gaps: dict[str, float]) -> tuple[Candidate, ...]:
    """The best hypothesis of each effect, and the background alone; `gaps` by the names of hypotheses."""
    best: dict[tuple[str, ...], Tried | None] = {(): None}
    for one in found.tried:  # the best first
        if one.hypothesis.effect:
            best.setdefault((one.hypothesis.effect,), one)
    listed = [
        Candidate(
            effects=effects,
            log_evidence=float(one.gain) if one else 0.0,
            held_out=gaps.get(one.hypothesis.name if one else ""),
        )
        for effects, one in best.items()
    ]
    return tuple(sorted(listed, key=lambda candidate: -candidate.log_evidence))


def _gaps_held_out(
    problem: Problem, nominal: Case, plain: Case, found: Search, held_out: Measurement | None
) -> dict[str, float]:
    """Rms of what is left of the transmission error on the held-out record over its own fluctuation, by hypothesis
    ("": the background alone), for those that were refitted and add evidence."""
    if held_out is None or not held_out.phase_known:
        return {}
    simulate = replays(problem.machine.law)
    rows = measured_channels(held_out)["dte"].mean(axis=0)

    def left(case: Case) -> float:
        rest = rows - simulated_channels(held_out, simulate(case, held_out.record))["dte"]
        return float(np.std(rest) / np.std(rows))

    out = {"": left(plain)}
    for one in found.tried:
        if one.hypothesis.effect and one.fit is not None and one.gain > 0.0:
            out[one.hypothesis.name] = left(with_hypothesis(problem, nominal, one)[0])
    return out


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
