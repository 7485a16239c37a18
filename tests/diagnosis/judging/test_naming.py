"""The parameters of an effect as a verdict states them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gearbench.diagnosis.effects.effect import Estimate
from gearbench.diagnosis.effects.pitch_error import PITCH_ERROR
from gearbench.diagnosis.effects.sensor_delay import SENSOR_DELAY
from gearbench.diagnosis.judging.chances import Chances
from gearbench.diagnosis.judging.closing import Closing
from gearbench.diagnosis.judging.decided import Decided
from gearbench.diagnosis.judging.naming import effects_of, parameters_of

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


def test_an_effect_in_two_places_counts_as_where_it_is_likelier_and_closes_more() -> None:
    """Whichever entered first."""
    delays = {f"sensor-delay {one}": one for one in ("angle_driver", "y_driver")}

    def add(rig: Any, hypothesis: Any, values: Any) -> Any:
        return rig, (Estimate(f"{delays[hypothesis.name]}.delay", 20.0, 1.0, "us", signed=True),)

    effect: Any = SimpleNamespace(name="sensor-delay", add=add, stated=lambda estimate, by_forces: estimate.std)
    named: Any = [SimpleNamespace(effect=effect, hypothesis=SimpleNamespace(name=name)) for name in delays]
    shares = dict(zip(delays, (0.3, 0.1), strict=True))
    judged: Any = SimpleNamespace(
        found=SimpleNamespace(
            std=None,
            selection=SimpleNamespace(best=SimpleNamespace(p=None)),
            layout=SimpleNamespace(nominal=SimpleNamespace(rig=None), fitted=lambda p, std: None),
        ),
        closings=dict(zip(delays, (Closing(9.0, 1.3, ("", ""), {}), Closing(5.0, 2.0, ("", ""), {})), strict=True)),
        share_of=lambda hypothesis: shares[hypothesis.name],
        sizes={},
    )
    chances = Chances(dict(zip(delays, (0.99, 0.8), strict=True)), {}, ())
    for order in (named, named[::-1]):
        (one,) = effects_of(judged, Decided("effects", "mesh", tuple(order), 0.0, ()), chances)
        assert (one.probability, one.share, one.grows) == (0.99, 0.3, 2.0)
        assert sorted(one.parameters) == ["angle_driver.delay", "y_driver.delay"]
