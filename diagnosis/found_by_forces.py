"""The finding of the force residuals, where no record can be followed by simulation."""

from __future__ import annotations

from math import sqrt
from typing import Any

from gearbench.diagnosis.effects.effect import Fitted, added
from gearbench.diagnosis.effects.recalibrated import recalibrated
from gearbench.diagnosis.evidence.decision import Decision
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.evidence.search import Search, missing_by_equation
from gearbench.diagnosis.finding import Finding
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.naming import parameters_of
from gearbench.diagnosis.odds import Calibration, effect_signs
from gearbench.diagnosis.replay.gap import Simulate, gaps
from gearbench.diagnosis.verdict import Candidate, Effect, Share
from gearbench.rig import Case


def by_forces_alone(
    problem: Problem,
    nominal: Case,
    plain: Case,
    result: Search,
    decision: Decision,
    known: Calibration,
    common: dict[str, Any],
) -> Finding:
    """The finding where no record can be followed by simulation; `plain` is the nominal case recalibrated."""
    updated = None
    lines = sum(float(blocks.count.sum()) for blocks in problem.blocks)
    ahead = max((one.log_bayes_factor for one in result.tried if one.hypothesis.effect), default=0.0)
    best = effect_signs(ahead, lines, None if decision.winner is None else 1.0)
    probability = known.probabilities(best, decision.sign)
    effects: tuple[Effect, ...] = ()
    if decision.winner is not None and decision.winner.fit is not None:
        values, effect = fitted(problem, decision.winner.fit), decision.winner.hypothesis.effect
        assert effect is not None
        updated, estimates = added(recalibrated(nominal, values), decision.winner.hypothesis, values)
        effects = (
            Effect(
                name=effect.name,
                probability=probability["effect"],
                parameters=parameters_of(effect, estimates, by_forces=True),
            ),
        )
    tried: dict[tuple[str, ...], float] = {(): 0.0}
    for one in result.tried:
        if one.hypothesis.effect:
            tried.setdefault((one.hypothesis.effect.name,), one.log_bayes_factor)
    listed = [Candidate(effects=names, log_evidence=value) for names, value in tried.items()]
    return Finding(
        verdict=decision.verdict,
        probability=probability,
        signs={"lines": lines, "unknown": decision.sign},
        effects=effects,
        candidates=tuple(sorted(listed, key=lambda candidate: -candidate.log_evidence)),
        place=decision.place,
        recalibrated=plain,
        with_effect=updated,
        because=(decision.because,),
        places=(decision.place,) if effects else (),
        **common,
    )


def fitted(problem: Problem, fit: Fit) -> Fitted:
    """What a fit says of the unknowns of a problem."""
    means = {condition.name: condition.torque_mean for condition in problem.conditions}
    return Fitted(problem.model, problem.unknowns, fit.p, fit.std, means)


def left_of(nominal: Case, plain: Case, judged: Measurement, simulate: Simulate) -> float:
    """Part of the transmission error's gap that the recalibrated rig `plain` leaves in a record beyond its noise, rms
    over rms; none where a rig cannot be simulated there."""
    try:
        gap = next((one for one in gaps(nominal, plain, None, judged, simulate=simulate) if one.channel == "dte"), None)
    except ValueError:
        return 0.0
    if gap is None or gap.floor is None:
        return 0.0
    noise = gap.floor.value**2
    left, whole = gap.recalibrated.value**2 - noise, gap.nominal.value**2 - noise
    return sqrt(max(left, 0.0) / max(whole, noise))


def places_by_forces(problem: Problem, base: Fit) -> tuple[Share, ...]:
    """Shares of what the background leaves unexplained, by place."""
    missing = missing_by_equation(problem, base)
    total = float(missing.sum())
    if total <= 0.0:
        return ()
    return tuple(
        Share(kind="place", name=name, share=float(value) / total, floor=None)
        for name, value in zip(PLACES, missing, strict=True)
    )
