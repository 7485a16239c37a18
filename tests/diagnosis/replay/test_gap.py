"""The gap table: rms values known by construction, and intervals that hold what they promise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
import xarray as xr
from shared.measured import MESH, RATE, SAMPLES, channels, nominal, record

from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.intake.signals import bands, line_energy, noise_of_mean, rotation_lines, simulated_channels
from gearbench.diagnosis.replay.gap import band_energy, gaps
from gearbench.diagnosis.verdict import Gap
from gearbench.rig import Case

TIME = np.arange(SAMPLES) / RATE


def held_out(noise: float = 0.0, periods: int = 2) -> Measurement:
    return measurement(record(channels(noise=noise, periods=periods), periods=periods), "held-out", nominal())


def named(name: str) -> Case:
    return nominal().model_copy(update={"name": name})


NOMINAL, BETTER, BEST = named("nominal"), named("recalibrated"), named("best")


def simulator(errors: dict[str, dict[str, np.ndarray | float]]) -> Callable[[Case, xr.Dataset], xr.Dataset]:
    """A rig whose channels are off by the errors given for each case's name."""

    def simulate(case: Case, _: xr.Dataset) -> xr.Dataset:
        values = {key: value[:SAMPLES] for key, value in channels(noise=0.0).items()}
        for channel, error in errors.get(case.name, {}).items():
            values[channel] = values[channel] + error
        return record(values, periods=1)

    return simulate


def tone(frequency: float, size: float) -> np.ndarray:
    return size * np.cos(2 * pi * frequency * TIME + 0.4)


def find(found: tuple[Gap, ...], channel: str, band: tuple[float, float]) -> Gap:
    return next(gap for gap in found if gap.channel == channel and gap.band_hz == band)


def test_rms_by_channel_and_band() -> None:
    measured = held_out()
    top = bands(measured)[-1][1]
    # Lines 31, 91, 151: up to 125.8 Hz; cut at a fifteenth and a third.
    assert bands(measured) == ((0.0, 10.0), (10.0, 50.0), (50.0, 150.0))
    wide = channels(noise=0.0)
    wide["torque_driver"] = 100 + 20 * np.cos(2 * pi * 2960.8333 * np.arange(2 * SAMPLES) / RATE)
    measured = measurement(record(wide), "held-out", nominal())
    parts = ((0.0, 200.0), (200.0, 1000.0), (1000.0, 3000.0))
    assert bands(measured) == parts and top == 150.0
    y = tone(200.0, 2e-7) + tone(500.0, 4e-7) + tone(1000.0, 1e-7) + tone(2500.0, 3e-7) + tone(3500.0, 9e-6) + 1e-6
    errors = {"nominal": {"y_driven": -y}, "recalibrated": {"y_driven": -0.5 * y}}
    found = gaps(NOMINAL, BETTER, None, measured, simulate=simulator(errors))
    for band, sizes in (
        (parts[0], (2e-7,)),
        (parts[1], (4e-7, 1e-7)),  # an edge belongs to the band below it
        (parts[2], (3e-7,)),
        ((0.0, 3000.0), (2e-7, 4e-7, 1e-7, 3e-7)),
    ):
        gap = find(found, "y_driven", band)
        rms = sqrt(sum(size**2 for size in sizes) / 2)
        assert gap.nominal.value == pytest.approx(rms, rel=1e-6)
        assert gap.recalibrated.value == pytest.approx(rms / 2, rel=1e-6)
        assert gap.with_effect is None and gap.unit == "m" and gap.record == "held-out"
        # The DTE sees the driven gear's y with the cosine of 20 degrees.
        assert find(found, "dte", band).nominal.value == pytest.approx(rms * np.cos(np.radians(20)), rel=1e-6)
    assert find(found, "y_driven", (0.0, 0.0)).nominal.value == pytest.approx(1e-6, rel=1e-6)
    assert find(found, "torque_driven", (0.0, 3000.0)).unit == "N m"
    assert found[0].channel == "dte" and found[0].band_hz == (0.0, 3000.0)


