"""Which unmodelled effects cause the gap: search by forces, decision by simulation, and the rigs that follow."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.account import places_of, sentence_of_effect, sentence_of_rivals
from gearbench.diagnosis.advice import PARTED
from gearbench.diagnosis.effects.effect import Fitted, Hypothesis, added
from gearbench.diagnosis.effects.recalibrated import recalibrated
from gearbench.diagnosis.effects.temperature_drift import TEMPERATURE_DRIFT
from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.decision import Decision, decide, named
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.problem import Problem, problem_of
from gearbench.diagnosis.evidence.search import Search, missing_by_equation, search
from gearbench.diagnosis.evidence.separable import alike, representatives
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import changing_parts, unsteadiness
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.judging.chances import chances_of, sentence_of_doubt, unlikely
from gearbench.diagnosis.judging.decided import decide_simulated, relative_size, size_needed, unexplained
from gearbench.diagnosis.judging.drift import drift_of
from gearbench.diagnosis.judging.judged import Judged, itself, judged_on
from gearbench.diagnosis.judging.missing import Missing, missing_forces, nothing_missing
from gearbench.diagnosis.judging.naming import drifts_of, effects_of, parameters_of
from gearbench.diagnosis.judging.repeating import repeating, sentences_of_others
from gearbench.diagnosis.odds import Calibration, effect_signs
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.replay.gap import Simulate, gaps
from gearbench.diagnosis.replay.replays import replays
from gearbench.diagnosis.selection.selection import only, with_entered
from gearbench.diagnosis.selection.simulated import Simulated, simulated
from gearbench.diagnosis.selection.weighing import WORTH, Weighed
from gearbench.diagnosis.structure.contrast import other_flanks
from gearbench.diagnosis.structure.structure import structure_found
from gearbench.diagnosis.verdict import Candidate, Effect, Found, Outcome, Share
from gearbench.rig import Case
from gearbench.rig.contract import Place, rank_of

Array = NDArray[np.float64]
Report = Callable[[str], None]


@dataclass(frozen=True)
class Finding:
    """What was found: fields of the verdict, the nominal case recalibrated and with the effects added; `judged`: what
    simulation makes of the judged record, None where records cannot be simulated."""

    verdict: Outcome
    probability: dict[str, float]
    signs: dict[str, float]
    effects: tuple[Effect, ...]
    candidates: tuple[Candidate, ...]
    place: Place
    where: tuple[Share, ...]
    recalibrated: Case
    with_effect: Case | None
    because: tuple[str, ...]
    structure: tuple[Found, ...] = ()
    missing: Missing | None = None
    places: tuple[Place, ...] = ()
    indistinguishable: tuple[tuple[str, ...], ...] = ()
    advice: tuple[str, ...] = ()
    evidence: dict[str, float] = field(default_factory=dict)
    audits: dict[str, tuple[float, ...]] = field(default_factory=dict)
    judged: Judged | None = None


def find_cause(
    measurements: Sequence[Measurement],
    nominal: Case,
    *,
    held_out: Measurement | None = None,
    without: Sequence[str] = (),
    report: Report = lambda step: None,
    known: Calibration = POPULATION,
) -> Finding:
    """The cause of the gap between the measurements and the nominal case.

    `without` leaves effects out of the library; `known` is what the decision rests on. Raises DiagnosisError for
    measurements that cannot be used.
    """
    problem = problem_of(measurements, nominal)
    result = search(problem, without, report)
    best = named(result)
    fit = best.fit if best and best.fit else result.base
    simulate = replays(problem.model.sound)
    apart = held_out is not None and held_out.phase_known
    found = simulated(problem, result, measurements, nominal, simulate, without, report, apart=apart)
    report("steadiness")
    band, steady = problem.conditions[0].band, repeating(measurements, found)
    unsteady = unsteadiness(problem.model, steady, problem.unknowns, fit.p, band)
    common: dict[str, Any] = {
        "indistinguishable": alike(fit, problem.unknowns, representatives(problem, without)),
        "evidence": {one.hypothesis.name: one.log_bayes_factor for one in result.tried},
    }
    if found is None:
        silent = missing_by_equation(problem, fit)
        common["where"] = _places(problem, result.base)
        common["audits"] = {"silent": tuple(silent), "unsteady": tuple(unsteady)}
        decision, plain = decide(result, silent, unsteady), recalibrated(nominal, fitted(problem, result.base))
        if all(one.phase_known for one in measurements):
            common["advice"] = (PARTED,)
            decision = unexplained(decision, silent, _left(nominal, plain, held_out or measurements[0], simulate))
        return _by_forces_alone(problem, nominal, plain, result, decision, known, common)
    report("judging")
    searched = Searched(problem, nominal, tuple(measurements), result, fit, steady, unsteady, tuple(without))
    return _by_simulation(searched, found, held_out, known, common, report)


@dataclass(frozen=True)
class Searched:
    """What the search by forces had and found: `fit` is the best effect's, else the background's; `unsteady`
    (equations + 1,) the excess scatter between repetitions of the records `steady`, `without` the effects left out."""

    problem: Problem
    nominal: Case
    measurements: tuple[Measurement, ...]
    result: Search
    fit: Fit
    steady: tuple[Measurement, ...]
    unsteady: Array
    without: tuple[str, ...] = ()


def _by_simulation(
    of: Searched,
    found: Simulated,
    held_out: Measurement | None,
    known: Calibration,
    common: dict[str, Any],
    report: Report,
) -> Finding:
    """The finding that simulation justifies."""
    entered = found.selection.entered
    judged = _judged(of, sized(seconded(found, of.result)), held_out, report)
    band = of.problem.conditions[0].band
    changing = changing_of(judged, changing_parts(of.steady, band))
    doubts: tuple[str, ...] = ()
    while True:
        found = judged.found
        missing = _missing(of, found)
        signs = {f"over {place}": float(over) for place, over in zip(PLACES, missing.over, strict=True)}
        missing = replace(missing, factors=np.array([known.outstanding.get(place, 1.0) for place in PLACES]))
        drift = None if TEMPERATURE_DRIFT.name in of.without else drift_of(found)
        decided = decide_simulated(judged, of.result, missing, of.unsteady, changing, known=known, drift=drift)
        signs |= {"lines": float(found.simulator.target.counts.sum()), "unknown": decided.sign, "left": judged.left,
                  "remains": judged.remains, "searched": judged.searched, "hidden": judged.hidden,
                  "changing": changing}  # fmt: skip
        chances = chances_of(judged, decided, known, signs["lines"], (*entered, *judged.dropped))
        doubtful = unlikely(decided, chances)
        if doubtful is None:
            break
        doubts = (*doubts, sentence_of_doubt(doubtful, chances))
        judged = _judged(of, left_out(found, (doubtful,)), held_out, report)
    kept = [one.hypothesis for one in decided.named]
    flanks = other_flanks(found.layout.unknowns, found.selection.best.p)
    common["indistinguishable"] = with_rivals(common["indistinguishable"], decided.named)
    return Finding(
        verdict=decided.verdict,
        probability=known.probabilities(chances.best, decided.sign),
        signs=signs,
        effects=(*effects_of(judged, decided, chances), *drifts_of(decided, changing, chances)),
        candidates=_candidates(found, held_out if held_out is not None and held_out.phase_known else None),
        place=decided.place,
        where=places_of(judged, kept, missing),
        recalibrated=found.recalibrated if kept else found.without_any,
        with_effect=found.with_effects if decided.named else None,
        because=(*decided.because, *_why(judged, kept), *doubts, *flanks,
                 *sentences_of_others(of.measurements, of.steady, band)),
        structure=structure_found(found.layout.unknowns, found.selection.best.p, found.std),
        missing=missing,
        places=tuple(one.place for one in kept),
        audits={
            "unsteady": tuple(of.unsteady),
            "missing": tuple(missing.excess),
            "silent": tuple(missing.silent),
            "changing": (changing,),
            "left": (judged.left, judged.remains),
        },
        judged=judged,
        **common,
    )


def _judged(of: Searched, found: Simulated, held_out: Measurement | None, report: Report) -> Judged:
    """What was found on the judged record, but for effects of which a sound rig has as much: some enter there only."""
    while True:
        judged = judgement(of.problem, found, held_out, of.measurements, report)
        found = sized(judged.found)
        if found is judged.found:
            return judged


def _missing(of: Searched, found: Simulated) -> Missing:
    """The forces that the rig found lacks, with what the force residuals' fit leaves, a line."""
    best_p, smooth = found.end_of(found.selection.best), found.simulator.target.measurements
    try:
        missing = missing_forces(
            of.problem,
            of.nominal,
            smooth,
            lambda one: found.simulator.simulate(found.layout.case(best_p, one.name), one.record),
        )
    except ValueError:  # an audit that cannot be made costs the place of the remainder, not the verdict
        missing = nothing_missing()
    lines = sum(float(blocks.count.sum()) for blocks in of.problem.blocks)
    return replace(missing, silent=missing_by_equation(of.problem, of.fit) / lines)


