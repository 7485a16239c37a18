"""Records whose flanks part, beside smooth ones: of the demonstration, whose light record rattles."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from shared.simulated_lines import quicker

from gearbench.bench import simulate
from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.diagnosis.effects.library import hypotheses
from gearbench.diagnosis.evidence.problem import Problem, problem_of
from gearbench.diagnosis.fitting.fit import fit_afresh
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.judging.held_against import judged_on
from gearbench.diagnosis.judging.only_there import with_backlash_there
from gearbench.diagnosis.replay.replays import Replays
from gearbench.diagnosis.selection import parting as module
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.followable import nudges_of
from gearbench.diagnosis.selection.opened import Opened, opened
from gearbench.diagnosis.selection.parting import EXPLAINED, FOLLOWED, NEAR, off, with_parting
from gearbench.diagnosis.selection.selection import Selection
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.structure.layout import layout_of


class Searched(NamedTuple):
    """A smooth record and the rough one beside it, of a rig with the unknowns `true`, and what the smooth one says."""

    problem: Problem
    simulator: Simulator
    selection: Selection
    rough: Measurement
    alone: Simulator
    true: np.ndarray


@cache
def searched(more: float, faster: int) -> Searched:
    """With so much backlash [m] beyond the nominal one, and a mesh that is off."""
    nominal = quicker(faster, 2)
    records = [measurement(simulate(nominal.under(one)), one.name, nominal) for one in nominal.conditions]
    planned = problem_of(records, nominal)
    model, layout = planned.model, layout_of(nominal, planned.model, planned.conditions, ())
    keys, true = layout.unknowns, np.zeros(layout.size)
    true[keys[BACKLASH]], true[keys["scale"]], true[keys["mesh-ratio"]] = more, 0.06, 0.2
    rig = layout.case(true).rig
    records = [
        measurement(simulate(nominal.under(one).model_copy(update={"rig": rig})), one.name, nominal)
        for one in nominal.conditions
    ]
    problem = problem_of(records, nominal)
    smooth = Simulator(layout, target_of(records[:1], problem.conditions[:1]), Replays(model.law))
    found = fit_afresh(smooth, np.zeros(layout.size), keys.prior(), renewals=1)
    assert found is not None
    rough = target_of(records[1:], problem.conditions[1:])
    alone = Simulator(layout, rough, smooth.simulate, nudges_of(model, problem.conditions[1:]))
    return Searched(problem, smooth, Selection(found, found, found, (), ()), records[1], alone, true)


def test_a_record_whose_flanks_part_is_taken_in_with_a_good_rigs_share_of_backlash(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of = searched(-25e-6, 6)
    keys, smooth, alone = of.simulator.layout.unknowns, of.selection.best.p, of.alone
    assert off(alone, smooth) > NEAR and smooth[keys[BACKLASH]] == 0.0
    listed = hypotheses(of.problem.model, ())
    # With as much backlash the smooth record's rig explains it, too.
    simulator, found = with_parting(of.simulator, of.alone, of.selection, listed, {}, wanted=True)
    assert simulator is of.simulator and off(alone.free, found.best.p) < EXPLAINED and not found.entered
    assert found.base is found.best and found.best.p[keys[BACKLASH]] == pytest.approx(-25e-6, abs=0.5e-6)
    monkeypatch.setattr(module, "EXPLAINED", 0.0)
    whole, found = with_parting(of.simulator, of.alone, of.selection, listed, {}, wanted=True)
    assert [one.name for one in whole.target.measurements] == ["base", "light"]
    assert whole.nudges == alone.nudges and whole.anchored and whole.held_by == of.simulator.target.measurements
    parts = [(one.target, one.target.energies(one.target.lines)) for one in (of.simulator, alone)]
    together = whole.target.energies(whole.target.lines)
    assert together == pytest.approx(np.concatenate([energies for _, energies in parts]))
    for number, (target, energies) in enumerate(parts):
        one = whole.target.of_record(number)
        assert one.energies(one.lines) == pytest.approx(energies) and one.blocks == target.blocks
    # Less than four of a good rig's standard deviations are no effect; the mean of repetitions is the noise.
    assert not found.entered and found.best.p[keys[BACKLASH]] == pytest.approx(-25e-6, abs=0.5e-6)
    assert off(alone, found.best.p) < min(FOLLOWED, 2.0 * off(alone, of.true))
    assert found.best.p[keys["scale"]] == pytest.approx(0.06, abs=0.02)
    assert found.best.p[keys["mesh-ratio"]] == pytest.approx(0.2, abs=0.03)


def test_one_that_stays_far_or_that_nothing_needs_is_not_taken_in(monkeypatch: pytest.MonkeyPatch) -> None:
    of = searched(0.0, 6)
    listed = hypotheses(of.problem.model, ())
    for wanted in (False, True):
        monkeypatch.setattr(module, "NEAR", 1e-6 if wanted else NEAR)
        simulator, found = with_parting(of.simulator, of.alone, of.selection, listed, {}, wanted=wanted)
        assert simulator is of.simulator and found.best is of.selection.best and not found.entered


def test_backlash_that_a_rough_record_shows_is_named_where_it_is_followed_with_it() -> None:
    of = searched(-45e-6, 6)
    simulator, found = with_parting(
        of.simulator, of.alone, of.selection, hypotheses(of.problem.model, ()), {}, wanted=False
    )
    (one,) = found.entered
    assert simulator is of.simulator and one.hypothesis.name == "backlash" and found.base is of.selection.base
    assert found.best.p[simulator.layout.unknowns[BACKLASH]] == pytest.approx(-45e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("forces", "evidence", "std", "named"),
    [(-40e-6, 9.0, 1e-6, True), (-20e-6, 9.0, 1e-6, False), (-20e-6, 9.0, 30e-6, True), (-45e-6, 0.0, 30e-6, False)],
)
def test_where_nothing_follows_a_rough_record_the_force_residuals_must_have_as_much(
    monkeypatch: pytest.MonkeyPatch, forces: float, evidence: float, std: float, named: bool
) -> None:
    def known_to(std: float, found: Opened | None) -> Opened | None:
        return found and found._replace(std=std)

    monkeypatch.setattr(module, "opened", lambda alone, p: known_to(std, opened(alone, p)))
    of = searched(-45e-6, 6)
    listed = hypotheses(of.problem.model, ())
    (backlash,) = (one for one in listed if one.name == "backlash")
    p = np.zeros(of.simulator.layout.size)
    p[of.simulator.layout.unknowns[BACKLASH]] = forces
    blind = Simulator(of.simulator.layout, of.alone.target, of.simulator.simulate)  # no angle of the driver
    starts = {"backlash": Start(backlash, p, evidence)}
    _, found = with_parting(of.simulator, blind, of.selection, listed, starts, wanted=True)
    assert [one.hypothesis.name for one in found.entered] == ["backlash"] * named


def test_backlash_that_the_judged_record_alone_shows_is_found_there() -> None:
    of = searched(-45e-6, 6)
    keys = of.simulator.layout.unknowns
    before = Simulated(of.simulator.layout, of.simulator, of.selection)
    found = with_backlash_there(of.problem, before, of.rough)
    (one,) = found.selection.entered
    assert one.hypothesis.name == "backlash" and one.only_in == "light"
    at = keys[BACKLASH].start
    assert found.selection.best.p[at] == pytest.approx(-45e-6, abs=1e-6) and 0.0 < found.std[at] < 3e-6
    assert found.selection.bare.p[at] == 0.0
    # The records of the search are explained as before.
    assert np.array_equal(of.simulator.lines(found.selection.best.p), of.simulator.lines(of.selection.best.p))
    judged = judged_on(of.problem, found, of.rough)
    assert judged is not None and judged.closings["backlash"].due and judged.closings["backlash"].growth > 3.0
    sound = searched(0.0, 6)
    before = Simulated(sound.simulator.layout, sound.simulator, sound.selection)
    assert with_backlash_there(sound.problem, before, sound.rough) is before
