"""A rotation whose speed changes: its angle is the integral of its speed, found by quadrature."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from gearbench.bench import BenchError
from gearbench.bench.plan.excitation import comb_for
from gearbench.bench.plan.rotation import rotation_of
from gearbench.bench.plan.schedule import schedule
from gearbench.cases import case_path
from gearbench.rig import CaseError, dump_case, read_case

REST = "torque_mean_nm=200, sampling_rate_hz=16384, samples_per_period=8192"


def table(time: str, rpm: str) -> str:
    return f"experiment={{speed_table={{time_s=[{time}], driver_rpm=[{rpm}]}}, {REST}}}"


def test_the_angle_is_the_integral_of_the_speed() -> None:
    case = read_case(case_path("quick_lumped"), [table("0.1, 0.25, 0.4", "60, 300, 120")])
    found = rotation_of(case.experiment, case.rig)
    assert found is not None
    teeth = case.rig.driver.teeth
    # Before the table its first speed holds, behind it the last one; time 0 is the first sample.
    for time in (-0.3, 0.0, 0.05, 0.1, 0.2, 0.25, 0.3, 0.4, 0.9):
        turned = quad(lambda t: np.interp(t, [0.1, 0.25, 0.4], [60, 300, 120]) / 60, 0.0, time, points=[0.1, 0.25, 0.4])
        assert found.cycles(np.array([time]))[0] == pytest.approx(teeth * turned[0], abs=1e-12)
    assert found.highest == pytest.approx(teeth * 300 / 60)
    rates = found.acceleration(np.array([0.05, 0.1, 0.2, 0.25, 0.3, 0.5]))
    assert rates == pytest.approx(np.array([0.0, 0.0, 1600.0, 1600.0, -1200.0, 0.0]) * pi / 30)


def test_a_run_up_reaches_its_last_speed_with_the_last_sample() -> None:
    case = read_case(case_path("quick_lumped"), ["experiment.speed_end_rpm=90"])
    plan = schedule(case.experiment, case.rig)
    assert plan.rotation is not None and not plan.repeats and plan.blocks == 1
    last = (plan.record_samples - 1) / plan.sampling_rate
    assert plan.rotation.frequency(np.array([last]))[0] == pytest.approx(1.5 * case.rig.driver.teeth, rel=1e-14)
    assert plan.mesh_frequency == pytest.approx(20.0, rel=1e-14)
    assert plan.shortest_mesh_period == pytest.approx(1 / (1.5 * case.rig.driver.teeth))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["experiment.speed_end_rpm=1e6"], "must lie below half"),
        (["experiment.multisine.grid=comb"], "comb"),
    ],
)
def test_what_cannot_be_run_up_is_refused(settings: list[str], words: str) -> None:
    case = read_case(case_path("quick_lumped"), ["experiment.speed_end_rpm=90", *settings])
    with pytest.raises(BenchError, match=words):
        schedule(case.experiment, case.rig)
        comb_for(case.experiment, case.rig)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        (table("0, 1", "60"), "same number"),
        (table("0, 0", "60, 70"), "must rise"),
        (table("-1, 0", "60, 70"), "must rise"),
        (table("0, 1", "60, 0"), "greater than 0"),
        ("experiment.speed_table={time_s=[0, 1], driver_rpm=[60, 70]}", "exactly one of"),
        (table("0, 1", "60, 70").replace("{speed", "{speed_end_rpm=70, speed", 1), "belongs to"),
    ],
)
def test_speeds_are_checked(setting: str, words: str) -> None:
    with pytest.raises(CaseError, match=words):
        read_case(case_path("quick_lumped"), [setting])


def test_a_constant_speed_takes_the_place_of_a_changing_one() -> None:
    base = read_case(case_path("quick_lumped"), [table("0, 1", "60, 70")]).experiment
    for one in (base.at_speed(7.0), base.at_mesh_frequency(40.0)):
        assert not one.changes_speed and type(base)(**dict(one)) == one


def test_a_condition_may_have_a_speed_of_its_own(tmp_path: Path) -> None:
    text = dump_case(read_case(case_path("quick_lumped")))
    change = "speed_table = { time_s = [0.0, 0.1], driver_rpm = [60.0, 90.0] }"
    (tmp_path / "one.toml").write_text(f'{text}\n[[condition]]\nname = "up"\n{change}\n', encoding="utf-8")
    case = read_case(tmp_path / "one.toml")
    (condition,) = case.conditions
    assert condition.experiment.mesh_frequency is None and condition.experiment.changes_speed
    assert not case.experiment.changes_speed
