"""What explains the records as well as what enters: its rivals, and which of usual and rare is named."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from shared.fake_simulator import (
    FakeSimulator,
    chosen,
    target,
    unknowns,
)
from shared.selected_lines import CRACKS, FRICTION, LISTED, MATRIX, RIPPLE, names, selected

from gearbench.diagnosis.effects.effect import twins_of
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.selection import selection as module
from gearbench.diagnosis.selection.rivals import compared, is_like, rivals_of, shared_by, unentered, usual_of
from gearbench.diagnosis.selection.selection import evidence_without, taken_out
from gearbench.diagnosis.selection.weighing import LIMIT, Weighed


def test_what_explains_the_records_as_well_is_a_rival_and_leaves_with_the_one_that_is_named() -> None:
    """Two teeth whose cracks do the same: each alone explains it, and a good rig's share of the other is no reason to
    find that the background alone closes the gap."""
    alike = MATRIX.copy()
    alike[7] = alike[6]
    true = np.array([0.08, -0.1, 0.02, 0.0, 0.0, 0.0, 0.3, 0.0])
    simulator = FakeSimulator(lambda q: q @ alike, target(true @ alike))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None
    (one,) = found.entered
    assert {one.hypothesis.name, *(other.name for other in one.rivals)} == {"tooth-crack 0", "tooth-crack 1"}
    assert found.bare.p[6] == found.bare.p[7] == 0.0
    assert not any(other.rivals for other in selected({7: 0.3}).entered)
    # Of the two the usual one is named, whichever explains a little more.
    for number, other in (0, 1), (1, 0):
        rare = {number: (("crack",), 1.0)}
        listed = (FRICTION, RIPPLE, *(replace(CRACKS[one], usual=rare.get(one)) for one in range(2)))
        named = chosen(simulator, listed, [np.zeros(8)], {})
        assert named is not None and names(named) == [f"tooth-crack {other}"]


def test_a_rival_that_entered_too_stays_where_the_other_is_taken_out() -> None:
    """Two that were alike when the first entered, both of which the records call for: neither is in the other's
    place, as it would be if only one had entered."""
    true = np.array([0.08, -0.1, 0.02, 0.4, 0.3, -0.2, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true @ MATRIX))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None and sorted(names(found)) == ["friction", "torque-ripple"]
    both = {one.hypothesis.name: one for one in found.entered}
    friction = replace(both["friction"], rivals=(RIPPLE,))
    for entered, stays in ((friction, both["torque-ripple"]), True), ((friction,), False):
        selection = replace(found, entered=entered)
        rest = taken_out(simulator, selection, friction)
        assert rest.p[3] == 0.0 and (np.abs(rest.p[4:6]) > 0.1).all() == stays
        held = evidence_without(simulator.layout.unknowns, selection, friction, rest)
        sd = selection.best.sd.copy()
        sd[3:6] = (0.0, *sd[4:6]) if stays else 0.0
        assert held == rest.evidence_under(sd)
        assert unentered(friction, entered).causes == ((FRICTION,) if stays else (FRICTION, RIPPLE))


def test_a_usual_cause_that_did_not_enter_keeps_a_good_rigs_share() -> None:
    """Told as a rival it is no part of what a rare one closes."""
    true = np.array([0.08, -0.1, 0.02, 0.4, 0.3, -0.2, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true @ MATRIX))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None
    friction = next(one for one in found.entered if one.hypothesis is FRICTION)
    rare = replace(friction, hypothesis=replace(FRICTION, usual=(("ripple",), -0.5)), rivals=(RIPPLE,))
    assert rare.in_its_place == (rare.hypothesis,) and len(rare.causes) == 2
    rest = taken_out(simulator, replace(found, entered=(rare,)), rare)
    assert rest.p[3] == 0.0 and (np.abs(rest.p[4:6]) > 0.1).all()


def test_no_other_effect_beyond_a_good_rigs_takes_the_place_of_what_is_left_out() -> None:
    """Ripple that does almost what friction does: twelve of its deviations would explain most of the friction."""
    alike = MATRIX.copy()
    alike[4] = alike[3] + 0.05 * alike[4]
    true = np.array([0.08, -0.1, 0.02, 0.12, 0.0, 0.0, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ alike, target(true @ alike))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None and names(found) == ["friction"]
    assert found.bare.p[3] == 0.0 and abs(found.bare.p[4]) <= max(4.0 * 0.01, abs(found.base.p[4]))
    assert found.bare.misfit > found.best.misfit + 400.0


def test_of_gears_with_as_many_teeth_the_other_is_a_rival_unless_far_behind() -> None:
    optimum = selected({3: 0.4}).best
    winner = Weighed(replace(FRICTION, on=("driver",)), 100.0, optimum)
    for nats, twins, rivals in (80.0, ("friction",), 1), (70.0, ("friction",), 0), (80.0, (), 0), (98.0, (), 1):
        other = Weighed(replace(RIPPLE, on=("driven",), twins=twins), nats, optimum)
        assert len(rivals_of(winner, [winner, other])) == rivals
    assert twins_of({"driver": "one", "driven": "two"}, "driver", (30, 30)) == ("two",)
    assert twins_of({"driver": "one", "driven": "two"}, "driver", (30, 31)) == ()


def test_a_rare_effect_gives_way_to_a_usual_one_that_explains_nearly_as_much() -> None:
    optimum = selected({3: 0.4}).best
    rare = Weighed(replace(FRICTION, usual=(("ripple",), -0.5)), 100.0, optimum)
    assert usual_of((rare, Weighed(RIPPLE, 80.0, None))) is rare
    for nats, named in (80.0, "torque-ripple"), (70.0, "friction"):
        found = usual_of((rare, Weighed(CRACKS[0], 99.0, optimum), Weighed(RIPPLE, nats, optimum)))
        assert found is not None and found.hypothesis.name == named
    assert usual_of(()) is None
    # Beside the usual one the rare one is not weighed again.
    assert is_like(rare.hypothesis, RIPPLE) and not is_like(RIPPLE, rare.hypothesis) and is_like(RIPPLE, RIPPLE)
    assert not is_like(rare.hypothesis, CRACKS[0])


def test_what_both_explain_already_counts_for_the_usual_one() -> None:
    """Ten nats tell a rare one that explains 15 more from its counterpart, but not where both have explained 200."""
    optimum = selected({3: 0.4}).best
    rare = Weighed(replace(FRICTION, on=("driver",), usual=(("ripple",), -0.5)), 15.0, optimum)
    usual = Weighed(replace(RIPPLE, on=("driven",)), 5.0, optimum)
    for shared, named, rivals in (0.0, rare, 0), (150.0, rare, 0), (200.0, usual, 1):
        assert usual_of((rare, usual), shared) is named
        # Where the usual one has too little evidence to enter by itself it is still told.
        assert len(rivals_of(rare, (rare, usual), shared)) == rivals
        assert len(rivals_of(usual, (rare, usual), shared)) == 1
    assert not rivals_of(rare, (rare, Weighed(CRACKS[0], 5.0, optimum)), 200.0)


def test_what_both_explain_already_is_what_a_rig_without_either_lacks() -> None:
    true = np.array([0.08, -0.1, 0.02, 0.015, 0.01, -0.012, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true @ MATRIX))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None and not found.entered
    rare = Weighed(replace(FRICTION, usual=(("ripple",), -0.5)), 1.0, found.base)
    usual = Weighed(RIPPLE, 0.5, found.base)
    sd = found.base.sd.copy()
    sd[3:6] = 0.0
    without = fit_afresh(simulator, np.zeros(8), sd, renewals=2)
    assert without is not None and not without.p[3:6].any()
    lacking = found.base.evidence - without.evidence
    assert lacking > 10.0
    assert shared_by(simulator.layout.unknowns, found.base, [rare, usual]) == pytest.approx(lacking, rel=0.05)
    # What a fit still promises is shared by neither.
    p = found.base.p.copy()
    p[0] -= 0.01
    moved = simulator.target.lines - simulator.lines(p)
    near = found.base.sensitivity.quadratic.moved(moved)
    behind = replace(found.base, p=p, sensitivity=replace(found.base.sensitivity, quadratic=near),
                     evidence=found.base.evidence - 50.0)  # fmt: skip
    assert shared_by(simulator.layout.unknowns, behind, [rare, usual]) == pytest.approx(lacking, rel=0.05)
    assert shared_by(simulator.layout.unknowns, found.base, [usual, rare]) == 0.0  # no rare one is ahead


def test_the_usual_one_is_fitted_from_where_the_rare_one_got() -> None:
    """A second tooth whose crack does half of what the first one's does; its own fit had stopped short."""
    alike = MATRIX.copy()
    alike[7] = 0.5 * alike[6]
    simulator = FakeSimulator(lambda q: q @ alike, target(0.2 * alike[6] + 0.08 * alike[0]))
    simulator.jacobian = lambda p, sd, chosen, near=None: alike  # type: ignore[method-assign, assignment]
    found = chosen(simulator, (CRACKS[0],), [np.zeros(8)], {})
    assert found is not None and names(found) == ["tooth-crack 0"]
    first = Weighed(replace(CRACKS[0], usual=(("crack",), 2.0)), 1e6, found.best)
    one, other = compared(simulator, found.base, [first, Weighed(CRACKS[1], 2.0, None)])
    assert one.optimum is found.best and other.hypothesis.name == "tooth-crack 1"
    assert other.optimum is not None and other.optimum.p[6] == pytest.approx(0.0, abs=0.02)
    assert other.optimum.p[7] == pytest.approx(0.4, abs=0.05) and other.log_bayes_factor > LIMIT
    # And a rare one from where the usual one got that is ahead; nothing is handed over to what is no counterpart.
    usual = replace(first, hypothesis=CRACKS[0])
    rare = Weighed(replace(CRACKS[1], usual=(("crack",), 0.5)), 2.0, None)
    turned = compared(simulator, found.base, [usual, rare])[1]
    assert turned.optimum is not None and turned.optimum.p[6:] == pytest.approx([0.0, 0.4], abs=0.05)
    plain = [usual, Weighed(CRACKS[1], 2.0, None)]
    assert compared(simulator, found.base, plain) == plain


