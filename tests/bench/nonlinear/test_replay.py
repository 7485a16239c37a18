"""Replays against the simulation that made the record, and the phase, torque and delays they start from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from shared.small_case import small_case

from gearbench.bench import BenchError, simulate
from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.nonlinear.replay import replay, seen_at
from gearbench.bench.record.sensors import resampled
from gearbench.records import make_record, validate_record
from gearbench.rig import (
    Case,
    Coupling,
    Crack,
    Drive,
    Friction,
    Ripple,
    Sensors,
)

SAMPLES, RATE = 1536, 5120.0
CHANNELS = ("torque_driver", "torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven", "dte")


def make_case(**rig: Any) -> Case:
    values: dict[str, Any] = {
        "drive": Drive(
            coupling=Coupling(inertia=2e-3, stiffness=3e4, damping=1.0),
            ripple=Ripple(orders=(7,), amplitude=(1.0,), phase=(0.4,)),
        ),
        "friction": Friction(coefficient=0.05),
    }
    return small_case(
        {"inertia": 4e-4, "runout": 6e-6, "crack": Crack(tooth=4, stiffness_loss=0.4)},
        {"pitch_error": (4e-6, *(0.0,) * 29)},
        {"realisations": 2, "settling_tolerance": 1e-8, "settling_periods_max": 50},
        **values | rig,
    )


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case()


@pytest.fixture(scope="module")
def record(case: Case) -> xr.Dataset:
    return simulate(case)


def differs(found: xr.Dataset, record: xr.Dataset, start: int = 0, row: int = 0) -> float:
    """Largest departure from one period of the record from sample `start`, over each channel's range."""
    stop = start + found.sizes["time"]
    worst = 0.0
    for name in CHANNELS:
        expected = record[name].values[row, start:stop]
        worst = max(worst, float(np.abs(found[name].values[0] - expected).max() / max(np.ptp(expected), 1e-12)))
    return worst


def test_a_replay_is_one_period_of_the_simulation(case: Case, record: xr.Dataset) -> None:
    law = mesh_law(case.rig, case.simulation, 200.0)
    found = replay(case, record, law)
    validate_record(found)
    assert found.sizes["time"] == SAMPLES
    assert found.attrs["settling_residual"] < 1e-4
    assert differs(found, record) < 1e-5
    assert differs(replay(case, record, law, realisation=1), record, row=1) < 1e-5
    assert differs(replay(case, record, law, realisation=1), record, row=0) > 1e-2
    np.testing.assert_allclose(found["mesh_phase"].values[0], record["mesh_phase"].values[0, :SAMPLES], atol=1e-9)


def test_gears_that_swing_begin_where_they_turn_to(case: Case, record: xr.Dataset) -> None:
    """A mesh phase that was made of the angles of gears which a load lets swing, forty times a repetition."""
    law = mesh_law(case.rig, case.simulation, 200.0)
    steady = record["mesh_phase"]
    swing = 0.1 * np.sin(2 * np.pi * 40 * np.arange(record.sizes["time"]) / SAMPLES + 0.7)
    found = replay(case, record.assign(mesh_phase=steady + swing), law)
    np.testing.assert_allclose(found["mesh_phase"].values[0], steady.values[0, :SAMPLES], atol=1e-9)
    assert differs(found, record) < 1e-5


def cut(record: xr.Dataset, start: int, drop: tuple[str, ...] = (), **attributes: Any) -> xr.Dataset:
    """One period of a record from sample `start`."""
    keep = {str(n): record[n].values[:, start : start + SAMPLES] for n in record.data_vars if n not in drop}
    return make_record(keep, {**record.attrs, "periods": 1, **attributes})


@pytest.mark.parametrize("drop", [(), ("mesh_phase",)])
def test_a_record_may_begin_anywhere(case: Case, record: xr.Dataset, drop: tuple[str, ...]) -> None:
    # Not between teeth, and not with tooth 0.
    start = 1017
    found = replay(case, cut(record, start, drop))
    assert differs(found, record, start) < 1e-5
    assert found["mesh_phase"].values[0, 0] == pytest.approx(start * 200 / RATE, rel=1e-9)


def test_the_mean_of_the_periods_is_replayed(case: Case, record: xr.Dataset) -> None:
    noisy = record.copy(deep=True)
    noise = 3.0 * np.random.default_rng(0).standard_normal(SAMPLES)
    noisy["torque_driver"].values[0] += np.concatenate([noise, -noise])
    assert differs(replay(case, noisy), record) < 1e-5


