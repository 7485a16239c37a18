"""Which effects are due, by verdicts made by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from shared.fake_verdicts import verdict

from gearbench.challenge.answers import Answer
from gearbench.challenge.scoring.due import found_of_due, kind_shown, owed, right_verdict, true_of_named
from gearbench.challenge.scoring.intervals import Rate
from gearbench.challenge.scoring.outcomes import Outcome, judge
from gearbench.challenge.scoring.score import score
from gearbench.challenge.scoring.text import score_text

TWO = Answer("effect", ("friction", "coupling"), "mesh", {"friction": {}, "coupling": {}})
FRICTION = Answer("effect", ("friction",), "mesh", {"friction": {}})


def judged(answer: Answer, named: tuple[str, ...], gaps: dict[tuple[str, ...], float | None]) -> Outcome:
    given: dict[str, Any] = verdict("effect", *named) if named else verdict("none")
    given["candidates"] = [
        {"effects": list(effects), "log_evidence": 0.0, "held_out": gap} for effects, gap in gaps.items()
    ]
    return judge("x", answer, given)


@pytest.mark.parametrize(
    ("gap_without", "gap_with", "due"),
    [(0.221, 0.2, True), (0.219, 0.2, False), (0.2, None, True), (None, 0.2, True)],
)
def test_one_effect_is_due_from_a_tenth_on(gap_without: float | None, gap_with: float | None, due: bool) -> None:
    outcome = judged(FRICTION, (), {(): gap_without, ("friction",): gap_with})
    assert owed(outcome) == (("friction",) if due else ())


@pytest.mark.parametrize(("trace", "due"), [(0.45, False), (0.47, True)])
def test_what_the_truth_hardly_shows_is_not_due_whatever_was_simulated(trace: float, due: bool) -> None:
    outcome = judged(replace(FRICTION, traces={"friction": trace}), (), {})
    assert owed(outcome) == (("friction",) if due else ())


@pytest.mark.parametrize(("effect", "left", "due"), [
    ("friction", 0.109, False), ("friction", 0.111, True), ("temperature-drift", 0.109, True),
])  # fmt: skip
def test_what_a_rig_without_it_leaves_at_the_noise_is_not_due(effect: str, left: float, due: bool) -> None:
    answer = Answer("effect", (effect, "coupling"), "mesh", {})
    gap = {"channel": "dte", "recalibrated": [3.0] * 3, "with_effect": [left] * 3, "floor": [0.1] * 3}
    outcome = judge("x", answer, verdict("effect", "coupling") | {"gap": [gap]})
    assert owed(outcome) == (("coupling", effect) if due else ("coupling",))
    alone = judge("x", answer, verdict("none") | {"gap": [gap | {"recalibrated": [left] * 3, "with_effect": None}]})
    assert (effect in owed(alone)) == due


def test_the_place_of_a_foreign_effect_that_does_not_show_is_not_asked_for() -> None:
    answers = [Answer("foreign", ("temperature-drift",), "mesh", {}, traces={"temperature-drift": size})
               for size in (0.1, 9.0)]  # fmt: skip
    table = score([judge("x", one, verdict("unknown") | {"place": "mesh"}) for one in answers])
    assert table["foreign"]["refused_at_right_place"]["total"] == 1


@pytest.mark.parametrize(("name", "left", "due"), [
    ("torque-filter", 0.109, False), ("torque-filter", 0.111, True), ("non-synchronous-torque", 0.109, True),
])  # fmt: skip
def test_the_place_of_a_foreign_effect_that_recalibration_takes_up_is_not_asked_for(
    name: str, left: float, due: bool
) -> None:
    answer = Answer("foreign", (name,), "drive", {}, traces={name: 9.0})
    gap = {"channel": "dte", "recalibrated": [left] * 3, "with_effect": None, "floor": [0.1] * 3}
    one = judge("x", answer, verdict("none") | {"gap": [gap]})
    assert score([one])["foreign"]["refused_at_right_place"]["total"] == due
    assert right_verdict(one) == ("unknown" if due else "none")


@pytest.mark.parametrize(
    ("kind", "trace", "shown"),
    [("foreign", 0.4, "none"), ("foreign", 4.0, "foreign"), ("effect", 0.4, "effect"), ("none", 0.0, "none")],
)
def test_a_foreign_effect_below_the_noise_teaches_as_a_sound_rig(kind: Any, trace: float, shown: str) -> None:
    names = () if kind == "none" else ("slipping-coupling",)
    assert kind_shown(Answer(kind, names, "drive", {}, traces=dict.fromkeys(names, trace))) == shown


def test_of_two_effects_each_is_held_against_the_other_alone() -> None:
    gaps = {(): 1.0, ("friction",): 0.9, ("coupling",): 0.205, ("coupling", "friction"): 0.2}
    outcome = judged(TWO, ("coupling",), gaps)
    # Without the coupling the gap grows from 0.2 to 0.9, without the friction by 2.5 %.
    assert owed(outcome) == ("coupling",)
    assert found_of_due([outcome]).plain()["count"] == found_of_due([outcome]).plain()["total"] == 1


def test_nothing_is_due_of_foreign_cases_and_nothing_named_there_is_true() -> None:
    foreign = judged(Answer("foreign", ("temperature-drift",), "mesh", {}), ("friction",), {})
    right = judged(FRICTION, ("friction", "coupling"), {})
    assert owed(foreign) == ()
    assert (true_of_named([foreign, right]).count, true_of_named([foreign, right]).total) == (1, 3)
    assert found_of_due([foreign, right]).total == 1


def test_a_failed_case_owes_its_effect() -> None:
    assert owed(judge("x", FRICTION, None)) == ("friction",)


def test_of_several_effects_each_that_is_named_counts() -> None:
    three = Answer("effect", ("friction", "coupling", "backlash"), "mesh", {"friction": {}})
    some = judged(three, ("coupling", "friction"), {})
    more = judged(TWO, ("friction", "backlash"), {})
    table = score([some, more, judged(FRICTION, ("friction",), {})])
    assert some.result == "part" and more.result == "wrong"
    assert table["several"]["cases"] == 2
    assert (table["several"]["found"]["count"], table["several"]["found"]["total"]) == (3, 5)
    assert (table["several"]["true"]["count"], table["several"]["true"]["total"]) == (3, 4)
    assert list(table["by_effect"]) == ["friction", "2 effects", "3 effects"]
    assert "Of 2 cases with several effects" in score_text(table)


def test_the_place_of_any_of_the_effects_is_right() -> None:
    answer = replace(TWO, places=("mesh", "drive"))
    for place, right in (("mesh", True), ("drive", True), ("load", False)):
        given = verdict("effect", "coupling") | {"place": place}
        assert judge("x", answer, given).place_right is right
        assert judge("x", TWO, given).place_right is (place == "mesh")


def test_a_foreign_effect_that_the_library_has_after_all_is_named_rightly() -> None:
    drift = Answer("foreign", ("temperature-drift",), "mesh", {})
    names = (*drift.effects, "friction")
    known, blamed = (judge("x", drift, verdict("effect", name) | {"place": "mesh"}) for name in names)
    table = score([known, blamed])
    assert (known.result, blamed.result) == ("right", "blamed")
    assert (table["due"]["true"]["count"], table["due"]["true"]["total"]) == (1, 2)
    assert (table["foreign"]["refused_at_right_place"]["count"], table["foreign"]["blamed"]["count"]) == (1, 1)
    assert [right_verdict(known), right_verdict(blamed)] == ["effect", "unknown"]
    assert table["calibration"]["effect"][0]["count"] == 1
    assert "    right                  1 of 2" in score_text(table)


@pytest.mark.parametrize(
    ("kind", "trace", "said", "right"),
    [
        ("effect", 0.1, "none", "none"),
        ("effect", 0.1, "unknown", "none"),
        ("effect", 0.1, "friction", "effect"),
        ("effect", 9.0, "none", "effect"),
        ("foreign", 0.1, "none", "none"),
        ("foreign", 0.1, "backlash", "none"),
        ("foreign", 9.0, "none", "unknown"),
        ("none", 0.0, "unknown", "none"),
    ],
)
def test_none_is_the_right_verdict_of_what_nobody_owes(kind: Any, trace: float, said: str, right: str) -> None:
    names = () if kind == "none" else ("friction" if kind == "effect" else "torque-filter",)
    answer = Answer(kind, names, "mesh", {}, traces=dict.fromkeys(names, trace))
    given = verdict(said) if said in ("none", "unknown") else verdict("effect", said)
    assert right_verdict(judge("x", answer, given | {"candidates": []})) == right


def test_a_name_stands_for_what_the_verdict_cannot_tell_from_it() -> None:
    """Of two effects one is named, and one of the class of the other: both are told. What is at work itself stands for
    nothing else, nor does a class without an effect that is missed."""
    given = verdict("effect", "friction", "pitch-error") | {"indistinguishable": [["coupling", "pitch-error"]]}
    both = judge("x", TWO, given)
    assert both.told("pitch-error") and both.found("coupling")
    assert found_of_due([both]) == Rate(2, 2) and true_of_named([both]) == Rate(2, 2)
    alone = judge("x", TWO, verdict("effect", "friction") | {"indistinguishable": [["coupling", "friction"]]})
    assert not alone.found("coupling")
    blamed = judge("x", FRICTION, given)
    assert not blamed.told("pitch-error") and true_of_named([blamed]) == Rate(1, 2)