def test_angles_are_rolled_on_the_base_circle_and_the_effect_comes_last() -> None:
    errors = {"nominal": {"angle_driver": tone(50, 3e-5)}, "recalibrated": {"angle_driver": tone(50, 2e-5)}}
    found = gaps(NOMINAL, BETTER, BEST, held_out(), simulate=simulator(errors))
    gap = find(found, "angle_driver", (0.0, 150.0))
    radius = 0.03 * np.cos(np.radians(20))
    assert gap.nominal.value == pytest.approx(radius * 3e-5 / sqrt(2), rel=1e-6)
    assert gap.recalibrated.value == pytest.approx(radius * 2e-5 / sqrt(2), rel=1e-6)
    assert gap.with_effect is not None and gap.with_effect.value < 1e-12


def test_means_are_given_where_zero_means_something() -> None:
    errors = {"nominal": {"angle_driver": 1e-5, "y_driver": 2e-6}}
    found = gaps(NOMINAL, BETTER, None, held_out(), simulate=simulator(errors))
    assert {gap.channel for gap in found if gap.band_hz == (0.0, 0.0)} == {gap.channel for gap in found}
    shift = 1e-5 * 0.03 * np.cos(np.radians(20)) + 2e-6 * np.cos(np.radians(20))
    assert find(found, "dte", (0.0, 0.0)).nominal.value == pytest.approx(shift, rel=1e-6)
    # An encoder with an index of its own: its mean is taken off on both sides, those of y and torque are kept.
    values = channels(noise=0.0)
    values["angle_driver"] = values["angle_driver"] + 0.3
    free = measurement(record(values), "held-out", nominal())
    assert not free.zero_known
    own = simulated_channels(free, simulator(errors)(NOMINAL, free.record))
    assert abs(own["angle_driver"].mean()) < 1e-15 and abs(own["y_driver"].mean()) > 1e-6
    found = gaps(NOMINAL, BETTER, None, free, simulate=simulator(errors))
    known = {gap.channel for gap in found if gap.band_hz == (0.0, 0.0)}
    assert known == {"y_driver", "y_driven", "torque_driven"}
    assert find(found, "angle_driver", (0.0, 150.0)).nominal.value < 1e-12


@pytest.mark.parametrize(
    ("zeros", "means"),
    [
        ({"y_driver": 0.7}, {"y_driven", "dte"}),
        ({"y_driver": -0.4}, {"y_driver", "y_driven", "dte"}),
        ({"y_driver": -1.0, "y_driven": -1.0}, set()),
    ],
)
def test_displacements_that_see_what_moves_alone_have_no_mean(zeros: dict[str, float], means: set[str]) -> None:
    """Zeros off by those parts of the support's rest: the transmission error has the difference of both."""
    values = channels(noise=0.0)
    for channel, off in zeros.items():
        values[channel] = values[channel] + off * values[channel].mean()
    found = gaps(NOMINAL, BETTER, None, measurement(record(values), "held-out", nominal()), simulate=simulator({}))
    told = {gap.channel for gap in found if gap.band_hz == (0.0, 0.0)}
    assert told == means | {"angle_driver", "torque_driven"}


def test_the_floor_is_the_noise_of_the_mean() -> None:
    for periods in (2, 3, 8):
        measured = held_out(noise=1.0, periods=periods)
        gap = find(gaps(NOMINAL, BETTER, None, measured, simulate=simulator({})), "y_driver", (0.0, 150.0))
        # White noise of 50 nm up to 5120 Hz, of which 180 of 6144 lines lie in the band.
        expected = 5e-8 / sqrt(periods) * sqrt(180 / 6144)
        assert gap.floor is not None and gap.floor.low <= gap.floor.value <= gap.floor.high
        assert gap.floor.value == pytest.approx(expected, rel=4 / sqrt(360 * (periods - 1)))
        # A perfect model is at the floor.
        assert gap.nominal.value == pytest.approx(expected, rel=0.2)
        # Two degrees of freedom for each of 180 lines and each row beyond the first; normal limit of chi-square.
        width = 2 * 1.645 / sqrt(2 * 360 * (periods - 1))
        assert gap.floor.high / gap.floor.low - 1 == pytest.approx(width, rel=0.1)


