"""Effects at work beside the smallest that would have been named, by hand."""

from __future__ import annotations

from typing import Any

import pytest
from shared.fake_verdicts import verdict

from gearbench.challenge.answers import Answer
from gearbench.challenge.scoring.outcomes import Outcome, judge
from gearbench.challenge.scoring.score import score
from gearbench.challenge.scoring.smallest import beside, smallest_table
from gearbench.challenge.scoring.text import score_text


def told(name: str, **parameters: tuple[float | None, float, float, str]) -> dict[str, Any]:
    """Of a parameter: the smallest, the standard deviation, a good rig's, the unit."""
    keys = ("value", "std", "good", "unit")
    return {
        "name": name,
        "place": "mesh",
        "on": [],
        "parameters": {one: dict(zip(keys, given, strict=True)) for one, given in parameters.items()},
    }


def friction(true: float, smallest: float | None, std: float = 0.001, *named: str) -> Outcome:
    answer = Answer("effect", ("friction",), "mesh", {"friction": {"coefficient": {"value": true, "unit": "1"}}})
    given = verdict("effect" if named else "none", *named)
    return judge("case", answer, {**given, "detectable": [told("friction", coefficient=(smallest, std, 0.004, "1"))]})


@pytest.mark.parametrize(
    ("true", "smallest", "std", "large", "hidden"),
    [
        (0.02, 0.01, 0.001, True, False),
        (0.02, 0.03, 0.001, False, False),
        (0.02, None, 0.001, False, False),
        (0.002, 0.03, 0.001, False, True),
    ],
)
def test_a_missed_effect_is_held_against_the_smallest(
    true: float, smallest: float | None, std: float, large: bool, hidden: bool
) -> None:
    table = smallest_table([friction(true, smallest, std)])
    (row,) = table["missed"]
    assert (row["large"], row["hidden"]) == (large, hidden) and row["due"]
    assert (table["told"], table["small"], table["hidden"], table["named"]) == (1, int(not large), int(hidden), 0)


@pytest.mark.parametrize(("resonance", "large"), [(900.0, True), (2000.0, False)])
def test_the_softer_the_coupling_the_more_of_it(resonance: float, large: bool) -> None:
    """A good rig's is the stiffest: what is further away from it is more, be its number less."""
    answer = Answer("effect", ("coupling",), "drive", {"coupling": {"resonance": {"value": resonance, "unit": "Hz"}}})
    limits = told("coupling", stiffness=(9e4, 60.0, 4e5, "N m/rad"), resonance=(1500.0, 5.0, 3200.0, "Hz"))
    found = beside(judge("case", answer, {**verdict("none"), "detectable": [limits]}), "coupling")
    assert found is not None and found.parameter == "resonance" and found.large == large


def test_of_several_ways_to_name_it_the_easiest_counts() -> None:
    answer = Answer("effect", ("pitch-error",), "mesh", {"pitch-error": {"driver.rms": {"value": 0.5, "unit": "um"}}})
    ways = [told("pitch-error", **{"driver.rms": (limit, 0.1, 0.2, "um")}) for limit in (0.6, 0.4, None)]
    found = beside(judge("case", answer, {**verdict("none"), "detectable": ways}), "pitch-error")
    assert found is not None and found.smallest == 0.4


def test_what_verdicts_do_not_tell_counts_nowhere() -> None:
    answer = Answer("effect", ("friction",), "mesh", {"friction": {"coefficient": {"value": 0.05, "unit": "1"}}})
    limits = told("friction", coefficient=(0.01, 0.001, 0.004, "um"))
    for given in (verdict("none"), {**verdict("none"), "detectable": [limits]}):
        table = smallest_table([judge("case", answer, given), judge("none", Answer("none"), verdict("none"))])
        assert len(table["missed"]) == 1 and table["missed"][0]["parameter"] is None
        assert table["told"] == table["small"] == 0


def test_text_puts_what_was_missed_beside_its_limit() -> None:
    outcomes = [friction(0.02, 0.03), friction(0.05, 0.03, 0.001, "friction"), friction(0.02, 0.03, 0.001, "friction")]
    text = score_text(score(outcomes))
    assert "friction: coefficient 0.02 1, named from 0.03; good rig 0.004, standard deviation at least 0.001" in text
    assert "of 1 missed 1 are smaller, 0 no larger" in text and "of 2 named 1 are smaller" in text
