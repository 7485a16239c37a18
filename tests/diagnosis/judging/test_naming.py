"""The parameters of an effect as a verdict states them."""

from __future__ import annotations

import pytest

from gearbench.diagnosis.effects.effect import Estimate
from gearbench.diagnosis.effects.pitch_error import PITCH_ERROR
from gearbench.diagnosis.effects.sensor_delay import SENSOR_DELAY
from gearbench.diagnosis.judging.naming import parameters_of

NORMAL = 1.6449  # standard deviations to either end of 90 % of a normal distribution


def test_no_size_is_said_to_be_less_than_nothing() -> None:
    (stated,) = parameters_of(PITCH_ERROR, [Estimate("driver.rms", 0.38, 0.5, "um")]).values()
    assert stated.low == 0.0
    assert stated.high == pytest.approx(0.38 + NORMAL * 0.5, rel=0.05)
    (known,) = parameters_of(PITCH_ERROR, [Estimate("driver.rms", 3.8, 0.5, "um")]).values()
    assert 0.5 * (known.low + known.high) == pytest.approx(3.8)


def test_a_sensor_may_lead_as_well_as_lag() -> None:
    estimate = Estimate("angle_driven.delay", 1.0, 5.0, "us", signed=True)
    (stated,) = parameters_of(SENSOR_DELAY, [estimate]).values()
    assert stated.low == pytest.approx(1.0 - NORMAL * 5.0, rel=0.01)


def test_a_phase_is_not_cut_off() -> None:
    estimate = Estimate("driver.runout_phase", 10.0, 20.0, "deg", sized=False)
    (stated,) = parameters_of(PITCH_ERROR, [estimate]).values()
    assert stated.low == pytest.approx(10.0 - NORMAL * 20.0, rel=0.01)
