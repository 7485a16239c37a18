"""Truth rigs by finite elements: how they are drawn, and what their records hold."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
from shared.truth_plants import drawn_levels, short_bench, short_case

from gearbench.bench import simulate
from gearbench.bench.models import MODELS
from gearbench.challenge.truth import elastic
from gearbench.challenge.truth.elastic import REPRESENTED, elastic_rig, measure_elastic, within_uncertainty
from gearbench.challenge.truth.levels import Levels
from gearbench.challenge.truth.rigs import conditions_of
from gearbench.rig import Case

NOMINAL = short_case()
CONDITION = conditions_of(NOMINAL)[0]
DRIVEN_RADIUS = 0.5 * 30 * 3e-3 * np.cos(np.deg2rad(20.0))  # base radius of the driven gear [m]


def quiet(levels: Levels) -> Levels:
    """Levels without any effect."""
    return replace(
        levels, friction=0.0, runout=(0.0, 0.0), pitch=tuple(0.0 * one for one in levels.pitch), exponent=(0.0, 0.0),
        delay=(0.0, 0.0, 0.0, 0.0), ripple=0.0 * levels.ripple, backlash_more=0.0, encoder=(0.0, 0.0),
    )  # fmt: skip


def value(case: Case, path: str) -> float:
    found = case
    for key in path.split("."):
        found = getattr(found, key)
    return float(found)  # type: ignore[arg-type]


def test_uncertain_numbers_are_drawn_within_two_deviations() -> None:
    paths = NOMINAL.uncertainty
    drawn = [within_uncertainty(NOMINAL, np.random.default_rng(seed)) for seed in range(50)]
    for path, deviation in paths.items():
        away = np.array([(value(one, path) - value(NOMINAL, path)) / deviation for one in drawn])
        assert np.abs(away).max() <= 2.0 + 1e-9 and 0.6 < away.std() < 1.2, path


def test_what_it_represents_the_reduced_model_does_not_refuse() -> None:
    levels = drawn_levels(2)
    case = elastic_rig(NOMINAL, within_uncertainty(NOMINAL, np.random.default_rng(1)), levels, CONDITION, True)
    MODELS["reduced"](case).refuse(case)
    rig = case.rig
    assert (rig.driver.runout, rig.driven.runout) == levels.runout
    assert rig.driver.pitch_error == pytest.approx(levels.pitch[0]) and rig.friction.coefficient == levels.friction
    assert rig.driver.thinning + rig.driven.thinning == pytest.approx(60e-6 + levels.backlash_more)
    assert rig.sensors.encoder_runout_driven * DRIVEN_RADIUS == pytest.approx(levels.encoder[1])
    assert rig.sensors.delay_y_driver == levels.delay[2] and rig.sensors.noise_angle == 0.0
    assert rig.drive.ripple is not None
    assert rig.drive.ripple.amplitude == pytest.approx(levels.ripple * CONDITION.experiment.torque_mean)
    spring, driver = rig.drive.coupling, rig.driver.inertia
    assert spring is not None and spring.stiffness and driver
    reduced = spring.inertia * driver / (spring.inertia + driver)
    assert sqrt(spring.stiffness / reduced) / (2 * pi) == pytest.approx(levels.coupling_frequency)
    assert "tooth-crack" not in REPRESENTED


def test_run_out_stands_in_the_transmission_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of the run-out, at the driver's order 1 (whoever simulates; finite elements would take minutes)."""
    monkeypatch.setattr(elastic, "simulate", lambda case, model, workers: simulate(case, "lumped", workers=workers))
    bench, lines = short_bench(), []
    for runout in (0.0, 16e-6):
        levels = replace(quiet(drawn_levels()), runout=(runout, 0.0), runout_phase=(0.3, 0.0))
        record = measure_elastic(bench, NOMINAL, levels, CONDITION, False, "x", np.random.default_rng(1))
        radii = record.attrs["base_radius_driver"], record.attrs["base_radius_driven"]
        error = radii[0] * record["angle_driver"].values[0] - radii[1] * record["angle_driven"].values[0]
        error = (
            error + np.cos(record.attrs["working_pressure_angle"]) * (record["y_driver"] - record["y_driven"]).values[0]
        )
        samples = CONDITION.experiment.samples_per_period
        assert samples is not None
        # Sixty teeth a period: three turns of the driver.
        lines.append(2 * np.fft.rfft(error[:samples] - error[:samples].mean())[3] / samples)
    assert abs(lines[1] - lines[0]) == pytest.approx(8e-6, rel=0.1)
