"""The finding that simulation justifies: what is named, what it closes, what stays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.account import (
    places_of,
    sentence_of_effect,
    sentence_of_judging,
    sentence_of_only,
    sentence_of_rivals,
    sentence_of_shares,
    which,
)
from gearbench.diagnosis.detection.detectable import too_small
from gearbench.diagnosis.effects.backlash import BACKLASH
from gearbench.diagnosis.effects.temperature_drift import TEMPERATURE_DRIFT
from gearbench.diagnosis.evidence.calibration import LIMITS
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.evidence.search import Search, missing_by_equation
from gearbench.diagnosis.finding import Finding
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import Unsteady, changing_parts
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.candidates import candidates_of
from gearbench.diagnosis.judging.chances import (
    Chances,
    chances_of,
    sentence_of_astray,
    sentence_of_doubt,
    sentence_of_size,
    signs_of_called,
    unlikely,
)
from gearbench.diagnosis.judging.closing import DUE
from gearbench.diagnosis.judging.decided import Decided, decide_simulated
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.judging.naming import drifts_of, effects_of
from gearbench.diagnosis.judging.only_there import with_backlash_there
from gearbench.diagnosis.judging.sifted import judged_of_size, left_out, seconded, sized
from gearbench.diagnosis.odds import Calibration
from gearbench.diagnosis.remainder.changing_place import placed
from gearbench.diagnosis.remainder.drift import drift_of
from gearbench.diagnosis.remainder.free_forces import FreeForce, free_forces
from gearbench.diagnosis.remainder.means import sentences_of_means
from gearbench.diagnosis.remainder.missing import Missing, missing_forces, nothing_missing
from gearbench.diagnosis.remainder.repeating import sentences_of_others
from gearbench.diagnosis.selection.rivals import unentered
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.structure.contrast import other_flanks
from gearbench.diagnosis.structure.structure import structure_found
from gearbench.rig import Case
from gearbench.rig.contract import rank_of

Array = NDArray[np.float64]
Report = Callable[[str], None]


@dataclass(frozen=True)
class Searched:
    """What the search by forces had and found: `fit` is the best effect's, else the background's; `unsteady` the
    excess scatter between repetitions of the records `steady`, `without` the effects left out."""

    problem: Problem
    nominal: Case
    measurements: tuple[Measurement, ...]
    result: Search
    fit: Fit
    steady: tuple[Measurement, ...]
    unsteady: Unsteady
    without: tuple[str, ...] = ()


def by_simulation(
    of: Searched,
    found: Simulated,
    held_out: Measurement | None,
    known: Calibration,
    common: dict[str, Any],
    report: Report,
) -> Finding:
    """The finding that simulation justifies."""
    settled = _settled(of, found, held_out, known, report)
    judged, decided, chances, missing = settled.judged, settled.decided, settled.chances, settled.missing
    found, signs, changing = judged.found, settled.signs, settled.signs["changing"]
    band = of.problem.conditions[0].band
    kept = [one.hypothesis for one in decided.named]
    flanks = other_flanks(found.layout.unknowns, found.selection.best.p)
    way = judged.along
    signs |= {"along": way.kept / way.own} if way else {}
    named = [unentered(one, decided.named) for one in decided.named]
    common["indistinguishable"] = with_rivals(common["indistinguishable"], named)
    return Finding(
        verdict=decided.verdict,
        probability=known.probabilities(chances.best, decided.sign),
        signs=signs,
        effects=(*effects_of(judged, decided, chances), *drifts_of(decided, changing, chances)),
        candidates=candidates_of(judged, held_out),
        place=decided.place,
        where=places_of(judged, kept, missing),
        recalibrated=found.recalibrated if kept else found.without_any,
        with_effect=found.with_effects if decided.named else None,
        because=(*decided.because, *why(judged, named), *settled.doubts, *flanks,
                 *([way.sentence()] if way else []), *sentences_of_means(found),
                 *sentences_of_others(of.measurements, of.steady, band),
                 *sentence_of_judging(judged.measured, held_out)),
        structure=structure_found(found.layout.unknowns, found.selection.best.p, found.std),
        missing=missing,
        places=tuple(one.place for one in kept),
        audits={
            "unsteady": tuple(of.unsteady.excess),
            "missing": tuple(missing.excess),
            "silent": tuple(missing.silent),
            "changing": (changing,),
            "left": (judged.left, judged.remains),
        },
        judged=judged,
        problem=of.problem,
        **common,
    )


class _Settled(NamedTuple):
    """What was decided on the judged record, with its chances and signs, and what was not named for want of them."""

    judged: Judged
    decided: Decided
    chances: Chances
    missing: Missing
    signs: dict[str, float]
    doubts: tuple[str, ...]


def _settled(
    of: Searched, found: Simulated, held_out: Measurement | None, known: Calibration, report: Report
) -> _Settled:
    """The decision, made again without each effect that is named and is not likely, or smaller than the records tell,
    and without all where the rig is closer to the judged record without any."""
    entered, doubts, doubted = found.selection.entered, list[str](), dict[str, float]()
    judged = judged_of_size(of.problem, _judgeable(of, found, held_out), held_out, of.measurements, report)
    repeated = changing_parts(of.steady, of.problem.conditions[0].band)
    while True:
        found, changing = judged.found, changing_of(judged, repeated)
        unsteady = placed(of.unsteady, LIMITS, found, of.steady, much=changing > known.changing)
        place, _ = unsteady.worst(LIMITS.unsteady)
        free = _free(found)
        missing = _missing(of, found)
        signs = {f"over {place}": float(over) for place, over in zip(PLACES, missing.over, strict=True)}
        missing = replace(missing, factors=np.array([known.outstanding.get(place, 1.0) for place in PLACES]))
        drift = None
        if TEMPERATURE_DRIFT.name not in of.without:
            drift = drift_of(found, of.steady, place, told=unsteady.acts is not None)
        decided = decide_simulated(
            judged, of.result, missing, unsteady, changing, known=known, drift=drift, free=free
        )
        signs |= {f"free {one.form.name}": one.worth for one in free}
        signs |= {f"size {one.form.name}": one.size for one in free}
        signs |= {"lines": float(found.simulator.target.counts.sum()), "unknown": decided.sign, "left": judged.left,
                  "remains": judged.remains, "searched": judged.searched, "hidden": judged.hidden,
                  "changing": changing}  # fmt: skip
        chances = chances_of(judged, decided, known, signs["lines"], (*entered, *judged.dropped))
        out, said, doubt = doubtful(of, judged, decided, chances)
        doubts, doubted = [*doubts, *said], doubted | doubt
        if not out:
            signs |= doubted | signs_of_called(chances, chances.named)
            return _Settled(judged, decided, chances, missing, signs, tuple(doubts))
        again = judged_of_size(of.problem, left_out(found, out), held_out, of.measurements, report)
        judged = again.with_dropped(judged.dropped)


def doubtful(
    of: Searched, judged: Judged, decided: Decided, chances: Chances
) -> tuple[tuple[Weighed, ...], list[str], dict[str, float]]:
    """Of the named effects those that are to be left out next, why, and the signs of what is too unlikely."""
    entered = judged.found.selection.entered
    # What leads astray speaks for something unknown no more than for itself.
    if entered and judged.is_astray:
        return entered, [sentence_of_astray(one) for one in entered], {}
    if one := unlikely(decided, chances):
        return (one,), [sentence_of_doubt(one, chances)], signs_of_called(chances, (one.hypothesis.name,))
    if one := _too_small(of, judged, decided.named):
        return (one,), [sentence_of_size(one)], {}
    return (), [], {}


def _too_small(of: Searched, judged: Judged, named: Sequence[Weighed]) -> Weighed | None:
    """The named effect that is furthest below the size that the records would have named; None without any, or where
    none has a size that a rig may have."""
    if judged.target is None:
        return None
    try:
        return too_small(of.problem, judged, named)
    except ValueError:
        return None


def _judgeable(of: Searched, found: Simulated, held_out: Measurement | None) -> Simulated:
    """What was found, sifted by the size of its effects and what the force residuals name, with what only the held-out
    record can show."""
    found = sized(seconded(found, of.result))
    if held_out is None or not held_out.phase_known or BACKLASH.name in of.without:
        return found
    return with_backlash_there(of.problem, found, held_out)


def _free(found: Simulated) -> tuple[FreeForce, ...]:
    """What forces without a name are worth beside the rig found."""
    try:
        return free_forces(found.simulator, found.selection.best)
    except ValueError:  # an audit that cannot be made costs what it would have seen, not the verdict
        return ()


def _missing(of: Searched, found: Simulated) -> Missing:
    """The forces that the rig found lacks, with what the force residuals' fit leaves, a line."""
    best_p, smooth = found.end_of(found.selection.best), found.simulator.held_by
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


