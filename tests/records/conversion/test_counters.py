"""Counters that start again are counted on where their range is known, and refused by name where it is not."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.records import RecordError
from gearbench.records.conversion.counters import counted_on
from tests.records.conversion.test_convert import TIME, convert, signals, whole

LINES = 36000


def counts(per_turn: int = 4 * LINES, offset: float = 0.0) -> NDArray[np.float64]:
    """Counts (1, n) of a shaft at 12 turns a second that vibrates."""
    turns = 12 * TIME + 0.01 * np.sin(2 * pi * 30 * TIME)
    return np.floor(turns * per_turn + offset)[np.newaxis]


@pytest.mark.parametrize("size", [2**16, 2**32, LINES, 2 * LINES, 4 * LINES])
@pytest.mark.parametrize("lowest", [0, 0.5])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_known_range_is_added(size: int, lowest: float, direction: int) -> None:
    true, notes = direction * counts(offset=1000.0), list[str]()
    raw = np.mod(true - 5000 * direction, size) - lowest * size
    found = counted_on(raw, LINES, "channel a", notes)
    np.testing.assert_array_equal(found - found[0, 0], true - true[0, 0])
    assert len(notes) == 1 and notes[0].endswith(f"its range of {size} counts is added")


@pytest.mark.parametrize("size", [10000, 2**20, 2 * LINES + 200])
def test_another_range_is_refused_with_what_to_do(size: int) -> None:
    with pytest.raises(RecordError, match=r"channel a jumps by -\S+ counts after sample \d+ .* add its range"):
        counted_on(np.mod(counts(), size), LINES, "channel a", [])


def test_counts_that_do_not_start_again_are_left(tmp_path: Path) -> None:
    for true in (counts(), counts(60), counts(4), np.repeat(counts(60), 3, axis=0), np.zeros((1, 50))):
        notes: list[str] = []
        np.testing.assert_array_equal(counted_on(true, 60.0, "channel a", notes), true)
        assert not notes
    rising = np.floor(1e5 * TIME**2)[np.newaxis]
    np.testing.assert_array_equal(counted_on(rising, 1024.0, "channel a", []), rising)


@pytest.mark.parametrize("changed", [{"gain": 2.0}, {"offset": 0.1}])
def test_gain_and_offset_of_pulse_times_are_refused(tmp_path: Path, changed: dict[str, float]) -> None:
    times = (np.arange(400) - 3) / 400
    spec = {"unit": "pulse times s", "pulses_per_revolution": 200.0}
    with pytest.raises(RecordError, match=rf"{next(iter(changed))} = \S+ means nothing for pulse times"):
        convert(tmp_path, whole(angle_driver=times), angle_driver=spec | changed)


def test_a_record_of_a_counter_that_starts_again(tmp_path: Path) -> None:
    angle = signals(TIME)["angle_driver"]
    raw = np.mod(np.floor(angle / (2 * pi) * 4 * LINES), 2**16)
    spec = {"unit": "quadrature counts", "pulses_per_revolution": float(LINES)}
    record = convert(tmp_path, whole(angle_driver=raw), angle_driver=spec)
    assert np.ptp(record["angle_driver"].values[0] - angle) < 2 * pi / (4 * LINES)
    assert "its range of 65536 counts is added" in record.attrs["warnings"]


def test_gears_that_do_not_keep_step_are_named_where_the_speed_varies(tmp_path: Path) -> None:
    """A saw-tooth of 2 rad, as of a counter that was taken for an angle."""
    up = 0.02 * TIME**2
    angles = {
        name: signals(TIME)[name] + 20 * up * (3 if name == "angle_driver" else 2)
        for name in ("angle_driver", "angle_driven")
    }
    convert(tmp_path, whole(**angles))
    angles["angle_driven"] = np.mod(angles["angle_driven"], 2.0)
    with pytest.raises(RecordError, match=r"angle_driver turns at a mean .* but angle_driven at .* starts again"):
        convert(tmp_path, whole(**angles))
