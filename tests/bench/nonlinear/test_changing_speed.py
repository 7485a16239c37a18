"""Run-ups of the non-linear lumped model: against the same rig in absolute angles, balances of momentum, and the steady
answers that a slow run-up passes through."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from shared.rectangular import RECTANGULAR

from gearbench.bench import BenchError, simulate
from gearbench.bench.nonlinear.run import make_setup
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import schedule
from gearbench.bench.sweep import sweep
from gearbench.cases import case_path
from gearbench.rig import Case, read_case

Array = NDArray[np.float64]

SETTINGS = (
    *RECTANGULAR,
    "simulation.stiffness_edge=0.3",
    "rig.support.stiffness_n_per_m=1e9",
    "rig.support.damping_n_s_per_m=1e4",
    'rig.support.direction="line-of-action"',
    "rig.load.boundary=speed",
)
INERTIA, RADIUS, MASS = 3.6025e-3, 0.062 * np.cos(pi / 9), 1.736
HELD = ("rig.drive.boundary=speed", "rig.load.boundary=torque")
SHAFT = "{inertia_kg_m2=2e-3, stiffness_nm_per_rad=2e4, damping_nm_s_per_rad=2.0}"


def make_case(*settings: str, samples: int = 4096, rate: float = 32768.0) -> Case:
    """The settings may replace the whole experiment."""
    timing = (f"experiment.samples_per_period={samples}", f"experiment.sampling_rate_hz={rate}", "experiment.periods=1")
    return read_case(case_path("rig_62"), [*SETTINGS, "rig.damping.mesh_ratio=0.05", *timing, *settings])


def _steps(knots: Array, speeds: Array) -> tuple[Array, Array]:
    """Instants and slopes of a piecewise linear speed, as a function with steps."""
    slopes = np.diff(speeds) / np.diff(knots)
    return np.repeat(knots, 2)[1:-1], np.repeat(slopes, 2)


def test_absolute_angles_give_the_same_motion() -> None:
    """The equations of both gears in the angles themselves: nothing in them knows of an accelerated frame."""
    table = "speed_table={time_s=[0.002, 0.008, 0.012], driver_rpm=[300, 1200, 800]}"
    timing = "sampling_rate_hz=32768, samples_per_period=512"
    soft = "rig.support.stiffness_n_per_m=1e8"
    case = make_case(soft, f"experiment={{{table}, torque_mean_nm=150, {timing}}}")
    setup = make_setup(case, schedule(case.experiment, case.rig))
    record, law = simulate(case, "lumped"), setup.model.law
    phases = np.linspace(0.0, 1.0, 4097)
    rigid = np.asarray(law.evaluate(1e-5, phases % 1.0)[0]) / 1e-5  # rectangular: linear in the deflection
    knots = np.array([0.0, 0.002, 0.008, 0.012, 0.1])
    speeds = np.array([300.0, 300.0, 1200.0, 800.0, 800.0]) * pi / 30
    turned = np.concatenate([[0.0], np.cumsum(np.diff(knots) * (speeds[1:] + speeds[:-1]) / 2)])

    def nominal(t: float) -> tuple[float, float]:
        k = max(int(np.searchsorted(knots, t)) - 1, 0)
        slope = (speeds[k + 1] - speeds[k]) / (knots[k + 1] - knots[k])
        return float(turned[k] + (t - knots[k]) * (speeds[k] + slope * (t - knots[k]) / 2)), float(
            speeds[k] + slope * (t - knots[k])
        )

    def mesh(t: float, theta: float, rate: float, y: float, vy: float) -> float:
        angle, speed = nominal(t)
        delta, closing = RADIUS * (theta - angle) + y, RADIUS * (rate - speed) + vy
        stiffness = float(np.interp(angle * 62 / (2 * pi) % 1.0, phases, rigid))
        force, slope = stiffness * delta, stiffness
        return force + 2 * 0.05 * np.sqrt(slope * INERTIA / RADIUS**2) * closing

    def rates(t: float, q: Array) -> list[float]:
        theta, y1, y2, v, v1, v2 = q
        f = mesh(t, theta, v, y1 - y2, v1 - v2)
        pulls = [-1e8 * y1 - 1e4 * v1 - f, -1e8 * y2 - 1e4 * v2 + f]
        return [v, v1, v2, (150.0 - RADIUS * f) / INERTIA, *(pull / MASS for pull in pulls)]

    first = {name: float(record[name].values[0, 0]) for name in ("angle_driver", "y_driver", "y_driven")}
    # The record begins in the steady motion; rates there from the model's own outputs, a sample before and behind.
    time = record["time"].values
    begin = setup.at_rest(150.0 / RADIUS, -8192)
    state, _ = setup.advance(setup.drive(Torque(150.0)), begin, 8192)
    half = len(state.values) // 2
    u1, y1, y2 = state.values[:3]
    v1, w1, w2 = state.values[half : half + 3]
    start = [u1 / RADIUS, y1, y2, v1 / RADIUS + speeds[0], w1, w2]
    assert start[:3] == pytest.approx(list(first.values()), rel=2e-3)
    found = solve_ivp(rates, (0.0, time[-1]), start, "DOP853", t_eval=time, rtol=1e-6, atol=1e-12, max_step=1e-4).y
    angle = record["angle_driver"].values[0]
    swing = angle - np.array([nominal(t)[0] for t in time])
    departure = found[0] - angle
    assert np.abs(departure).max() < 5e-3 * np.ptp(swing)
    force = [mesh(t, q[0], q[3], q[1] - q[2], q[4] - q[5]) for t, q in zip(time, found.T, strict=True)]
    slope = np.interp(time, *_steps(knots, speeds))
    expected = RADIUS * np.array(force) - INERTIA * slope
    inside = np.min(np.abs(time[:, None] - knots), axis=1) > 1e-4
    torque = record["torque_driven"].values[0]
    assert np.abs(torque - expected)[inside].max() < 5e-3 * np.ptp(expected)


FREE = "rig.load.boundary=torque"


@pytest.mark.parametrize(
    "model_settings",
    [
        (),
        HELD,
        (FREE,),
        (f"rig.load.coupling={SHAFT}",),
        (*HELD, f"rig.drive.coupling={SHAFT}"),
        (FREE, f"rig.drive.coupling={SHAFT}"),
        (FREE, f"rig.load.coupling={SHAFT}"),
    ],
)
def test_torques_at_both_ends_speed_up_all_inertias(model_settings: tuple[str, ...]) -> None:
    case = make_case("experiment.speed_driver_rpm=600", "experiment.speed_end_rpm=3000", *model_settings)
    record = simulate(case, "lumped")
    driver, driven = (record[f"torque_{gear}"].values[0] for gear in ("driver", "driven"))
    gained = 2400 * pi / 30
    inertia = 2 * INERTIA + (2e-3 if any("coupling" in one for one in model_settings) else 0.0)
    push = np.trapezoid(driver - driven, record["time"].values)
    assert push == pytest.approx(inertia * gained, rel=0.02)
    assert "mesh_period" not in record.attrs and "hunting_period" not in record.attrs
    phase = record["mesh_phase"].values[0]
    steady = "driver" if HELD[0] in model_settings else "driven"
    departure = record[f"angle_{steady}"].values[0] - phase * 2 * pi / 62
    held = "coupling" not in "".join(model_settings) and model_settings != (FREE,)
    # What is held turns as it is told to; what is free or behind a shaft stays near that.
    assert np.abs(departure).max() < (1e-12 if held else 2e-2)
    duration = record["time"].values[-1]
    assert phase[-1] == pytest.approx(62 / 60 * 1800 * duration, rel=1e-12)


def test_friction_knows_the_speed_of_the_moment() -> None:
    """Where v0 is far above all sliding, friction is viscous: what it takes grows with the speed."""
    rough = ("rig.friction.coefficient=0.1", "rig.friction.transition_speed_m_per_s=10")
    ramp = ("experiment.speed_driver_rpm=60", "experiment.speed_end_rpm=240")

    def lost(*settings: str) -> Array:
        torques = [
            simulate(make_case(*settings, *more, samples=8192, rate=8192.0), "lumped")["torque_driven"].values[0]
            for more in ((), rough)
        ]
        return np.asarray(torques[0] - torques[1])

    slow = lost("experiment.speed_driver_rpm=60").mean()
    fast = lost(*ramp)[-1024:].mean()  # some thirty mesh periods
    assert fast / slow == pytest.approx((60 + 180 * 15 / 16) / 60, rel=0.05)


@pytest.mark.validation
def test_a_slow_run_up_passes_through_the_steady_answers() -> None:
    stiff = ("rig.support.stiffness_n_per_m=1e10", "rig.mesh.stiffness_scale=1.0001", "rig.damping.mesh_ratio=0.1")
    resonance = float(np.sqrt(3.1e8 / (INERTIA / RADIUS**2 / 2))) / 62 * 30 / pi
    rpm = np.array([0.8, 1.2]) * resonance
    bounds = (f"experiment.speed_driver_rpm={0.7 * resonance}", f"experiment.speed_end_rpm={1.3 * resonance}")
    record = simulate(make_case(*stiff, *bounds, samples=65536), "lumped")
    dte = record["dte"].values[0]
    found = sweep(make_case(*stiff, "experiment.speed_driver_rpm=60"), list(rpm * pi / 30), "lumped")
    speed = np.linspace(0.7, 1.3, dte.size) * resonance
    for number, middle in enumerate(rpm):
        near = dte[np.abs(speed - middle) < 0.01 * resonance]
        assert near.std() == pytest.approx(found["dte_rms"].values[:, number].mean(), rel=0.03)


def test_the_record_knows_its_noise_and_steps_but_no_delay() -> None:
    bounds = ("experiment.speed_driver_rpm=600", "experiment.speed_end_rpm=700")
    clean = simulate(make_case(*bounds), "lumped")
    coarse = simulate(make_case(*bounds, "rig.sensors.quantisation_angle_urad=50"), "lumped")
    steps = coarse["angle_driver"].values / 50e-6
    assert np.abs(steps - np.round(steps)).max() < 1e-6
    assert np.abs(coarse["angle_driver"].values - clean["angle_driver"].values).max() < 25.1e-6
    with pytest.raises(BenchError, match="the speed changes"):
        simulate(make_case(*bounds, "rig.sensors.delay_y_driver_us=10"), "lumped")
