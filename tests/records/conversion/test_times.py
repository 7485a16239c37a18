"""Columns of times with few digits: uniform within them, or said to be uneven, with the place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.records import RecordError
from gearbench.records.conversion.clock import clock_of_times
from tests.records.conversion.test_convert import RATE, TIME, convert, error, whole

Times = NDArray[np.float64]


def printed(time: Times, digits: int) -> Times:
    """Times as text of so many significant digits has them."""
    return np.array([float(f"{value:.{digits}g}") for value in time])


FEW: dict[str, Callable[[Times], Times]] = {
    "single precision": lambda t: t.astype(np.float32).astype(float),
    "single precision, late": lambda t: (t + 200.0).astype(np.float32).astype(float),
    "single precision, ms": lambda t: 1e-3 * (1e3 * t + 2e4).astype(np.float32).astype(float),
    "seven digits": lambda t: printed(t + 20.0, 7),
    "five digits": lambda t: printed(t, 5),
    "epoch": lambda t: t + 1.764e9,
    "epoch in us": lambda t: np.round(t + 1.764e9, 6),
}


@pytest.mark.parametrize("name", FEW)
def test_times_are_uniform_within_their_digits(tmp_path: Path, name: str) -> None:
    """Times that are no multiple of a decimal, so that each departs."""
    t = TIME * 8000 / 8192
    clock = clock_of_times(FEW[name](t), "t", [])
    assert clock.time is None and clock.rate == pytest.approx(8192.0, rel=1e-6)
    record = convert(tmp_path, whole(t=FEW[name](TIME)))
    assert record.attrs["sampling_rate"] == RATE and record.attrs["periods"] == 2
    assert error(record, "y_driver", float(TIME[0])) < 1e-9


@pytest.mark.parametrize("name", FEW)
def test_a_missing_sample_is_seen_beside_few_digits(name: str) -> None:
    assert clock_of_times(FEW[name](np.delete(TIME, 4000)), "t", []).time is not None


def test_one_uneven_column_of_times_is_no_difference_of_clocks(tmp_path: Path) -> None:
    uneven = TIME.copy()
    uneven[3000] += 0.3 / RATE
    with pytest.raises(RecordError, match=r"the times are not uniform: sample 3000 departs by 3.75e-05 s, 0.3 samples"):
        convert(tmp_path, whole(t=uneven))
