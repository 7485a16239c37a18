"""Lengths in sentences: the unit in which they are short."""

from __future__ import annotations

import pytest

from gearbench.rig.lengths import length_words


@pytest.mark.parametrize(
    ("metres", "words"),
    [
        (0.0, "0 um"),
        (8.86e-5, "88.6 um"),
        (9.9999e-4, "1 mm"),
        (-2.5e-3, "-2.5 mm"),
        (0.5, "500 mm"),
        (13.89, "13.89 m"),
    ],
)
def test_a_length_is_read_in_its_own_unit(metres: float, words: str) -> None:
    assert length_words(metres) == words
