"""A late angle is behind all the time: the mean transmission error tells it from what only turns phases."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.simulated_lines import behind, demonstration, of_records

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.sensor_delay import SENSOR_DELAY
from gearbench.diagnosis.selection import standing as module
from gearbench.diagnosis.selection.standing import FARTHEST, begun_late, called_for, denied_by_means
from gearbench.diagnosis.simulation.simulator import Simulator

LAG = 30e-6  # [s]


@pytest.fixture(scope="module")
def prompt() -> Simulator:
    """The demonstration, none of whose sensors lags."""
    return demonstration()


def late(simulator: Simulator, channel: str, lag: float, **changes: Any) -> Simulator:
    """The same with an angle that is behind by what its shaft turns on in that time [s], and changes of its record."""
    (measured,) = simulator.target.measurements
    return of_records(simulator, replace(behind(measured, channel.removeprefix("angle_"), lag), **changes))


def lagging(simulator: Simulator, channel: str, lag: float) -> tuple[Hypothesis, Any]:
    """The hypothesis of a late channel, and an optimum with that lag."""
    unknowns = simulator.layout.unknowns
    p = np.zeros(unknowns.size)
    p[unknowns[f"delay-{channel}"]] = lag
    (found,) = (one for one in SENSOR_DELAY.hypotheses(simulator.layout.model) if one.on == (channel,))
    return found, SimpleNamespace(p=p)


@pytest.mark.parametrize("channel", ["angle_driver", "angle_driven"])
def test_means_deny_a_late_angle_of_which_they_show_less_than_half(prompt: Simulator, channel: str) -> None:
    lags = lagging(prompt, channel, LAG)
    assert denied_by_means(prompt, *lags)
    assert denied_by_means(late(prompt, channel, -LAG), *lags)
    assert denied_by_means(late(prompt, channel, 0.45 * LAG), *lags)
    assert not denied_by_means(late(prompt, channel, 0.55 * LAG), *lags)
    assert not denied_by_means(late(prompt, channel, LAG), *lags)


def test_nothing_is_denied_without_a_zero_or_of_a_displacement(prompt: Simulator) -> None:
    adrift = late(prompt, "angle_driven", 0.0, zero_known=False)
    assert not denied_by_means(adrift, *lagging(prompt, "angle_driven", LAG))
    assert not denied_by_means(prompt, *lagging(prompt, "y_driver", LAG))


def beside(simulator: Simulator, channel: str, begun: float = 0.0) -> tuple[Hypothesis, Any]:
    """The hypothesis of a late channel, and a base in which it lags by so much."""
    one, optimum = lagging(simulator, channel, begun)
    return one, SimpleNamespace(p=optimum.p, sd=simulator.layout.unknowns.prior())


@pytest.mark.parametrize("channel", ["angle_driver", "angle_driven"])
def test_the_means_call_for_the_lag_that_is_there(prompt: Simulator, channel: str) -> None:
    one, base = beside(prompt, channel, 3e-6)
    at = prompt.layout.unknowns[f"delay-{channel}"]
    begin = called_for(late(prompt, channel, LAG), base, one)
    assert begin is not None and begin[at] == pytest.approx(LAG, rel=0.02)
    assert called_for(prompt, base, one) is None
    # A driven angle is not early, and no chain of sensors is late by many times its prior.
    early = called_for(late(prompt, channel, -LAG), base, one)
    assert (early is None) == (channel == "angle_driven")
    assert early is None or early[at] == pytest.approx(-LAG, rel=0.02)
    far = 1.2 * FARTHEST * float(prompt.layout.unknowns.group(f"delay-{channel}").wide[0])
    assert called_for(late(prompt, channel, far), base, one) is None
    assert called_for(late(prompt, channel, LAG, zero_known=False), base, one) is None


@pytest.mark.parametrize(("part", "called"), [(1.1, True), (0.9, False)])
def test_a_lag_that_sound_rigs_have_is_not_called_for(prompt: Simulator, part: float, called: bool) -> None:
    """They share a clock to some deviation each, and differ by twice its root of two in one rig of twenty."""
    one, base = beside(prompt, "angle_driver")
    base.sd[prompt.layout.unknowns["delay-angle_driver"]] = LAG / (2.0 * 2.0**0.5) / part
    assert (called_for(late(prompt, "angle_driver", LAG), base, one) is not None) == called


def test_a_lag_with_which_no_rig_answers_is_not_called_for(prompt: Simulator) -> None:
    """It costs its own beginning, and no more."""
    one, base = beside(prompt, "angle_driver")
    at_work = late(prompt, "angle_driver", LAG)

    def failing(case: Any, record: Any, nudge: float = 0.0) -> Any:
        if case.rig.sensors.delay_angle_driver > 0.0:
            raise ValueError("does not settle")
        return prompt.simulate(case, record, nudge)

    assert called_for(at_work, base, one) is not None
    assert called_for(replace(at_work, simulate=failing), base, one) is None


def test_a_lag_is_held_until_the_rig_has_followed(prompt: Simulator, monkeypatch: pytest.MonkeyPatch) -> None:
    one, base = beside(prompt, "angle_driver")
    at, fits = prompt.layout.unknowns["delay-angle_driver"], []

    def fit(simulator: Simulator, p: np.ndarray, sd: np.ndarray, renewals: int) -> Any:
        fits.append((p.copy(), sd))
        return SimpleNamespace(p=p + 1e-9)

    monkeypatch.setattr(module, "fit_afresh", fit)
    begin = base.p.copy()
    begin[at] = LAG
    assert begun_late(prompt, base, one, begin) is not None
    (first, held), (second, free) = fits
    assert first[at] == LAG and held[at] == 0.0 and (held[: at.start] == base.sd[: at.start]).all()
    assert (second == first + 1e-9).all() and free[at] > base.sd[at]