def _left(nominal: Case, plain: Case, judged: Measurement, simulate: Simulate) -> float:
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


def sized(found: Simulated, limits: Limits = LIMITS) -> Simulated:
    """What simulation found without those effects of which a sound rig has as much."""
    entered = found.selection.entered
    return left_out(found, [one for one in entered if relative_size(found, one) <= size_needed(one, limits)])


def left_out(found: Simulated, out: Sequence[Weighed]) -> Simulated:
    """What simulation found without these of the effects that entered."""
    if not out:
        return found
    kept = [one for one in found.selection.entered if not any(one is other for other in out)]
    selection = only(found.simulator, found.selection, kept)
    return replace(found.with_selection(selection), out=(*found.out, *out))


def seconded(found: Simulated, forces: Search) -> Simulated:
    """With what the force residuals name where simulation alone names nothing but speaks for the same effect."""
    best = named(forces)
    if found.selection.entered or best is None:
        return found
    for one in found.selection.weighed:
        if one.hypothesis.name == best.hypothesis.name and one.optimum is not None and one.log_bayes_factor > WORTH:
            return found.with_selection(with_entered(found.simulator, found.selection, one))
    return found


def with_rivals(groups: Sequence[tuple[str, ...]], named: Sequence[Weighed]) -> tuple[tuple[str, ...], ...]:
    """Groups of effects that records cannot tell apart, with each named effect and its rivals in one of them."""
    joined = list(groups)
    for one in named:
        names = {cause.effect.name for cause in one.causes if cause.effect is not None}
        if len(names) > 1 and not any(names <= set(group) for group in joined):
            joined.append(tuple(sorted(names, key=rank_of)))
    return tuple(joined)


