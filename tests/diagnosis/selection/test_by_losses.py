"""Friction read off the mean of the reaction's torque, against the tooth loss factor of gear efficiency."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from shared.fake_simulator import FakeSimulator, sensitivities, target, unknowns
from shared.simulated_lines import demonstration

from gearbench.cases import case_files
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.selection import by_losses
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.by_losses import read_off, with_losses
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.geometry import pair
from gearbench.rig import read_case

FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))


@pytest.fixture(scope="module")
def sound() -> Simulator:
    return demonstration()


def losing(simulator: Simulator, part: float | None) -> Simulator:
    """The same beside a record whose reaction has lost a part of its torque; None: that was not measured."""
    (one,) = simulator.target.measurements
    periods = {name: values for name, values in one.periods.items() if name != "torque_driven" or part is not None}
    if part is not None:
        periods["torque_driven"] = (1.0 - part) * one.periods["torque_driven"]
    return simulator.of_target(replace(simulator.target, measurements=(replace(one, periods=periods),)))


def loss_factor() -> float:
    """Tooth loss factor: part of the power that a coefficient of one takes, of a load that pairs share evenly.
    Niemann and Winter (1983)."""
    meshing = pair(read_case(case_files()["gap_demo"]).rig)
    ratios = []
    for gear in (meshing.driver, meshing.driven):
        reach = np.sqrt(gear.tip_radius**2 - gear.base_radius**2)
        ratios.append((reach - gear.base_radius * np.tan(meshing.working_pressure_angle)) / meshing.base_pitch)
    z1, z2 = 20, 30
    return pi * (1 / z1 + 1 / z2) * (1 - sum(ratios) + sum(one**2 for one in ratios))


@pytest.mark.parametrize("coefficient", [0.02, 0.06])
def test_a_loss_is_read_as_the_friction_that_takes_as_much(sound: Simulator, coefficient: float) -> None:
    nothing = np.zeros(sound.layout.size)
    found = read_off(losing(sound, coefficient * loss_factor()), nothing)
    assert found is not None
    # Elastic pairs carry more where they slide less.
    assert found == pytest.approx(coefficient, rel=0.15)
    assert read_off(losing(sound, 0.0), nothing) == pytest.approx(0.0, abs=1e-3)


def test_a_reaction_that_was_not_measured_tells_nothing(sound: Simulator) -> None:
    assert read_off(losing(sound, None), np.zeros(sound.layout.size)) is None


MATRIX = sensitivities()


def valleys(p: np.ndarray) -> np.ndarray:
    """Lines that the fourth unknown turns round."""
    return p @ MATRIX + 2.0 * np.exp(40j * p[3]) * MATRIX[3]


def test_friction_is_begun_where_the_loss_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """From what the background has of it no step leads there; what little sound flanks lose begins nothing."""
    true = np.array([0.05, 0.1, -0.05, 0.3, 0.0, 0.0, 0.0, 0.0])
    simulator = FakeSimulator(valleys, target(valleys(true)))
    monkeypatch.setattr(by_losses, "GAIN", "stiffness")
    sd = prior_of(simulator, unknowns().prior())  # type: ignore[arg-type]
    base: Optimum | None = fit_afresh(simulator, np.zeros(8), sd, renewals=8)  # type: ignore[arg-type]
    assert base is not None and abs(base.p[3] - true[3]) > 0.1
    monkeypatch.setattr(by_losses, "read_off", lambda simulator, p: 0.29)
    begun = with_losses(simulator, base, (FRICTION,), {})["friction"]  # type: ignore[arg-type]
    assert begun.p == pytest.approx(true, abs=0.02) and begun.log_bayes_factor > 20.0
    for little in (None, base.p[3] + 0.01):
        monkeypatch.setattr(by_losses, "read_off", lambda simulator, p, little=little: little)
        assert with_losses(simulator, base, (FRICTION,), {}) == {}  # type: ignore[arg-type]
    assert with_losses(simulator, base, (), {}) == {}  # type: ignore[arg-type]
    # What forces make of it is not lost where that fit ends badly.
    monkeypatch.setattr(by_losses, "read_off", lambda simulator, p: 0.29)
    better = replace(base, evidence=base.evidence + 1e3)
    forces = {"friction": Start(FRICTION, np.zeros(8), 30.0)}
    kept = with_losses(simulator, better, (FRICTION,), forces)["friction"]  # type: ignore[arg-type]
    assert kept.log_bayes_factor == 30.0 and kept.p == pytest.approx(begun.p)
