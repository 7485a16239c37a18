"""What a record says of the filter and the delay that its channels have in common."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearbench.records.antialias import butterworth, butterworth_delay, common_lag
from gearbench.records.errors import RecordError

FILTERED = {"filter": "Butterworth, order 8", "filter_hz": 3000.0, "delay": 5.126 / (2 * np.pi * 3000.0)}


def record(**about: dict[str, object]) -> xr.Dataset:
    names = {"torque_driver": {}, "angle_driver": {}, "mesh_phase": {}} | about
    return xr.Dataset({name: ("time", np.zeros(4), attrs) for name, attrs in names.items()})


@pytest.mark.parametrize("order", [2, 5, 8])
def test_the_filter_is_flat_and_its_delay_that_of_its_slow_signals(order: int) -> None:
    frequency = np.array([0.0, 500.0, 3000.0, 9000.0])
    response = butterworth(frequency, 3000.0, order)
    assert np.abs(response) == pytest.approx(1 / np.sqrt(1 + (frequency / 3000.0) ** (2 * order)), rel=1e-12)
    slow = 1e-3
    turned = -np.angle(butterworth(np.array([slow]), 3000.0, order)[0]) / (2 * np.pi * slow)
    assert butterworth_delay(3000.0, order) == pytest.approx(turned, rel=1e-6)


def test_what_all_channels_state_is_common() -> None:
    assert common_lag(record()) is None
    assert common_lag(record(torque_driver=FILTERED)) is None  # the angle passed none
    found = common_lag(record(torque_driver=FILTERED, angle_driver=FILTERED))
    assert found is not None and (found.corner, found.order) == (3000.0, 8)
    assert found.delay == pytest.approx(FILTERED["delay"], rel=1e-3)
    late, later = {"delay": 2e-4}, {"delay": 5e-4}
    found = common_lag(record(torque_driver=late, angle_driver=later))
    assert found is not None and (found.delay, found.order) == (2e-4, 0)
    assert found.response(np.array([1000.0])) == pytest.approx(np.exp(-0.4j * np.pi))
    # Of two filters the shorter delay is common; a mesh phase that is late by as much is that of the channels.
    wider = FILTERED | {"filter_hz": 6000.0}
    found = common_lag(record(torque_driver=FILTERED, angle_driver=wider))
    assert found is not None and (found.delay, found.order) == (butterworth_delay(6000.0, 8), 0)
    both = record(torque_driver=late, angle_driver=late, mesh_phase={"delay": 2e-4})
    assert common_lag(both) is None
    assert common_lag(record(torque_driver=late, angle_driver={"delay": 0.0})) is None
    alone = xr.Dataset({name: ("time", np.zeros(4), late) for name in ("force", "dte")})
    found = common_lag(alone)
    assert found is not None and found.delay == 2e-4


@pytest.mark.parametrize(
    ("about", "said"),
    [
        ({"delay": -1e-3}, r"angle_driver: delay = -0.001 must be a number of s \(limit 0\)"),
        ({"delay": "late"}, "angle_driver: delay = late must be a number of s"),
        ({"filter": "Butterworth, order 8", "filter_hz": np.nan}, "filter_hz = nan must be a number of Hz"),
        ({"filter": "Butterworth, order 99", "filter_hz": 1e3}, "'Butterworth, order 99' must be of order 1 to 20"),
    ],
)
def test_a_filter_that_is_none_is_refused(about: dict[str, object], said: str) -> None:
    with pytest.raises(RecordError, match=said):
        common_lag(record(angle_driver=about))
