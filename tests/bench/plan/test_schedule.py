"""Periods: what repeats when, and records that hold no whole number of mesh periods."""

from __future__ import annotations

from math import pi
from typing import Any

import pytest

from gearbench.bench import BenchError
from gearbench.bench.plan.schedule import schedule
from gearbench.rig import Experiment, Gear, Rig, Support, Supports


def make_rig() -> Rig:
    support = Support(stiffness=1e8)
    gear = {"module": 2e-3, "face_width": 0.02, "hub_radius": 0.015}
    return Rig(
        driver=Gear(teeth=62, **gear),
        driven=Gear(teeth=40, **gear),
        support=Supports(driver=support, driven=support),
    )


def make_experiment(**changes: Any) -> Experiment:
    values: dict[str, Any] = {
        "mesh_frequency": 20.0,
        "torque_mean": 10.0,
        "sampling_rate": 1000.0,
        "samples_per_period": 500,
        "periods": 4,
    }
    return Experiment(**{**values, **changes})


def test_mesh_periods_that_fit_the_excitation_period() -> None:
    plan = schedule(make_experiment(), make_rig())
    assert (plan.block_periods, plan.blocks, plan.mesh_cycles, plan.block_samples) == (1, 4, 10, 500)
    assert plan.mesh_frequency == pytest.approx(20.0)
    assert plan.speed_driver == pytest.approx(2 * pi * 20 / 62)
    assert plan.speed_driven == pytest.approx(2 * pi * 20 / 40)


@pytest.mark.parametrize(
    ("frequency", "block_periods", "cycles"), [(21.0, 2, 21), (20.5, 4, 41), (1.0, 2, 1), (0.5, 4, 1)]
)
def test_blocks_last_until_excitation_and_mesh_both_repeat(
    frequency: float, block_periods: int, cycles: int
) -> None:
    plan = schedule(make_experiment(mesh_frequency=frequency), make_rig())
    assert plan.block_periods == block_periods
    assert plan.mesh_cycles == cycles
    assert plan.block_periods * plan.blocks == 4
    assert plan.mesh_frequency == pytest.approx(frequency)


@pytest.mark.parametrize(
    ("frequency", "words"),
    [
        (20.3, r"record of 2 s .* holds 40.6 mesh periods at 20.3 Hz.*20 Hz and 20.5 Hz do"),
        (0.2, r"holds 0.4 mesh periods.*; 0.5 Hz does"),
    ],
)
def test_records_without_a_whole_number_of_mesh_periods_are_refused(frequency: float, words: str) -> None:
    with pytest.raises(BenchError, match=words):
        schedule(make_experiment(mesh_frequency=frequency), make_rig())


def test_rounded_speed_counts_as_the_whole_number_it_means() -> None:
    speed = 2 * pi * 20 / 62 * (1 + 1e-9)
    plan = schedule(make_experiment(mesh_frequency=None, speed_driver=speed), make_rig())
    assert plan.mesh_cycles == 10
    assert plan.mesh_frequency == pytest.approx(20.0, rel=1e-14)
