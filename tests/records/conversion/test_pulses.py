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


def torsion(turns: NDArray[np.float64], swing: float, cycles: float = 1.3) -> NDArray[np.float64]:
    """Times [turns of the mean speed] of a shaft whose speed swings by so much of its mean, so often a turn."""
    rate = 2 * pi * cycles
    low, high = turns - 2 * swing / rate, turns.copy()
    for _ in range(60):
        middle = 0.5 * (low + high)
        late = middle + swing / rate * (1 - np.cos(rate * middle)) > turns
        low, high = np.where(late, low, middle), np.where(late, middle, high)
    return high


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
    with pytest.raises(RecordError, match=rf"steps pass after pulse {at - 1} \(limit 1.5, .*: pulses are missing"):
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


@pytest.mark.parametrize(("swing", "cycles"), [(0.4, 1.3), (0.8, 0.6)])
def test_a_strong_torsional_vibration_is_no_fault_and_hides_none(swing: float, cycles: float) -> None:
    """Speeds of 0.6 to 1.4 and 0.2 to 1.8 of the mean, which change within the 17 steps of a median."""
    times = torsion(places(200), swing, cycles)
    np.testing.assert_allclose(angle(times)[0], 2 * pi * places(200), atol=1e-9)
    steps = np.diff(times)
    for at in (int(steps.argmin()), int(steps.argmax()), *range(100, 147)):
        with pytest.raises(RecordError, match=r"missing|too many"):
            angle(np.delete(times, at))
        with pytest.raises(RecordError, match=r"missing|too many"):
            angle(np.insert(times, at + 1, times[at] + 0.5 * steps[at]))


def test_uneven_pulses_hide_no_fault() -> None:
    """Lines that stand off by 3 % of a step."""
    scattered = ramp(places() + np.random.default_rng(5).normal(0, 0.03 / LINES, places().size))
    angle(scattered)
    for at in range(500, 540):
        with pytest.raises(RecordError, match=f"pass after pulse {at - 1} .* pulses are missing"):
            angle(np.delete(scattered, at))


@pytest.mark.parametrize(("lines", "turns"), [(60, 20), (720, 3)])
def test_an_index_of_one_line_is_counted_under_a_strong_vibration(lines: int, turns: int) -> None:
    """By the median of 17 steps its gap is 1.2 to 3 usual steps wide."""
    whole = np.arange(turns * lines) / lines
    there = whole[np.arange(whole.size) % lines != 33]
    found, notes = angle(torsion(there, 0.4, 1.3 * lines / 60), lines)
    np.testing.assert_allclose(found, 2 * pi * there, atol=1e-9)
    assert notes == ["channel angle_driver has a gap of 2 steps once a turn: taken for its index"]


def test_few_lines_that_a_vibration_passes_twice_are_no_index() -> None:
    """A median of nine steps, which such a track does not follow, sees a gap in them where two turns are slow."""
    whole = np.arange(90) / LINES
    np.testing.assert_allclose(angle(torsion(whole, 0.6, 2.0 * LINES / (LINES - 1)))[0], 2 * pi * whole, atol=1e-9)


def test_what_times_cannot_be_is_named() -> None:
    times = ramp(places())
    broken = times.copy()
    broken[500] = np.nan
    with pytest.raises(RecordError, match="not finite between others, first at pulse 500"):
        angle(broken)
    with pytest.raises(RecordError, match=r"pulse \d+ at \S+ s does not come after .* starts again, add its range"):
        angle(times % (2**24 * 1e-7))