def test_one_row_has_no_floor() -> None:
    found = gaps(NOMINAL, BETTER, None, held_out(periods=1), simulate=simulator({"nominal": {"y_driver": 1e-6}}))
    assert found and all(gap.floor is None for gap in found)


def test_a_record_of_unknown_phase_has_no_gap() -> None:
    values = {name: value for name, value in channels(noise=0.0).items() if name != "mesh_phase"}
    unknown = measurement(record(values, mesh_phase_origin="arbitrary"), "held-out", nominal())
    assert gaps(NOMINAL, BETTER, None, unknown, simulate=simulator({})) == ()


def test_rotation_lines_are_those_of_both_shafts() -> None:
    turning = rotation_lines(held_out())
    # Row of 60 mesh periods: driver revolution every 20, driven every 30.
    assert np.flatnonzero(turning[:13]).tolist() == [0, 2, 3, 4, 6, 8, 9, 10, 12]
    assert turning.size == SAMPLES // 2 + 1 and MESH == 50.0


def test_intervals_of_drawn_lines_hold_the_expectation() -> None:
    draw = np.random.default_rng(3)
    level = np.geomspace(1.0, 0.05, 60)  # lines of unequal expectation, as of a resonance
    truth = sqrt(float(np.sum(level**2)))
    none = np.zeros(60, dtype=bool)
    inside, trials = 0, 1500
    for _ in range(trials):
        lines = level**2 * draw.exponential(size=60)
        found = band_energy(lines, none, 1e-6).rms()
        inside += found.low <= truth <= found.high
    # 90 % with Satterthwaite's approximation; binomial sd 0.8 %.
    assert inside / trials == pytest.approx(0.90, abs=0.03)


def test_intervals_of_recurring_lines_follow_the_noise() -> None:
    draw = np.random.default_rng(4)
    size, noise = np.array([5.0, 2.0, 0.0, 0.0]), 0.2
    truth = float(np.sum(size**2 + noise))
    every = np.ones(4, dtype=bool)
    inside, trials, widths = 0, 1500, []
    for _ in range(trials):
        error = sqrt(noise / 2) * (draw.normal(size=4) + 1j * draw.normal(size=4))
        found = band_energy(np.abs(size + error) ** 2, every, noise).rms()
        inside += found.low <= sqrt(truth) <= found.high
        widths.append(found.high / found.low)
    assert inside / trials == pytest.approx(0.90, abs=0.03)
    # Taken as random, the strong line would leave a factor; as recurring, some per cent.
    assert np.mean(widths) < 1.5
    # Nothing but noise: two degrees of freedom a line.
    assert band_energy(np.full(4, noise), every, noise).freedom == pytest.approx(8)
    lines = size**2 + noise
    assert band_energy(lines, every, None).rms().high > 1.5 * band_energy(lines, every, noise).rms().high


def test_the_parts_of_the_noise_add_up_to_the_variance_of_the_mean() -> None:
    draw = np.random.default_rng(5)
    for rows in (2, 3, 7):
        parts = noise_of_mean(draw.normal(size=(rows, 40_000)))
        assert line_energy(parts).sum() == pytest.approx(1 / rows, rel=0.04)


def test_means_carry_the_scatter_of_the_rows() -> None:
    one = held_out(periods=2)
    # Rows that differ by 2e-6 in their means: the mean's standard error is 1e-6.
    rows = one.periods["y_driver"] + np.array([[1e-6], [-1e-6]])
    moved = replace(one, periods={**one.periods, "y_driver": rows})
    found = gaps(NOMINAL, BETTER, None, moved, simulate=simulator({"nominal": {"y_driver": 5e-6}}))
    gap = find(found, "y_driver", (0.0, 0.0))
    assert gap.floor is not None and gap.floor.value == pytest.approx(1e-6)
    assert gap.nominal.value == pytest.approx(5e-6)
    assert gap.nominal.high - gap.nominal.low == pytest.approx(2 * 1.645e-6, rel=1e-3)


def test_noise_far_beyond_what_is_left_keeps_an_interval() -> None:
    """A tone that does not repeat leaves lines that are all noise."""
    found = band_energy(np.full(4, 1e-14), np.ones(4, dtype=bool), 1e-9).rms()
    assert 0.0 < found.low <= found.value <= found.high < 100 * found.value
