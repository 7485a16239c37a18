"""What a record would have named, of a simulated record of the demonstration that holds nothing but its nominal rig."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from shared.simulated_lines import quicker

from gearbench.diagnosis.detection.detectable import _answering, detectable_of, too_small
from gearbench.diagnosis.detection.smallest import View
from gearbench.diagnosis.detection.stated import sizes_of
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.library import hypotheses
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.fitting.fit import Optimum, sensitivity_of
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.planning.known import known_of
from gearbench.diagnosis.planning.plan import LEFT
from gearbench.diagnosis.planning.planned import Planned, planned
from gearbench.diagnosis.selection.selection import Selection
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.verdict import Smallest

FASTER = 4


@dataclass(frozen=True)
class Made:
    plan: Planned
    problem: Problem
    judged: Judged


@pytest.fixture(scope="module")
def made() -> Made:
    """The nominal rig found as it is, from a record of itself, on which it is judged as well."""
    case = quicker(FASTER, 1)
    plan = planned(case.under(case.conditions[0]))
    simulator = plan.simulator(plan.fitted, plan.conditions)
    p, sd = np.zeros(plan.layout.size), plan.layout.unknowns.prior()
    lines, sensitivity = simulator.lines(p), sensitivity_of(simulator, p, sd)
    assert lines is not None and sensitivity is not None
    here = Optimum(p, sd, lines, 0.0, 0.0, 0.0, 0.0, sensitivity)
    found = Simulated(plan.layout, simulator, Selection(here, here, here, (), ()))
    (measured,) = plan.fitted
    return Made(plan, plan.problem, Judged(measured, found, {}, {}, {}, {}, target=simulator.target))


def friction_of(made: Made, judged: Judged) -> Smallest:
    found = detectable_of(made.problem, judged, [judged.measured])
    return next(one for one in found if one.name == "friction").parameters["coefficient"]


def grown(made: Made, factor: float) -> Judged:
    """Judged on a record with that many times what its mesh does at its own orders."""
    target = made.judged.target
    assert target is not None
    return replace(made.judged, target=replace(target, lines=factor * target.lines))


def test_of_a_rig_without_a_gap_it_is_what_a_plan_promises(made: Made) -> None:
    """The plan reads it off a Jacobian of its own, with a tenth of the levels left."""
    found = detectable_of(made.problem, made.judged, [made.judged.measured])
    (one,) = (one for one in hypotheses(made.problem.model) if one.name == "friction")
    row = sizes_of(made.plan.layout, View(known_of(made.plan), (one,), left=LEFT), 0)
    told = {one.name for one in found}
    assert told == {one.effect.name for one in hypotheses(made.problem.model) if one.effect}
    friction = next(one for one in found if one.name == "friction").parameters["coefficient"]
    assert friction.good == pytest.approx(row.good[0].value) and friction.value is not None and row.found is not None
    # Nothing is left of this record but its noise, so that less is found and better known.
    assert friction.good < friction.value <= row.stated[0].value and friction.std < row.stated[0].std


def test_what_the_rig_leaves_hides_effects(made: Made) -> None:
    sizes = [friction_of(made, grown(made, factor)).value for factor in (1.0, 1.3, 3.0)]
    assert sizes[0] is not None and sizes[1] is not None
    assert sizes[0] <= sizes[1] and (sizes[2] is None or sizes[1] < sizes[2])
    assert sizes[2] is None or sizes[2] > 1.5 * sizes[0]


def test_flanks_that_stay_together_show_no_backlash(made: Made) -> None:
    (backlash,) = (
        one for one in detectable_of(made.problem, made.judged, [made.judged.measured]) if one.name == "backlash"
    )
    assert backlash.parameters["more"].value is None


def test_effects_that_are_left_out_are_not_told(made: Made) -> None:
    without = ("backlash", "friction", "tooth-crack")
    found = {one.name for one in detectable_of(made.problem, made.judged, [made.judged.measured], without)}
    assert found and not found & set(without)


def test_a_named_effect_is_told_beside_the_others_alone(made: Made) -> None:
    """Its wide prior in the last fit would leave nothing for it to gain."""
    found, selection = made.judged.found, made.judged.found.selection
    (friction,) = (one for one in hypotheses(made.problem.model) if one.name == "friction")
    assert isinstance(friction, Hypothesis)
    wide = replace(selection.best, sd=friction.widened(found.layout.unknowns, selection.best.sd))
    named = replace(made.judged, found=found.with_selection(replace(selection, best=wide)))
    assert friction_of(made, named) == friction_of(made, made.judged)


@pytest.mark.parametrize(("part", "share", "small"), [(0.8, 1e-4, True), (1.2, 1e-4, False), (0.8, 0.02, False)])
def test_a_named_effect_below_what_would_be_named_is_too_small(
    made: Made, monkeypatch: pytest.MonkeyPatch, part: float, share: float, small: bool
) -> None:
    """But for one that is a plain part of the gap."""
    monkeypatch.setattr(Judged, "share_of", lambda judged, effect: share)
    found, selection = made.judged.found, made.judged.found.selection
    unknowns, least = found.layout.unknowns, friction_of(made, made.judged).value
    assert least is not None
    (friction,) = (one for one in hypotheses(made.problem.model) if one.name == "friction")
    p = selection.best.p.copy()
    p[friction.entries(unknowns)] = part * least
    named = Weighed(friction, 40.0, None)
    best = replace(selection.best, p=p, sd=friction.widened(unknowns, selection.best.sd))
    judged = replace(made.judged, found=found.with_selection(replace(selection, best=best)))
    # The record is that of the rig with the effect, so that nothing is left of it.
    simulator = _answering(made.problem, judged)
    lines = simulator.lines(p)
    assert judged.target is not None and lines is not None
    there = replace(judged, target=replace(judged.target, lines=lines))
    assert (too_small(made.problem, there, [named]) is named) == small
