"""How far sidebands beyond the record are trusted: as far as those between excited band and last line are explained."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.identification.feedback.result import doubt_beyond


def found(excited: int, left: float) -> Any:
    """Lines 1..8 of one class, all of size 1, of which the model leaves `left` above line 5 and all below."""
    lines = np.arange(1, 9)[None]
    dte = np.ones((1, 8, 2), dtype=complex)
    dte[:, :, 1] = 0.0  # the record that holds the operating response has no such lines
    rest = np.where(lines[:, :, None] > 5, left, 1.0) * dte
    data = SimpleNamespace(valid=lines > 0, lines=lines, excited=excited, dte=dte)
    return SimpleNamespace(data=data, refined=SimpleNamespace(left=rest))


def test_what_is_left_of_the_sidebands_that_are_measured_is_the_doubt() -> None:
    assert doubt_beyond(found(5, 0.1)) == pytest.approx(0.01)
    assert doubt_beyond(found(5, 3.0)) == 1.0
    assert doubt_beyond(found(3, 0.0)) == pytest.approx(2 / 5)


def test_without_lines_above_the_excited_band_nothing_is_trusted() -> None:
    assert doubt_beyond(found(8, 0.0)) == 1.0
