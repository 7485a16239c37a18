"""Records that lack a channel or excite few lines: nothing is refused for it, and nothing breaks."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr

import gearbench as gb
from gearbench.records.checks import check_record

SHORT = ["experiment.realisations=1", "experiment.samples_per_period=2048", "experiment.multisine.band_hz=[4,900]"]


@cache
def record() -> xr.Dataset:
    return gb.simulate(gb.read_case("quick_lumped", SHORT))


CHANNELS = ("torque_driver", "torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven", "dte", "force")


@pytest.mark.parametrize("left_out", CHANNELS)
def test_a_missing_channel_is_no_defect(left_out: str) -> None:
    assert not any(finding.refused for finding in check_record(record().drop_vars(left_out)))


def test_excited_lines_between_those_looked_at_are_found() -> None:
    """Multiples of five lie between the lines that are looked at, 1, 6, 11 .."""
    rate, n, teeth = 8192.0, 3 * 2048 * 4, 20
    t = np.arange(n) / rate
    lines = np.arange(5, 2 * 2048, 5)
    phase = np.random.default_rng(1).uniform(0, 2 * np.pi, lines.size)
    swing = sum(np.cos(2 * np.pi * line * t * rate / n + p) for line, p in zip(lines, phase, strict=True))
    noise = 1e-9 * np.random.default_rng(2).standard_normal(n)
    signals = {"force": 1000.0 + swing[None], "dte": 1e-8 * (1000.0 + swing[None]) + noise}
    attributes = {"sampling_rate": rate, "samples_per_period": n, "periods": 1, "teeth_driver": teeth}
    assert not any(finding.refused for finding in check_record(gb.make_record(signals, attributes)))
