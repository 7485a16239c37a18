"""Records of the same experiment compared sample by sample: rms of sines in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.measured import channels, record

from gearbench.bench.results.compare import Results, compare
from gearbench.bench.results.compare_records import differences, same_experiment


def quiet(**added: tuple[float, float]) -> xr.Dataset:
    """A record without noise whose channels have sines (amplitude, Hz) added; torque lines at 25.8, 75.8, 125.8 Hz."""
    values = channels(noise=0.0)
    time = np.arange(values["y_driver"].size) / 10240.0
    for name, (amplitude, frequency) in added.items():
        values[name] = values[name] + amplitude * np.sin(2 * np.pi * frequency * time)
    return record(values)


def test_rms_of_the_difference_is_that_of_the_added_sine() -> None:
    found = {(one.quantity, one.band): one for one in differences(quiet(), quiet(y_driven=(3e-6, 100.0)))}
    assert {band for _, band in found} == {"0-150 Hz"}
    y = found["y of the driven gear, rms", "0-150 Hz"]
    assert (y.unit, y.difference) == ("um", pytest.approx(3 / np.sqrt(2), rel=1e-9))
    # Uncorrelated with what was there: squares add up.
    assert y.b == pytest.approx(np.hypot(y.a, y.difference), rel=1e-6)
    # In the transmission error y2 counts against, with the cosine of the pressure angle.
    dte = found["DTE, rms", "0-150 Hz"]
    assert dte.difference == pytest.approx(3 / np.sqrt(2) * np.cos(np.radians(20)), rel=1e-9)
    assert found["y of the driver, rms", "0-150 Hz"].difference == 0.0


def test_what_lies_above_the_excitation_is_left_out() -> None:
    found = differences(quiet(), quiet(y_driven=(3e-6, 400.0)))
    assert max(one.difference for one in found) < 1e-9


def test_other_experiments_are_not_compared() -> None:
    one = quiet()
    assert same_experiment(one, quiet()) and same_experiment(one, record())
    assert not same_experiment(one, record(channels(seed=1)))
    assert not same_experiment(one, record(channels(phase=0.01)))
    assert not same_experiment(one, record(channels(torque=103.0)))
    assert not same_experiment(one, one.assign_attrs(mesh_period=0.021))
    assert differences(one, record(channels(seed=1))) == []


def test_the_rows_of_a_comparison_carry_the_difference() -> None:
    rows = compare(Results("a", quiet()), Results("b", quiet(y_driver=(1e-6, 100.0))))
    row = next(row for row in rows if row.quantity == "y of the driver, rms")
    assert row.difference == pytest.approx(1 / np.sqrt(2), rel=1e-9)
    assert row.percent == pytest.approx(100 * row.difference / row.a)