def judgement(
    problem: Problem,
    found: Simulated,
    held_out: Measurement | None,
    searched: Sequence[Measurement],
    report: Report = lambda step: None,
) -> Judged:
    """What was found on the held-out record; without one that can be simulated, on the first record of the search."""
    judged = None
    if held_out is not None and held_out.phase_known:
        judged = judged_on(problem, found, held_out, searched, report)
    return judged or itself(problem, found)


def changing_of(judged: Judged, parts: Mapping[str, float]) -> float:
    """The largest rms of what changes between repetitions over that of the nominal gap."""
    sizes = judged.sizes
    return max((parts[c] * one.fluctuation / one.nominal for c, one in sizes.items() if c in parts), default=0.0)


def _why(judged: Judged, kept: Sequence[Hypothesis]) -> tuple[str, ...]:
    """What each named effect closes, and what closes nothing."""
    said = []
    for one in kept:
        assert one.effect is not None
        closing = judged.closings[one.name]
        said.append(sentence_of_effect(one.effect.noun, closing, judged.share(closing.without)))
    said += [sentence_of_rivals(one.causes) for one in judged.found.selection.entered if one.rivals]
    for weighed in judged.dropped:
        assert weighed.hypothesis.effect is not None
        noun = weighed.hypothesis.effect.noun
        said.append(f"The records of the search speak for {noun}, but the judged record's gap stays as it was with it")
    return tuple(said)


def _by_forces_alone(
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
    best = effect_signs(ahead, lines, decision.winner is not None, 0.0)
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
                parameters=parameters_of(effect, estimates),
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


def _candidates(found: Simulated, judged: Measurement | None) -> tuple[Candidate, ...]:
    """The best hypothesis of each effect, the background alone, and what is named together, with the relative gap that
    each leaves on the held-out record. Evidence is that over the background alone, or beside what else is named where
    only that shows an effect."""
    selection = found.selection
    measured = measured_channels(judged)["dte"].mean(axis=0) if judged is not None else None

    def left(p: Array | None) -> float | None:
        if judged is None or measured is None or p is None:
            return None
        try:
            rest = measured - found.simulator.free.channels(p, judged)["dte"]
        except ValueError:
            return None
        return float(np.std(rest) / np.std(measured))

    best: dict[tuple[str, ...], tuple[float, Array | None]] = {(): (0.0, selection.base.p)}
    for one in selection.weighed:  # the best first
        assert one.hypothesis.effect is not None
        p = one.optimum.p if one.optimum and one.log_bayes_factor > 0.0 else None
        best.setdefault((one.hypothesis.effect.name,), (one.log_bayes_factor, p))
    for one in selection.entered:
        assert one.hypothesis.effect is not None
        alone, p = best.get((one.hypothesis.effect.name,), (-np.inf, None))
        best[(one.hypothesis.effect.name,)] = (max(alone, one.log_bayes_factor), p)
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
