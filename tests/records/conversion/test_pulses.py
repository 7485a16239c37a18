"""Pulse times of encoders: every pulse counts once, the gap of an index is counted, faults are named."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.records.conversion.rotation import pulse_angle
from gearbench.records.errors import RecordError

LINES = 60


def ramp(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times [s] at which a shaft that speeds up from 5 to 20 turns a second within ten seconds has made `turns`."""
    return (np.sqrt(25.0 + 2 * 1.5 * turns) - 5.0) / 1.5


def places(turns: int = 120) -> NDArray[np.float64]:
    """Angles [turns] of all pulses of a wheel with LINES."""
    return np.arange(turns * LINES) / LINES


def angle(times: NDArray[np.float64], lines: float = LINES) -> tuple[NDArray[np.float64], list[str]]:
    notes: list[str] = []
    return pulse_angle(times, lines, "channel angle_driver", notes)[1], notes


def test_a_speed_that_rises_fourfold_is_no_fault() -> None:
    """Against the median step of the whole record the first turns would lack pulses."""
    found, notes = angle(ramp(places()))
    np.testing.assert_allclose(found, 2 * pi * places(), atol=1e-9)
    assert not notes


@pytest.mark.parametrize("begin", [0, 17, 57])
def test_the_gap_of_an_index_is_counted(begin: int) -> None:
    """60 - 2: 58 pulses a turn, on 60 places. Counted one by one the wheel would be 3 % too slow."""
    there = places()[np.arange(places().size) % LINES < LINES - 2][begin:]
    found, notes = angle(ramp(there))
    np.testing.assert_allclose(found, 2 * pi * (there - there[0]), atol=1e-9)
    assert notes == ["channel angle_driver has a gap of 3 steps once a turn: taken for its index"]
    with pytest.raises(RecordError, match=r"3\S* usual steps .* no index, which is a gap once in 58 places"):
        angle(ramp(there), LINES - 2)


@pytest.mark.parametrize("at", [3, 100, 3000, 7190])
def test_a_missed_pulse_is_named_at_any_speed(at: int) -> None:
    """Against the median step of the whole record it went unseen where the shaft is fast."""
    with pytest.raises(RecordError, match=rf"usual steps pass after pulse {at - 1} \(limit 1.8\): pulses are missing"):
        angle(ramp(np.delete(places(), at)))


@pytest.mark.parametrize("at", [3, 100, 3000, 7190])
@pytest.mark.parametrize("part", [0.01, 0.5, 0.97])
def test_a_doubled_pulse_is_named(at: int, part: float) -> None:
    times = ramp(places())
    double = np.insert(times, at + 1, times[at] + part * (times[at + 1] - times[at]))
    with pytest.raises(RecordError, match=rf"pulses {at}, {at + 1} and {at + 2} lie within .* too many"):
        angle(double)


def test_a_missed_pulse_beside_an_index_is_no_index() -> None:
    there = places()[np.arange(places().size) % LINES < LINES - 2]
    with pytest.raises(RecordError, match=r"pulses are missing \(120 such gap"):
        angle(ramp(np.delete(there, 1000)))


def test_what_times_cannot_be_is_named() -> None:
    times = ramp(places())
    broken = times.copy()
    broken[500] = np.nan
    with pytest.raises(RecordError, match="not finite between others, first at pulse 500"):
        angle(broken)
    with pytest.raises(RecordError, match=r"pulse \d+ at \S+ s does not come after .* starts again, add its range"):
        angle(times % (2**24 * 1e-7))