def with_rivals(groups: Sequence[tuple[str, ...]], named: Sequence[Weighed]) -> tuple[tuple[str, ...], ...]:
    """Groups of effects that records cannot tell apart, with each named effect and its rivals in one of them."""
    joined = list(groups)
    for one in named:
        names = {cause.effect.name for cause in one.causes if cause.effect is not None}
        if len(names) > 1 and not any(names <= set(group) for group in joined):
            joined.append(tuple(sorted(names, key=rank_of)))
    return tuple(joined)


def changing_of(judged: Judged, parts: Mapping[str, float]) -> float:
    """The largest rms of what changes between repetitions over that of the nominal gap, of the channels in which it
    makes what is left, noise included, as much larger as an effect that is due would: less is no matter to the gap."""
    seen = sqrt(DUE**2 - 1.0)
    sizes = {c: (parts[c] * one.fluctuation, one) for c, one in judged.sizes.items() if c in parts}
    return max((rms / one.nominal for rms, one in sizes.values() if rms > seen * one.final), default=0.0)


def why(judged: Judged, named: Sequence[Weighed]) -> tuple[str, ...]:
    """What each named effect closes, and what closes nothing."""
    said = []
    for one in named:
        closing = judged.closings[one.hypothesis.name]
        said.append(sentence_of_effect(one.effect.noun, closing, judged.share_of(one.hypothesis)))
    size = judged.sizes.get("dte")
    # Along the record's way the sizes of both are not those that decide.
    if named and judged.kept is None and size is not None and size.plain < DUE * size.final:
        said.append(sentence_of_shares([one.effect.noun for one in named], size.plain, size.final))
    said += [sentence_of_only(one.effect.noun, one.only_in) for one in named if one.only_in]
    said += [sentence_of_rivals(one.causes) for one in named if one.rivals]
    for weighed in judged.dropped:
        noun = which(weighed.hypothesis)
        said.append(f"The records of the search speak for {noun}, but the judged record's gap stays as it was with it")
    return tuple(dict.fromkeys(said))