def test_late_sensors_show_what_they_recorded() -> None:
    sensors = Sensors(delay_torque_driver=80e-6, delay_angle_driven=-50e-6, delay_y_driver=30e-6)
    case = make_case(sensors=sensors)
    seen = simulate(case)
    assert differs(replay(case, seen), seen) < 1e-5
    assert differs(replay(case, cut(seen, 100, ("mesh_phase",))), seen, 100) < 1e-4
    # Without the delays the torque acts at another time.
    assert differs(replay(make_case(), seen), seen) > 1e-3


def test_noise_of_the_rig_is_not_replayed(case: Case, record: xr.Dataset) -> None:
    noisy = make_case(sensors=Sensors(noise_angle=1e-5, noise_displacement=1e-6, noise_torque=1.0))
    assert differs(replay(noisy, record), record) < 1e-5


def test_a_sensor_shows_what_lies_below_half_its_rate() -> None:
    fine, at = 2 * np.pi * np.arange(96) / 96, 2 * np.pi * np.arange(16) / 16
    below, beyond = (lambda x: 2.0 + np.cos(3 * x) - np.sin(7 * x)), (lambda x: 5.0 * np.cos(13 * x) + np.sin(40 * x))
    found = seen_at(np.stack([below(fine) + beyond(fine), beyond(fine)]), 16)
    assert found == pytest.approx(np.stack([below(at), 0.0 * at]), abs=1e-12)


def test_a_measured_torque_holds_nothing_from_beyond_half_its_rate(case: Case, record: xr.Dataset) -> None:
    """Against the lines of a simulation that is sampled eight times as fast."""
    faster = case.experiment.model_copy(update={"sampling_rate": 8 * RATE, "samples_per_period": 8 * SAMPLES})
    fine = simulate(case.model_copy(update={"experiment": faster}))["torque_driven"].values[0]
    measured = record.copy()
    del measured.attrs["model"]

    def lines(torque: np.ndarray) -> np.ndarray:
        return np.asarray(np.fft.rfft(torque)[: SAMPLES // 4] / torque.size)

    found = replay(case, measured)["torque_driven"].values[0]
    wanted = lines(fine[-(8 * found.size) :])
    instants = lines(replay(case, record)["torque_driven"].values[0])
    folded = np.linalg.norm(instants - wanted)
    assert folded > 1e-4 * np.abs(wanted[0])
    assert np.linalg.norm(lines(found) - wanted) < 0.1 * folded


def test_a_torque_is_resampled_as_its_trigonometric_sum() -> None:
    time, fine = np.arange(64) / 64, np.arange(64 * 6) / (64 * 6)

    def torque(t: np.ndarray) -> np.ndarray:
        return np.asarray(
            5 + 3 * np.cos(2 * np.pi * 31 * t + 1) + np.sin(2 * np.pi * 2 * t) + 0.7 * np.cos(2 * np.pi * 32 * t)
        )

    np.testing.assert_allclose(resampled(torque(time), fine.size), torque(fine), atol=1e-12)
    odd, many = np.arange(63) / 63, np.arange(63 * 4) / (63 * 4)
    np.testing.assert_allclose(resampled(np.cos(62 * np.pi * odd), many.size), np.cos(62 * np.pi * many), atol=1e-12)


def test_records_that_say_too_little_are_refused(case: Case, record: xr.Dataset) -> None:
    with pytest.raises(BenchError, match="its mesh phase is unknown"):
        replay(case, cut(record, 0, ("mesh_phase",), mesh_phase_origin="arbitrary"))
    keep = {str(n): record[n].values[:, :1530] for n in record.data_vars}
    with pytest.raises(BenchError, match=r"holds 59\.7\d* mesh periods, which must be a whole number"):
        replay(case, make_record(keep, {**record.attrs, "periods": 1, "samples_per_period": 1530}))


@pytest.mark.parametrize(("friction", "part"), [(1e-4, 4 / 7), (0.05, 1.0)])
def test_steps_may_be_coarser_where_friction_bears_them(friction: float, part: float) -> None:
    """Fewer for the modes of a rig, with errors of the fourth order; as many where friction turns round in a step."""
    slow = {"mesh_frequency": 20.0, "settling_tolerance": 1e-8, "settling_periods_max": 50}
    case = small_case(None, None, slow, friction=Friction(coefficient=friction, transition_speed=1e-3))
    record = simulate(small_case(None, None, slow, {"substeps": 128}, friction=case.rig.friction))
    found = [replay(case, record, coarser=coarser) for coarser in (1.0, 1.75)]
    steps = [one.attrs["substeps"] for one in found]
    errors = [differs(one, record) for one in found]
    assert steps[1] == pytest.approx(part * steps[0])
    assert errors[1] / errors[0] == pytest.approx(part**-4, rel=0.3)
