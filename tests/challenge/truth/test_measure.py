"""The truth rig on its bench: steps, delays, filter, noise, steady state."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from shared.truth_plants import drawn_levels, drawn_plant, short_bench

from gearbench.challenge.truth.levels import Foreign
from gearbench.challenge.truth.measure import (
    MARGIN,
    OVERSAMPLED,
    fastest_decay,
    filtered,
    measure,
    run_condition,
    sampled,
    steps_per_sample,
)
from gearbench.challenge.truth.plant import OUTPUTS
from gearbench.challenge.truth.rigs import conditions_of
from gearbench.challenge.truth.structure import draw_structure

Y_DRIVER, Y_DRIVEN, TORQUE, FORCE = (OUTPUTS.index(name) for name in ("y_driver", "y_driven", "torque_driven", "force"))
BENCH = short_bench()
CONDITION = conditions_of(BENCH.nominal)[0]
RIG = draw_structure(BENCH.nominal, "test", np.random.default_rng(1))
LEVELS = drawn_levels()
SILENT = replace(
    BENCH,
    nominal=BENCH.nominal.model_copy(
        update={
            "rig": BENCH.nominal.rig.model_copy(
                update={
                    "sensors": BENCH.nominal.rig.sensors.model_copy(
                        update={"noise_angle": 0.0, "noise_displacement": 0.0, "noise_torque": 0.0}
                    )
                }
            )
        }
    ),
)


def channel(record: object, name: str) -> np.ndarray:
    return np.asarray(record[name].values[0])  # type: ignore[index]


def test_halving_the_step_changes_less_than_the_noise() -> None:
    coarse, fine = (run_condition(BENCH, RIG, LEVELS, CONDITION, finer) for finer in (1, 2))
    rms = np.sqrt(((coarse.seen - fine.seen) ** 2).mean(axis=0))
    assert (rms[:4] < 0.1 * np.array([1e-6, 1e-6, 0.05e-6, 0.05e-6])).all()
    # The gears run ten times as fast as in the demonstration: the ends of the path come sudden.
    assert rms[TORQUE] < 0.002 * coarse.seen[:, TORQUE].std()


def test_second_period_repeats_the_first() -> None:
    run = run_condition(BENCH, RIG, LEVELS, CONDITION)
    period = CONDITION.experiment.samples_per_period * OVERSAMPLED
    begin = MARGIN * OVERSAMPLED
    one, two = run.seen[begin : begin + period], run.seen[begin + period : begin + 2 * period]
    swing = one.std(axis=0)
    # A tenth of a second settles everything but the governor.
    assert (np.abs(one - two).max(axis=0)[2:4] < 0.05 * swing[2:4]).all()


def test_forces_balance_in_the_mean() -> None:
    run = run_condition(BENCH, RIG, replace(LEVELS, friction=0.0), CONDITION)
    torque = run.command.mean()
    assert run.seen[:, TORQUE].mean() == pytest.approx(torque * 1.5, rel=0.02)
    assert run.seen[:, FORCE].mean() == pytest.approx(torque / BENCH.meshing.driver.base_radius, rel=0.02)
    assert run.seen[:, Y_DRIVER].mean() < 0 < run.seen[:, Y_DRIVEN].mean()


@pytest.mark.parametrize("side", [0, 1])
def test_an_encoder_reads_ahead_once_a_turn_and_nothing_else_moves(side: int) -> None:
    name, other = ("angle_driver", "angle_driven")[:: 1 - 2 * side]
    radius = (BENCH.meshing.driver.base_radius, BENCH.meshing.driven.base_radius)[side]
    size, phase = [0.0, 0.0], [0.0, 0.0]
    size[side], phase[side] = 5e-6, 0.9
    plain, shown = (
        measure(SILENT, RIG, replace(LEVELS, encoder=(a, b), encoder_phase=(phase[0], phase[1])), CONDITION, "x",
                np.random.default_rng(1))
        for a, b in ((0.0, 0.0), size)
    )  # fmt: skip
    turned = channel(plain, name)
    assert channel(shown, name) - turned == pytest.approx(5e-6 / radius * np.cos(turned - 0.9), abs=1e-12)
    for rest in (other, "y_driver", "y_driven", "torque_driven"):
        assert (channel(shown, rest) == channel(plain, rest)).all()


@pytest.mark.parametrize("name", ["angle_driver", "angle_driven", "y_driver", "y_driven"])
def test_a_delayed_channel_lags_and_no_other_does(name: str) -> None:
    names = ("angle_driver", "angle_driven", "y_driver", "y_driven")
    late = tuple(1 / 10240 if other == name else 0.0 for other in names)
    on_time, delayed = (
        measure(SILENT, RIG, replace(LEVELS, delay=d), CONDITION, "x", np.random.default_rng(0))
        for d in ((0.0,) * 4, late)
    )
    for other in (*names, "torque_driver", "torque_driven"):
        a, b = channel(on_time, other), channel(delayed, other)
        if other == name:
            assert b[1:] == pytest.approx(a[:-1], rel=1e-9, abs=1e-12)
        else:
            assert (a == b).all()


def test_noise_is_that_of_the_nominal_sensors() -> None:
    noisy, silent = (measure(b, RIG, LEVELS, CONDITION, "x", np.random.default_rng(0)) for b in (BENCH, SILENT))
    for name, rms in (("angle_driven", 1e-6), ("y_driver", 0.05e-6), ("torque_driver", 0.02), ("torque_driven", 0.02)):
        noise = channel(noisy, name) - channel(silent, name)
        assert noise.std() == pytest.approx(rms, rel=0.06)
        half = noise.size // 2
        assert abs(np.corrcoef(noise[:half], noise[half:])[0, 1]) < 0.1


def test_record_says_nothing_but_the_challenge() -> None:
    record = measure(BENCH, RIG, LEVELS, CONDITION, "abc", np.random.default_rng(0))
    assert json.loads(record.attrs["provenance"]) == {"challenge": "abc"}
    assert record.attrs["inertia_driver"] == BENCH.nominal.rig.driver.inertia
    assert set(record.data_vars) == {
        *("torque_driver", "torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven")
    }


@pytest.mark.parametrize("order", [1, 2])
def test_filter_halves_the_power_at_its_corner(order: int) -> None:
    n, period = 4096, 0.5
    t = np.arange(n) / n
    line = 400
    corner = line / period
    signal = 3.0 + np.cos(2 * np.pi * line * t) + np.cos(2 * np.pi * 5 * t)
    seen = np.fft.rfft(filtered(signal, Foreign(filter_frequency=corner, filter_order=order), period)) / n
    assert seen[0] == pytest.approx(3.0)
    assert abs(2 * seen[5]) == pytest.approx(1.0, abs=1e-3)
    assert abs(2 * seen[line]) == pytest.approx(np.sqrt(0.5), rel=1e-9)
    assert np.angle(seen[line]) == pytest.approx(-order * np.pi / 4)


@pytest.mark.parametrize("acting", [False, True])
def test_filter_is_on_the_recorded_or_on_the_acting_torque(acting: bool) -> None:
    foreign = Foreign(filter_frequency=700.0, filter_order=1, filter_acting=acting)
    plain, run = (run_condition(BENCH, RIG, replace(LEVELS, foreign=f), CONDITION) for f in (Foreign(), foreign))
    assert bool(run.command.std() < 0.95 * plain.command.std()) is not acting
    assert bool(np.abs(run.seen[:, TORQUE] - plain.seen[:, TORQUE]).max() > 1.0) is acting


def test_drift_is_none_at_the_start_and_grows() -> None:
    drifting = replace(LEVELS, drift=(0.0, 0.1, 0.0))
    plain, run = (run_condition(BENCH, RIG, levels, CONDITION) for levels in (LEVELS, drifting))
    change = np.abs(run.seen[:, Y_DRIVER] - plain.seen[:, Y_DRIVER])
    tenth = change.size // 10
    assert change[:tenth].mean() < 0.2 * change[-tenth:].mean()
    assert change[-tenth:].mean() == pytest.approx(0.1 * np.abs(plain.seen[-tenth:, Y_DRIVER]).mean(), rel=0.3)


def test_steps_follow_stiffness_and_damping() -> None:
    plant = drawn_plant()
    assert steps_per_sample(plant, 10240.0) % OVERSAMPLED == 0
    damped = plant._replace(teeth=plant.teeth._replace(damping_quadratic=1e-3))
    assert steps_per_sample(damped, 10240.0) > 2 * steps_per_sample(plant, 10240.0)
    assert fastest_decay(damped) > fastest_decay(plant)


def test_what_lies_beyond_half_the_sampling_rate_is_not_folded_in() -> None:
    """Sines beyond half the sampling rate, 1 a second, beside one below it and a large mean."""
    count = OVERSAMPLED * (200 + 2 * MARGIN)
    time = np.arange(count) / OVERSAMPLED - MARGIN
    low = 3e4 + np.sin(2 * np.pi * 0.13 * time + 0.4)
    for frequency, left in ((0.56, 2e-4), (0.9, 2e-4), (1.13, 2e-4), (1.87, 2e-4)):
        found = sampled(low + np.sin(2 * np.pi * frequency * time))
        assert found.shape == (200,)
        assert found == pytest.approx(low[MARGIN * OVERSAMPLED : -MARGIN * OVERSAMPLED : OVERSAMPLED], abs=left)
