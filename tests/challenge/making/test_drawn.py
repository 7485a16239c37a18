"""Nominal rigs drawn at random, truth rigs in their size, and truth rigs around records that were measured."""

from __future__ import annotations

from dataclasses import replace
from math import lcm, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from shared.truth_plants import CASES, drawn_levels, short_bench

from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.plan.schedule import schedule
from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.making.around import Measured, mix_of, nominal_under
from gearbench.challenge.making.cases import nominal_stiffness
from gearbench.challenge.making.drawn import NOISE, drawn_nominal, tooth_numbers
from gearbench.challenge.making.nominal import nominal_text
from gearbench.challenge.truth.levels import DELAYED
from gearbench.challenge.truth.measure import measure
from gearbench.challenge.truth.rigs import build_plant, check_nominal, conditions_of, make_bench
from gearbench.challenge.truth.scale import STIFFNESS, Scale, scale_of
from gearbench.challenge.truth.structure import FAMILIES, draw_structure
from gearbench.geometry import pair
from gearbench.rig import read_case

BASE = read_case(CASES / "gap_demo.toml")


def test_families_share_no_rig() -> None:
    numbers = {family: set(tooth_numbers(family)) for family in FAMILIES}
    families = list(numbers)
    for one in families:
        assert len(numbers[one]) > 50 and any(a == b for a, b in numbers[one])
        assert all(numbers[one].isdisjoint(numbers[two]) for two in families if two != one)


@pytest.mark.parametrize("seed", range(12))
def test_a_drawn_rig_can_be_run_and_says_how_uncertain_it_is(seed: int) -> None:
    case = drawn_nominal(BASE, "test", np.random.default_rng(seed))
    check_nominal(case)
    rig, teeth = case.rig, (case.rig.driver.teeth, case.rig.driven.teeth)
    assert teeth in tooth_numbers("test")
    assert 2 <= len(case.conditions) <= 6 and case.conditions[-1].name == "held-out"
    for condition in case.conditions:
        plan = schedule(condition.experiment, rig)
        turned = plan.samples_per_period * plan.cycles_per_sample
        assert turned == pytest.approx(lcm(*teeth)) and condition.experiment.multisine is not None
    relative = dict(case.uncertainty)
    assert relative.keys() == BASE.uncertainty.keys()
    assert rig.driver.inertia is not None
    assert relative["rig.driver.inertia"] / rig.driver.inertia == pytest.approx(0.02)
    # In the size of its rig, the noise is between a fifth and ten times the demonstration's.
    radius = pair(rig).driver.base_radius
    louder = rig.sensors.noise_angle * radius / (1e-6 * 0.0282) / scale_of(case).length
    assert NOISE[0] <= louder * (1 + 1e-9) and louder <= NOISE[1] * (1 + 1e-9)


def test_some_rigs_swing_until_flanks_part() -> None:
    swings = []
    for seed in range(60):
        first, *_ = conditions_of(drawn_nominal(BASE, "calibration", np.random.default_rng(seed)))
        assert first.experiment.multisine is not None and first.experiment.multisine.amplitude is not None
        swings.append(first.experiment.multisine.amplitude / first.experiment.torque_mean)
    far = np.array(swings) > 0.5
    assert 0.1 < far.mean() < 0.4 and 0.8 < max(swings) <= 1.01 and min(swings) >= 0.249


def test_a_drawn_rig_is_written_and_read_again(tmp_path: Path) -> None:
    case = drawn_nominal(BASE, "development", np.random.default_rng(5))
    path = tmp_path / "nominal.toml"
    path.write_text(nominal_text(case), encoding="utf-8")
    assert read_case(path) == case


