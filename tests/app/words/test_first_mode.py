"""The first mode in the headline: told where the record can tell it."""

from __future__ import annotations

from typing import Any

import pytest

from gearbench.words.summary import first_mode

SURE: dict[str, Any] = {
    "first_mode_hz": [1236.0, 1355.0],
    "first_mode_fewest_pairs_hz": 1243.0,
    "first_mode_most_pairs_hz": 1344.0,
}


@pytest.mark.parametrize(("expected", "told"), [(0.02, True), (0.9, True), (1.0, False), (2.14, False)])
def test_a_record_that_says_nothing_names_no_mode(expected: float, told: bool) -> None:
    words = first_mode({**SURE, "identification": {"expected_error": expected}})
    assert ("1236-1355 Hz" in words) == told
    assert ("more realisations" in words) != told


def test_a_band_without_the_mode_tells_where_the_model_has_it() -> None:
    nothing = {"first_mode_hz": [float("nan")] * 2}
    assert first_mode(nothing) == "none in the identified band"
    assert "the linearised model has it at 5684-7109 Hz" in first_mode(
        nothing | {"first_mode_linearised_hz": (5684.0, 7109.0)}
    )