def test_a_fit_that_stopped_while_it_promised_to_overtake_is_gone_on_with() -> None:
    found = selected({6: 0.3})
    true = found.weighed[0]
    assert true.hypothesis.name == "tooth-crack 0" and true.optimum is not None
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true.optimum.lines))

    def among(promised: float) -> Weighed:
        stopped = replace(found.base, sd=true.optimum.sd, left=found.base.left + promised)  # type: ignore[union-attr]
        ahead = Weighed(FRICTION, 60.0, None)
        return next(
            one
            for one in compared(simulator, found.base, [ahead, Weighed(true.hypothesis, 1.0, stopped)])
            if one.hypothesis == true.hypothesis
        )

    over = among(100.0)
    assert over.optimum is not None and over.optimum.p[6] == pytest.approx(0.3, abs=0.05)
    assert over.log_bayes_factor > 60.0
    # What would not reach the one ahead, or promises little, stays where it is.
    assert among(50.0).log_bayes_factor == 1.0
    assert among(60.0).log_bayes_factor > 1.0


def test_what_was_refused_has_not_the_place_of_its_rare_counterpart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 1)
    found = selected({3: 0.4})
    rare = Weighed(replace(CRACKS[0], usual=(("friction",), 1.0)), 30.0, found.best)
    listed = replace(found, weighed=(*found.entered, rare))
    tried: list[str] = []

    def forward(simulator: object, best: Optimum, beside: object, hypotheses: Any, *_: Any, **__: Any) -> Any:
        tried.extend(one.name for one in hypotheses)
        return best, list(cast(Any, beside)), []

    monkeypatch.setattr(module, "_forward", forward)
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(0.4 * MATRIX[3]))
    bare = module.only(simulator, listed, [])  # type: ignore[arg-type]
    assert module.further(simulator, bare, found.entered) is None and tried == ["tooth-crack 0"]  # type: ignore[arg-type]
    # Beside the usual one that entered it has nothing to add.
    tried.clear()
    assert module.further(simulator, listed, (Weighed(RIPPLE, 9.0, found.best),)) is None and not tried  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("usual", "rare", "apart", "name"),
    [(7.7, 10.0, False, "friction"), (3.9, 6.6, True, "friction"), (8.1, 10.0, False, "torque-ripple"),
     (7.0, 7.7, False, None)],
)  # fmt: skip
def test_where_a_usual_cause_lacks_evidence_its_rare_counterpart_enters(
    monkeypatch: pytest.MonkeyPatch, usual: float, rare: float, apart: bool, name: str | None
) -> None:
    """Each alone has what the other has not: not to enter at all would lose both."""
    optimum = selected({3: 0.4}).best
    weighed = [Weighed(replace(FRICTION, usual=(("ripple",), -0.5)), rare, optimum), Weighed(RIPPLE, usual, optimum)]
    entered = module._entering_first(unknowns(), weighed, apart)
    assert (entered.hypothesis.name if entered else None) == name
    assert module._entering_first(unknowns(), [], apart) is None
