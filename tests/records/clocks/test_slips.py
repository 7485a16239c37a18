"""Angles that part from each other: missed pulses and clocks apart are named, sound rigs are not."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.spoilt import RIGS, bare, simulated, with_values

from gearbench.records import RecordError
from gearbench.records.checks import check_record
from gearbench.records.checks.door import angles_do_not_slip, gears_pass_the_same_teeth
from gearbench.records.clocks.slips import gone, largest_step

BOTH = [angles_do_not_slip, gears_pass_the_same_teeth]


def leapt(record: xr.Dataset, name: str, size: float) -> xr.Dataset:
    values = record[name].values.copy()
    values[0, values.shape[1] // 3 :] -= size
    return with_values(record, name, values)


def on_another_clock(record: xr.Dataset, name: str, ppm: float) -> xr.Dataset:
    """The channel as a clock that runs fast by so much samples it."""
    values, at = record[name].values.copy(), np.arange(record.sizes["time"], dtype=float)
    values[0] = np.interp(at * (1 - 1e-6 * ppm), at, values[0])
    return with_values(record, name, values)


@pytest.mark.parametrize("name", RIGS)
def test_sound_rigs_pass(name: str) -> None:
    assert check_record(bare(simulated(name)), checks=BOTH) == ()


@pytest.mark.parametrize("name", ["free", "16/48 noise"])
@pytest.mark.parametrize("gear", ["driver", "driven"])
def test_a_missed_pulse_of_a_fine_encoder_is_named(name: str, gear: str) -> None:
    """One of 5000 to the turn, which is within all limits of speed."""
    record = leapt(bare(simulated(name)), f"angle_{gear}", 2 * np.pi / 5000)
    at = record.sizes["time"] // 3
    with pytest.raises(RecordError, match=rf"angle_{gear} leaps by 0\.001\d* rad.*{at - 1} and {at} .*miss or"):
        check_record(record)


@pytest.mark.parametrize("name", ["free", "16/48 noise"])
def test_angles_on_clocks_apart_are_named(name: str) -> None:
    record = on_another_clock(bare(simulated(name)), "angle_driven", 300.0)
    with pytest.raises(RecordError, match=r"angle_driver and angle_driven part by .* (29\d|30\d)\S* ppm .*clocks of"):
        check_record(record)


def test_a_spike_is_no_step() -> None:
    values = np.random.default_rng(1).standard_normal(1000).cumsum()
    values[500] += 100.0
    assert largest_step(values)[0] is None
    values[501:] += 100.0
    place, size, _ = largest_step(values)
    assert place == 499
    assert size == pytest.approx(100.0, rel=0.05)
    assert largest_step(values[:503])[0] is None


def test_what_a_straight_line_goes_and_what_it_leaves() -> None:
    swing = np.sin(2 * np.pi * np.arange(4000) / 40)
    way, left = gone(swing + 0.01 * np.arange(4000), 40.0)
    assert way == pytest.approx(40.0)
    assert left == pytest.approx(np.sqrt(0.5))
