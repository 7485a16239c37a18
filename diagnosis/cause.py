"""Which unmodelled effects cause the gap: search by forces, decision by simulation, and the rigs that follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Effect as Library
from gearbench.diagnosis.effects.effect import Estimate, Fitted, added
from gearbench.diagnosis.effects.recalibrated import recalibrated
from gearbench.diagnosis.evidence.decision import Decision, decide, named
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.problem import Problem, problem_of
from gearbench.diagnosis.evidence.search import Search, missing_by_equation, search
from gearbench.diagnosis.evidence.separable import alike, representatives
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import unsteadiness
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.output.selection import with_entered
from gearbench.diagnosis.output.simulated import Simulated, simulated
from gearbench.diagnosis.output.verdict_of import Decided, decide_simulated, lacking, remainder
from gearbench.diagnosis.replay.replays import replays
from gearbench.diagnosis.verdict import Candidate, Effect, Outcome, Parameter, Share
from gearbench.rig import Case
from gearbench.rig.contract import Place

Array = NDArray[np.float64]
Report = Callable[[str], None]


@dataclass(frozen=True)
class Finding:
    """What was found: fields of the verdict, the nominal case recalibrated and with the effects added."""

    verdict: Outcome
    probability: dict[str, float]
    effects: tuple[Effect, ...]
    candidates: tuple[Candidate, ...]
    place: Place
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
    problem = problem_of(measurements, nominal)
    result = search(problem, without, report)
    best = named(result)
    fit = best.fit if best and best.fit else result.base
    silent = missing_by_equation(problem, fit)
    report("steadiness")
    unsteady = unsteadiness(problem.model, measurements, problem.unknowns, fit.p, problem.conditions[0].band)
    simulate = replays(problem.model.law)
    found = simulated(problem, result, measurements, nominal, simulate, without, report)
    common: dict[str, Any] = {
        "where": _places(problem, result.base),
        "indistinguishable": alike(fit, problem.unknowns, representatives(problem, without)),
        "evidence": {one.hypothesis.name: one.log_bayes_factor for one in result.tried},
        "audits": {"silent": tuple(silent), "unsteady": tuple(unsteady)},
    }
    if found is None:
        return _by_forces_alone(problem, nominal, result, decide(result, silent, unsteady), common)
    decided = decide_simulated(found, result, silent, unsteady)
    if decided.verdict == "none":
        found, decided = seconded(found, decided, decide(result, silent, unsteady))
    common["audits"] |= {"remainder": tuple(remainder(found).values()), "lacking": tuple(lacking(found).values())}
    judged = held_out if held_out is not None and held_out.phase_known else None
    return Finding(
        verdict=decided.verdict,
        probability=decided.probability,
        effects=_effects(found, decided),
        candidates=_candidates(found, judged),
        place=decided.place,
        recalibrated=found.recalibrated,
        with_effect=found.with_effects if decided.named else None,
        because=decided.because,
        **common,
    )


def seconded(found: Simulated, decided: Decided, forces: Decision) -> tuple[Simulated, Decided]:
    """What the force residuals name where simulation alone names nothing but speaks for the same effect."""
    name = forces.winner.hypothesis.name if forces.winner is not None else None
    for one in found.selection.weighed:
        if one.hypothesis.name == name and one.optimum is not None and one.log_bayes_factor > 0.0:
            selection = with_entered(found.simulator, found.selection, one)
            because = "the forces missing in the measured motion call for it, and simulation comes closer with it"
            named = Decided("effect", one.hypothesis.place, (one,), forces.probability, because)
            return replace(found, selection=selection, std=selection.best.std), named
    return found, decided


def _by_forces_alone(
    problem: Problem, nominal: Case, result: Search, decision: Decision, common: dict[str, Any]
) -> Finding:
    """The finding where records cannot be simulated, as they do not tell the mesh phase."""
    plain, updated = recalibrated(nominal, fitted(problem, result.base)), None
    effects: tuple[Effect, ...] = ()
    if decision.winner is not None and decision.winner.fit is not None:
        values, effect = fitted(problem, decision.winner.fit), decision.winner.hypothesis.effect
        assert effect is not None
        updated, estimates = added(recalibrated(nominal, values), decision.winner.hypothesis, values)
        effects = (
            Effect(
                name=effect.name,
                probability=decision.probability["effect"],
                parameters=_parameters(effect, estimates),
            ),
        )
    tried: dict[tuple[str, ...], float] = {(): 0.0}
    for one in result.tried:
        if one.hypothesis.effect:
            tried.setdefault((one.hypothesis.effect.name,), one.log_bayes_factor)
    listed = [Candidate(effects=names, log_evidence=value) for names, value in tried.items()]
    return Finding(
        verdict=decision.verdict,
        probability=decision.probability,
        effects=effects,
        candidates=tuple(sorted(listed, key=lambda candidate: -candidate.log_evidence)),
        place=decision.place,
        recalibrated=plain,
        with_effect=updated,
        because=decision.because,
        **common,
    )


def fitted(problem: Problem, fit: Fit) -> Fitted:
    """What a fit says of the unknowns of a problem."""
    means = {condition.name: condition.torque_mean for condition in problem.conditions}
    return Fitted(problem.model, problem.unknowns, fit.p, fit.std, means)


def _parameters(effect: Library, estimates: Sequence[Estimate]) -> dict[str, Parameter]:
    return {e.name: Parameter(value=e.value, std=effect.stated(e), unit=e.unit) for e in estimates}


def _effects(found: Simulated, decided: Decided) -> tuple[Effect, ...]:
    """The named effects with their parameters; one that is at work in two places counts once."""
    best = found.selection.best
    values = found.layout.fitted(best.p, found.std)
    out: dict[str, Effect] = {}
    for one in decided.named:
        effect = one.hypothesis.effect
        assert effect is not None
        estimates = effect.add(found.layout.nominal.rig, one.hypothesis, values)[1]
        before = out[effect.name].parameters if effect.name in out else {}
        parameters = {**before, **_parameters(effect, estimates)}
        out[effect.name] = Effect(name=effect.name, probability=decided.probability["effect"], parameters=parameters)
    return tuple(out.values())


def _candidates(found: Simulated, judged: Measurement | None) -> tuple[Candidate, ...]:
    """The best hypothesis of each effect, the background alone, and what is named together, with the relative gap that
    each leaves on the held-out record."""
    selection = found.selection
    measured = measured_channels(judged)["dte"].mean(axis=0) if judged is not None else None

    def left(p: Array | None) -> float | None:
        if judged is None or measured is None or p is None:
            return None
        try:
            rest = measured - found.simulator.channels(p, judged)["dte"]
        except ValueError:
            return None
        return float(np.std(rest) / np.std(measured))

    best: dict[tuple[str, ...], tuple[float, Array | None]] = {(): (0.0, selection.base.p)}
    for one in selection.weighed:  # the best first
        assert one.hypothesis.effect is not None
        p = one.optimum.p if one.optimum and one.log_bayes_factor > 0.0 else None
        best.setdefault((one.hypothesis.effect.name,), (one.log_bayes_factor, p))
    names = tuple(dict.fromkeys(one.hypothesis.effect.name for one in selection.entered if one.hypothesis.effect))
    if len(names) > 1:
        best[names] = (selection.best.evidence - selection.base.evidence, selection.best.p)
    listed = [
        Candidate(effects=effects, log_evidence=float(value), held_out=left(p)) for effects, (value, p) in best.items()
    ]
    return tuple(sorted(listed, key=lambda candidate: -candidate.log_evidence))


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