def test_sizes_of_effects_go_with_the_rig() -> None:
    """The demonstration has the scale 1; another one that of its deflection and of its mesh's resonance."""
    own = scale_of(BASE)
    assert (own.length, own.frequency) == pytest.approx((1.0, 1.0), abs=2e-3)
    case = drawn_nominal(BASE, "development", np.random.default_rng(1))
    meshing, scale = pair(case.rig), scale_of(case)
    k = STIFFNESS * meshing.face_width
    assert case.rig.driver.inertia is not None and case.rig.drive.coupling is not None
    mass = (case.rig.driver.inertia + case.rig.drive.coupling.inertia) / meshing.driver.base_radius**2
    assert scale.frequency == pytest.approx(sqrt(k / mass) / (2 * pi) / 1902.0)
    levels = drawn_levels(3)
    made = Scale(length=2.0, frequency=0.5).levels(levels)
    assert made.runout == pytest.approx([2 * size for size in levels.runout])
    assert np.asarray(made.pitch[0]) == pytest.approx(2 * levels.pitch[0])
    assert made.delay == pytest.approx([2 * late for late in levels.delay])
    assert made.coupling_frequency == pytest.approx(0.5 * levels.coupling_frequency)
    assert made.friction == levels.friction and np.array_equal(made.ripple, levels.ripple)
    told = Scale(2.0, 0.5).parameters({"sensor-delay": {"y_driver.delay": {"value": 10.0, "unit": "us"}}})
    assert told["sensor-delay"]["y_driver.delay"] == {"value": 20.0, "unit": "us"}


def test_a_plant_takes_over_the_lengths_and_rates_of_its_scale() -> None:
    bench, scale = short_bench(), Scale(length=2.0, frequency=0.5)
    rig, levels = draw_structure(bench.nominal, "calibration", np.random.default_rng(4)), drawn_levels(4)
    levels = replace(levels, foreign=replace(levels.foreign, damping_quadratic=1.0))
    experiment = conditions_of(bench.nominal)[0].experiment
    one = build_plant(bench, rig, levels, experiment)
    two = build_plant(replace(bench, scale=scale), scale.structure(rig), scale.levels(levels), experiment)
    assert two.teeth.reference == 2 * one.teeth.reference and two.teeth.damping_onset == 2 * one.teeth.damping_onset
    assert np.asarray(two.eccentricity) == pytest.approx(2 * np.asarray(one.eccentricity))
    # The same quadratic damping at a rate that goes with length and frequency: 2 x 0.5.
    assert two.teeth.damping_quadratic == pytest.approx(one.teeth.damping_quadratic)
    assert two.teeth.friction_speed == pytest.approx(one.teeth.friction_speed)
    # The same mass with the mode's frequency halved: a quarter of the stiffness.
    assert two.governor.stiffness == pytest.approx(0.25 * one.governor.stiffness)
    assert two.coupling.stiffness == pytest.approx(0.25 * one.coupling.stiffness)


def test_stiffness_of_the_analytic_law_is_what_the_law_says() -> None:
    """Against the static law by differences: more force over more deflection, mean over the mesh cycle."""
    case = read_case(CASES / "gap_demo.toml", ("simulation.mesh_stiffness=potential-energy",))
    law = mesh_law(case.rig, case.simulation, 200.0)
    force = 100.0 / pair(case.rig).driver.base_radius
    phase, deflections = np.arange(64) / 64, np.linspace(1e-6, 3e-5, 400)
    mean = np.array([law.evaluate(one, phase)[0].mean() for one in deflections])
    slope = np.gradient(mean, deflections)
    assert nominal_stiffness(case) == pytest.approx(float(np.interp(force, mean, slope)), rel=1e-3)


def test_measured_torque_is_what_drives_the_truth_rigs() -> None:
    bench = short_bench()
    time = np.arange(1200)
    torque = 80.0 + 11.0 * np.cos(2 * np.pi * 7 * time / 1200)
    record = Measured("mine", torque, 10240.0, 512.0)
    nominal = nominal_under(bench.nominal, [record], {"angle": 0.0, "displacement": 0.0, "torque": 0.0})
    check_nominal(nominal)
    assert nominal.conditions[0].experiment.torque_mean == pytest.approx(80.0)
    made = make_bench(nominal, bench.stiffness, None, {"mine": torque})
    rig = draw_structure(nominal, "calibration", np.random.default_rng(1))
    out = measure(made, rig, drawn_levels(1), nominal.conditions[0], "x", np.random.default_rng(0))
    assert out["torque_driver"].values[0] == pytest.approx(np.tile(torque, 2), abs=1e-9)
    assert set(DELAYED) < set(out.data_vars)


def test_a_calibration_holds_sound_foreign_and_withheld_rigs() -> None:
    mix = mix_of(12, 1)
    assert (mix.controls, mix.foreign, sum(mix.per_effect), mix.cases) == (4, 3, 5, 12)
    assert mix_of(36, 1).cases == 36 and min(mix_of(36, 1).per_effect) >= 1
    with pytest.raises(ChallengeError, match="at least 6"):
        mix_of(5, 1)
