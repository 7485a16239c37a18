"""What a planned experiment can tell on its rig, before anything is measured and without any fit.

The case's conditions are carried out on the nominal rig; the diagnosis's own derivatives there say how well every
unknown would be known, and from that follow the smallest effects that it would name, those that it would mix up, and
what each record and channel is worth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.diagnosis.advice import advice_of
from gearbench.diagnosis.detection.information import Known, Without, floors_of
from gearbench.diagnosis.detection.opened import Changed, backlashes, smallest_backlash
from gearbench.diagnosis.detection.smallest import View, apart_from, largest, rivals_at, smallest
from gearbench.diagnosis.detection.stated import sizes_of, stated_at
from gearbench.diagnosis.effects.backlash import BACKLASH, KEY
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.library import hypotheses as library
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.evidence.separable import groups_of
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.planning.added import larger_plans
from gearbench.diagnosis.planning.known import known_of
from gearbench.diagnosis.planning.planned import Planned, planned
from gearbench.diagnosis.planning.row import BOTH, LONGER, Cost, Row
from gearbench.diagnosis.planning.worth import is_poor, said_of, sentence_of_more, words_of_effect
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.structure.layout import Layout
from gearbench.rig import Case
from gearbench.rig.contract import rank_of

Array = NDArray[np.float64]
Report = Callable[[str], None]

# Part of every block's level that the best rig is taken to leave: half of what sound rigs leave at most.
LEFT = 0.5 * POPULATION.structure
SHARPER = 100.0  # times the information: what no plan betters
QUIET = 0.25  # of the noise's variance: four times the periods
SPARED = ("y_driver", "y_driven", "torque_driven")  # channels that a diagnosis can do without
HELD = (
    "Flanks part in every record to search from: effects are told by simulations that are held to the driver's recorded"
    " motion, and must close the gap without that too. A record under a heavier torque_mean_nm or a smaller multisine,"
    " where flanks stay together, tells more surely."
)


@dataclass(frozen=True)
class Plan:
    """What an experiment can tell. `left`: part of every block's level that the best rig is taken to leave; `records`
    those of the search that are fitted, `parting` those whose flanks part, `judged` the one held out or None."""

    case: str
    left: float
    records: tuple[str, ...]
    parting: tuple[str, ...]
    judged: str | None
    rows: tuple[Row, ...]
    groups: tuple[tuple[str, ...], ...]
    advice: tuple[str, ...]


def plan_of(case: Case, report: Report = lambda step: None) -> Plan:
    """What the conditions of a case can tell on its nominal rig. Raises BenchError or DiagnosisError, a sentence each,
    for a case that cannot be simulated or diagnosed."""
    plan = planned(case, report)
    report("what the records would tell")
    known = known_of(plan)
    view = View(known, _shown(plan, known), left=LEFT)
    rows = [_row(plan.layout, view, number) for number in range(len(view.hypotheses))]
    report("what each record and channel is worth")
    rows = _with_costs(plan, view, rows)
    rows.append(_backlash(plan))
    inputs = plan.inputs
    parting = tuple(inputs.measurements[number].name for number in plan.rough)
    ranked = tuple(sorted(rows, key=lambda row: rank_of(row.effect)))
    groups = _groups(view)
    more = _what_more_brings(case, plan, view, report) if is_poor(rows) else ()
    said = (
        *advice_of(inputs.measurements, inputs.held_out),
        *((HELD,) if plan.nudges else ()),
        *said_of(ranked, groups, parting, inputs.judged.name),
        *more,
    )
    return Plan(
        case=case.name,
        left=LEFT,
        records=tuple(one.name for one in plan.fitted),
        parting=parting,
        judged=inputs.held_out.name if inputs.held_out else None,
        rows=ranked,
        groups=groups,
        advice=tuple(dict.fromkeys(said)),
    )


def _shown(plan: Planned, known: Known) -> tuple[Hypothesis, ...]:
    """The library, one cracked tooth of each gear for all, as far as the records show it at all."""
    listed = [one for one in library(plan.problem.model) if one.representative or one.wide[0].key != CRACK]
    return tuple(one for one in listed if np.isin(one.entries(known.unknowns), known.active).any())


def _row(layout: Layout, view: View, number: int) -> Row:
    one, sizes = view.hypotheses[number], sizes_of(layout, view, number)
    assert one.effect is not None
    found, most, stated = sizes.found, largest(view.known, one), sizes.stated[0]
    best = smallest(replace(view, sharper=SHARPER), number)
    apart = apart_from(view, number, found) if found is not None else None
    rivals = rivals_at(view, number, found) if found is not None else ()

    def told(size: float | None) -> float | None:
        return None if size is None else stated_at(layout, view, number, size)[0].value

    return Row(
        effect=one.effect.name,
        name=one.name,
        place=one.place,
        on=one.on,
        parameter=stated.name,
        unit=stated.unit,
        found=None if found is None else stated.value,
        std=stated.std,
        good=sizes.good[0].value,
        largest=stated_at(layout, view, number, most)[0].value,
        apart=told(apart),
        best=told(best),
        over_good=None if found is None else found / sizes.sound,
        over_best=None if found is None or best is None else found / best,
        rivals=_effects(view, rivals),
    )


def _effects(view: View, numbers: Sequence[int]) -> tuple[str, ...]:
    names = {one.effect.name for one in (view.hypotheses[number] for number in numbers) if one.effect}
    return tuple(sorted(names, key=rank_of))


def _left_out(plan: Planned) -> dict[str, Without]:
    """What can be left out of a plan, by name."""
    names = [one.name for one in plan.fitted]
    out = {f"record {name}": Without(record=name) for name in names} if len(names) > 1 else {}
    measured = {channel for one in plan.fitted for channel in one.periods}
    out |= {channel: Without(channels=(channel,)) for channel in SPARED if channel in measured}
    if {"y_driver", "y_driven"} <= measured:
        out[BOTH] = Without(channels=("y_driver", "y_driven"))
    return out


def _with_costs(plan: Planned, view: View, rows: Sequence[Row]) -> list[Row]:
    """The rows with what leaving out each record and channel costs, and what four times the periods bring."""
    sizes = [smallest(view, number) for number in range(len(rows))]
    views = {name: replace(view, without=without) for name, without in _left_out(plan).items()}
    views[LONGER] = replace(view, quiet=QUIET)
    costs: list[dict[str, Cost]] = [{} for _ in rows]
    for name, one in views.items():
        for number, size in enumerate(sizes):
            if size is not None:
                costs[number][name] = _cost(view, one, number, size)
    return [replace(row, costs=cost) for row, cost in zip(rows, costs, strict=True)]


def _what_more_brings(case: Case, plan: Planned, view: View, report: Report) -> tuple[str, ...]:
    """What one more record would find that this plan does not, or finds only larger, or mixes up."""
    held_out, said = plan.inputs.held_out, []
    for words, larger in larger_plans(case).items() if held_out else ():
        report(f"what a record {words} would add")
        try:
            known = known_of(planned(larger, held_out=held_out.name if held_out else None))
        except (BenchError, DiagnosisError):
            continue  # the sampling does not suit that speed, or the like
        other = View(known, view.hypotheses, left=LEFT)
        said.append(sentence_of_more(words, *_brought(view, other)))
    return tuple(one for one in said if one)


def _brought(view: View, other: View) -> tuple[dict[str, float], list[tuple[str, str]]]:
    """By how much smaller sizes the other view finds, by effect in words, and which effects it tells apart."""
    smaller: dict[str, float] = {}
    told = []
    for number, one in enumerate(view.hypotheses):
        assert one.effect is not None
        found, better = smallest(view, number), smallest(other, number)
        if better is None:
            continue
        smaller[words_of_effect(one.effect.name, one.name, one.on)] = np.inf if found is None else found / better
        size = better if found is None else found
        mixed = set(_effects(view, rivals_at(view, number, size))) if found is not None else set()
        gone = mixed - set(_effects(other, rivals_at(other, number, size)))
        told += [(one.effect.name, name) for name in sorted(gone)]
    return smaller, told


def _cost(view: View, other: View, number: int, size: float) -> Cost:
    at = view.hypotheses[number].entries(view.known.unknowns)
    found = smallest(other, number)
    spread = float(np.sqrt(np.mean(other.std(number)[at] ** 2) / np.mean(view.std(number)[at] ** 2)))
    return Cost(None if found is None else found / size, spread)


def _groups(view: View) -> tuple[tuple[str, ...], ...]:
    """Effects of which each explains what each other one of a usual size does."""
    explains: set[tuple[str, str]] = set()
    for number, one in enumerate(view.hypotheses):
        size = min(max(smallest(view, number) or 1.0, 1.0), largest(view.known, one))
        assert one.effect is not None
        explains |= {(name, one.effect.name) for name in _effects(view, rivals_at(view, number, size, usual=False))}
    names = sorted({name for pair in explains for name in pair}, key=rank_of)
    beside = {one: {other for other in names if {(one, other), (other, one)} <= explains} - {one} for one in names}
    return tuple(group for group in groups_of(names, beside) if len(group) > 1)


def _backlash(plan: Planned) -> Row:
    """The row of the backlash, which is simulated."""
    (one,) = BACKLASH.hypotheses(plan.problem.model)
    shown = None
    if plan.rough:
        rough = [(plan.inputs.measurements[number], plan.problem.conditions[number]) for number in plan.rough]
        shown = smallest_backlash(_changed(plan, rough), _changed(plan, [plan.judged]))
    sizes = backlashes(plan.layout.unknowns.group(KEY), shown)
    one_alone = sizes.found is not None and len(plan.rough) == 1
    return Row(
        effect=BACKLASH.name,
        name=one.name,
        place=one.place,
        on=one.on,
        parameter="more",
        unit="um",
        found=sizes.found,
        std=sizes.std,
        good=sizes.good,
        largest=sizes.largest,
        apart=sizes.found,
        best=None,
        over_good=None if sizes.found is None else sizes.found / sizes.good,
        costs={f"record {plan.inputs.measurements[plan.rough[0]].name}": Cost(None, inf)} if one_alone else {},
    )


def _changed(plan: Planned, of: Sequence[tuple[Measurement, Condition]]) -> Changed:
    """How far some of the planned records change with the nominal rig's backlash."""
    simulator = plan.simulator([one for one, _ in of], [condition for _, condition in of])
    return Changed(simulator, np.zeros(plan.layout.size), floors_of(simulator.target, left=LEFT))
