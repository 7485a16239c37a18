"""A fit begun again from the nominal rig, on lines made by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shared.fake_simulator import LINES, FakeSimulator, sensitivities, target, unknowns
from shared.simulated_lines import demonstration

from gearbench.diagnosis.output.beginning import linear_cost
from gearbench.diagnosis.output.fit import cost_of, fit, sensitivity_of
from gearbench.diagnosis.output.hidden_housing import hidden_housings
from gearbench.diagnosis.output.restructured import begun_at_nominal, is_close
from gearbench.diagnosis.output.simulator import Simulator
from gearbench.diagnosis.output.structure import ACROSS, HOUSING, MODE, OBLIQUE, SEAT, kind_of, with_motion

MATRIX = sensitivities(3)


def test_a_fit_in_a_valley_beside_the_nominal_rig_is_begun_there_again() -> None:
    """An unknown that lines see through a hill: the fit stops in the hollow behind it."""
    true = np.zeros(8)
    true[3] = 0.4

    def hilly(p: np.ndarray) -> np.ndarray:
        return p[1:] @ MATRIX[1:] + (0.125 * (1.0 - np.cos(25 * p[0])) + 0.4 * p[0]) * MATRIX[0]

    rng = np.random.default_rng(5)
    lines = hilly(true) + 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))
    simulator = FakeSimulator(hilly, target(lines))
    sd = unknowns().prior()
    sd[3], sd[6:] = 0.5, 0.0
    far = true.copy()
    far[0] = 0.25
    first = sensitivity_of(simulator, far, sd)
    assert first is not None
    stuck = fit(simulator, far, sd, first, renewals=3)
    assert stuck is not None and stuck.cost > 5.0 + cost_of(simulator, true, sd)
    kept = np.arange(8) == 3
    again = begun_at_nominal(simulator, stuck, kept)
    assert again.evidence > stuck.evidence + 5.0 and again.p[:4] == pytest.approx(true[:4], abs=0.02)
    # Where the nominal rig is far off nothing is begun.
    simulator.jacobians = 0
    assert begun_at_nominal(simulator, again, np.zeros(8, dtype=bool)) is again and simulator.jacobians == 0


def test_a_housing_under_the_sensors_is_told_by_the_transmission_error() -> None:
    """Of a rig on a housing that moves across, whose sensors go along with it, the trial that is alike is the best."""
    simulator = demonstration()
    layout = simulator.layout
    keys, p = layout.unknowns, np.zeros(layout.size)
    p[keys[ACROSS]], p[keys[SEAT]] = (0.2, 0.15), 1.0
    p[keys[HOUSING]], p[keys[MODE]], p[keys[OBLIQUE]] = (0.0, 0.05), (0.0, 0.0, -1.1, 0.1), (0.0, 0.0, 1.1, -0.9)
    lines = simulator.lines(p)
    assert lines is not None
    moving = Simulator(layout, replace(simulator.target, lines=lines), simulator.simulate)
    sd = keys.prior()
    best = min(hidden_housings(moving, np.zeros(layout.size)), key=lambda trial: linear_cost(moving, trial, sd))
    assert best[keys[SEAT]] == 1.0 and best[keys[HOUSING]][1] == pytest.approx(0.05, rel=0.6)
    assert best[keys[MODE]][2] == pytest.approx(-1.1, abs=0.1)
    assert (np.sign(best[keys[OBLIQUE]][2:]) == (1.0, -1.0)).all()


def test_two_resonances_of_one_kind_under_the_sensors_are_told_apart() -> None:
    simulator = demonstration()
    layout = simulator.layout
    keys, p = layout.unknowns, np.zeros(layout.size)
    p[keys[ACROSS]], p[keys[SEAT]], p[keys[OBLIQUE]] = (0.2, 0.15), 1.0, (-1.0, 1.0, 1.1, -0.9)
    p = with_motion(keys, with_motion(keys, p, 0, -0.3, 0.02, 1), 1, -1.1, 0.03, 1)
    lines = simulator.lines(p)
    assert lines is not None
    moving = Simulator(layout, replace(simulator.target, lines=lines), simulator.simulate)
    plain = np.where(keys.of((HOUSING,)), 0.0, p)
    one, both = hidden_housings(moving, plain)
    assert sorted(both[keys[MODE]][[0, 2]]) == pytest.approx([-1.1, -0.3], abs=0.1)
    assert kind_of(keys, both, 0) == kind_of(keys, both, 1) == "rocking"
    costs = [linear_cost(moving, trial, keys.prior()) for trial in (plain, one, both)]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize(("off", "close"), [(0.0, True), (3.0, True), (500.0, False)])
def test_a_block_that_no_rig_answers_is_not_close(off: float, close: bool) -> None:
    """Whatever the median block is left with; in multiples of the floor."""
    lines = np.zeros(LINES, dtype=complex)
    far = lines.copy()
    simulator = FakeSimulator(lambda p: lines, target(far))
    far[simulator.target.of_line == 2] = np.sqrt(off * simulator.target.floors[2])
    found = SimpleNamespace(lines=lines)
    assert is_close(simulator, found) is close  # type: ignore[arg-type]
