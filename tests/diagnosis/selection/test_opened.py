"""Backlash weighed value by value, on likelihoods made by hand."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.selection.opened import Opened, opened

NARROW, WIDE = 5e-6, 50e-6
UNKNOWNS = unknowns_of([group("backlash", "m", ("more",), NARROW, WIDE, slot="backlash")], 2)


def weighed(nats: Callable[[float], float], least: float = -np.inf) -> Opened | None:
    """With a cost of so many nats by the backlash [m], of which there is no rig below `least`."""

    def lines(p: np.ndarray) -> np.ndarray | None:
        return None if p[0] < least else np.array([nats(float(p[0]))])

    target = SimpleNamespace(lines=0.0, cost=lambda residual: -float(residual[0]))
    simulator: Any = SimpleNamespace(layout=SimpleNamespace(unknowns=UNKNOWNS), lines=lines, target=target)
    return opened(simulator, np.zeros(1))


@pytest.mark.parametrize(("true", "std"), [(32e-6, 2e-6), (-17e-6, 0.3e-6), (71e-6, 9e-6)])
def test_a_peak_is_found_with_its_width_and_its_evidence(true: float, std: float) -> None:
    found = weighed(lambda value: 0.5 * ((value - true) / std) ** 2)
    assert found is not None
    # A normal likelihood under a normal prior, in closed form.
    shrunk = WIDE**2 / (WIDE**2 + std**2)
    assert found.value == pytest.approx(shrunk * true, abs=0.3 * std)
    assert found.std == pytest.approx(np.sqrt(shrunk) * std, rel=0.4)
    variances = [width**2 + std**2 for width in (WIDE, NARROW)]
    wide, narrow = (-0.5 * (true**2 / variance + np.log(variance)) for variance in variances)
    assert found.worth == pytest.approx(wide - narrow, abs=1.0, rel=0.1)
    assert found.good == pytest.approx(true * NARROW**2 / variances[1], abs=0.5 * std)


def test_of_at_least_so_much_the_middle_of_what_is_left_is_told() -> None:
    found = weighed(lambda value: 1000.0 * max(20e-6 - value, 0.0) / 20e-6)
    assert found is not None
    # The prior beyond 20 um: mean and spread of a truncated normal.
    draws = np.random.default_rng(1).normal(0.0, WIDE, 200_000)
    draws = draws[draws > 20e-6]
    assert found.value == pytest.approx(draws.mean(), rel=0.1)
    assert found.std == pytest.approx(draws.std(), rel=0.1)
    assert found.value - 2.0 * found.std < 20e-6 and found.worth > 3.0


def test_of_two_peaks_one_is_told() -> None:
    found = weighed(lambda value: min(0.5 * ((abs(value) - 40e-6) / 1e-6) ** 2, 60.0))
    assert found is not None and abs(found.value) == pytest.approx(40e-6, abs=1e-6)


def test_records_that_feel_no_backlash_say_nothing() -> None:
    assert weighed(lambda value: 3.0) is None
    assert weighed(lambda value: 0.5 * (value / 1e-6) ** 2, least=1e-6) is None


def test_what_no_rig_can_have_is_left_out() -> None:
    found = weighed(lambda value: 0.5 * ((value - 30e-6) / 2e-6) ** 2, least=-10e-6)
    assert found is not None and found.value == pytest.approx(30e-6, abs=1e-6)
