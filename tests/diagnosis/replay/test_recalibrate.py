"""Recalibration on a rig of three independent oscillators, whose spectra are closed forms of its numbers."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians

import numpy as np
import pytest
import xarray as xr
from shared.measured import RATE, SAMPLES, channels, nominal, record

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.replay.adjustable import Adjustable, Simulate, at_path, uncertain, variants
from gearbench.diagnosis.replay.recalibrate import recalibrate
from gearbench.rig import Case

LINES = np.arange(31, 3600, 60)
PATHS = {
    "rig.support.driver.stiffness": (1e7, 1.13e8),
    "rig.support.driven.stiffness": (1e7, 0.88e8),
    "rig.support.driver.damping": (1e3, 2.4e3),
    "rig.mesh.stiffness_scale": (0.06, 1.08),
    "rig.damping.mesh_ratio": (0.02, 0.071),
}


def excitation() -> np.ndarray:
    phases = np.random.default_rng(1).uniform(0, 2 * pi, LINES.size)
    time = np.arange(SAMPLES) / RATE
    return 100 + 5 * sum(
        np.cos(2 * pi * line * RATE / SAMPLES * time + phase) for line, phase in zip(LINES, phases, strict=True)
    )


def answer(case: Case, torque: np.ndarray) -> dict[str, np.ndarray]:
    """Each channel an oscillator of its own: supports with 2 and 3 kg, mesh with 3 kg on 3e8 N/m."""
    rig, w = case.rig, 2 * pi * np.fft.rfftfreq(SAMPLES, 1 / RATE)
    radius = 0.03 * cos(radians(20))
    force = np.fft.rfft(torque) / radius
    one, two = rig.support.driver, rig.support.driven
    stiff = 3e8 * rig.mesh.stiffness_scale
    mesh = stiff + 2j * w * rig.damping.mesh_ratio * np.sqrt(stiff * 3.0)
    quasi = channels(noise=0.0)
    steady = {name: 2 * pi * quasi["mesh_phase"][:SAMPLES] / teeth for name, teeth in (("driver", 20), ("driven", 30))}
    spectra = {
        "y_driver": -force / (one.stiffness - 2.0 * w**2 + 1j * w * one.damping),
        "y_driven": force / (two.stiffness - 3.0 * w**2 + 1j * w * two.damping),
        "torque_driven": 1.5 * radius * force * mesh / (mesh - 3.0 * w**2),
        "angle_driver": force / (mesh - 3.0 * w**2) / radius,
    }
    found = {name: np.fft.irfft(values, SAMPLES) for name, values in spectra.items()}
    found["angle_driver"] += steady["driver"]
    phase = quasi["mesh_phase"][:SAMPLES]
    return {**found, "angle_driven": steady["driven"], "mesh_phase": phase, "torque_driver": torque}


def simulate(case: Case, given: xr.Dataset) -> xr.Dataset:
    torque = given["torque_driver"].values[0].reshape(-1, SAMPLES).mean(axis=0)
    return record(answer(case, torque), periods=1)


def truth() -> Case:
    case = nominal()
    for path, (sd, value) in PATHS.items():
        case = at_path(path, sd).set(case, value)
    return case


def measured(noise: float = 0.0, disturbance: np.ndarray | float = 0.0, seed: int = 0) -> Measurement:
    one = answer(truth(), excitation())
    one["y_driver"] = one["y_driver"] + disturbance
    draw = np.random.default_rng(seed)
    rms = {"y": 5e-8, "angle": 1e-6, "torque": 0.02, "mesh": 0.0}
    turn = {"angle_driver": 6 * pi, "angle_driven": 4 * pi, "mesh_phase": 60.0}
    values = {
        name: np.concatenate([value, value + turn.get(name, 0.0)])
        + noise * rms[name.split("_")[0]] * draw.normal(size=2 * SAMPLES)
        for name, value in one.items()
    }
    return measurement(record(values), "base", nominal())


PARAMETERS = tuple(at_path(path, sd) for path, (sd, _) in PATHS.items())
TRUE = np.array([value for _, value in PATHS.values()])


def test_true_numbers_come_back() -> None:
    found = recalibrate(nominal(), PARAMETERS, [measured()], simulate)
    assert found.values == pytest.approx(TRUE, rel=1e-3)
    assert found.names == tuple(PATHS)
    for path, value in zip(PATHS, found.values, strict=True):
        assert at_path(path, 1.0).get(found.case) == value
    costs = [found.cost_before, *found.history]
    assert costs == sorted(costs, reverse=True) and found.history[-1] == found.cost_after
    assert found.cost_after < found.cost_before - 100
    assert len(found.history) <= 6


def test_noise_stays_within_the_stated_deviations() -> None:
    # A block counts as at most eight lines, so the stated deviations are on the safe side.
    for seed in range(3):
        found = recalibrate(nominal(), PARAMETERS, [measured(noise=1.0, seed=seed)], simulate)
        assert (np.abs(found.values - TRUE) < 3 * found.std).all()
        assert (found.std < 0.5 * np.array([sd for sd, _ in PATHS.values()])).all()


def test_what_the_model_cannot_explain_loses_its_weight() -> None:
    # Every tenth shaft order up to the end of the band, 2 um each, on the support: lines of the rotation.
    time = np.arange(SAMPLES) / RATE
    runout = sum(2e-6 * np.cos(2 * pi * 25 * order * time) for order in range(1, 120))
    found = recalibrate(nominal(), PARAMETERS, [measured(disturbance=runout)], simulate)
    assert found.values == pytest.approx(TRUE, rel=5e-3)
    # The excited lines keep theirs: what they say of the support is as good as without run-out.
    clean = recalibrate(nominal(), PARAMETERS, [measured()], simulate)
    assert found.std[0] < 1.2 * clean.std[0]


def test_the_prior_holds_what_no_record_tells() -> None:
    silent = at_path("rig.driver.inertia", 6e-6)
    fixed = replace(at_path("rig.driven.inertia", 3e-5), mean=1.53e-3)  # one sd above the start
    found = recalibrate(nominal(), (*PARAMETERS, silent, fixed), [measured()], simulate)
    assert found.values[-2] == pytest.approx(3e-4, rel=1e-9) and found.std[-2] == pytest.approx(6e-6)
    assert found.values[-1] == pytest.approx(1.53e-3, rel=1e-6) and found.std[-1] == pytest.approx(3e-5)


def test_cost_and_deviation_of_a_gain_in_closed_form() -> None:
    # The rig's only number is the gain of y_driver, and its replay is a tenth too large.
    gain = Adjustable("gain", lambda case: case.rig.mesh.stiffness_scale, PARAMETERS[3].set, 0.05)

    def scaled(case: Case, given: xr.Dataset) -> xr.Dataset:
        made = simulate(nominal(), given)
        made["y_driver"] = made["y_driver"] * (1.1 * case.rig.mesh.stiffness_scale)
        return made

    one = measurement(record({k: np.concatenate([v, v + t]) for k, v, t in _rows()}), "base", nominal())
    found = recalibrate(nominal(), [gain], [one], scaled)
    assert found.values[0] == pytest.approx(1 / 1.1, rel=1e-4)
    # Per band, y_driver's part r of the energies of y_driver (1) and DTE; no noise: s^2 = 1e-4 level^2, n = 8.
    rows = {name: np.abs(np.fft.rfft(values[0])) ** 2 for name, values in measured_channels(one).items()}
    frequency = np.fft.rfftfreq(SAMPLES, 1 / RATE)
    cost, information = 0.0, 0.0
    for low, high in ((0.0, 200.0), (200.0, 1000.0), (1000.0, 3000.0)):
        band = (frequency > low) & (frequency <= high)
        for part in (1.0, cos(radians(20)) ** 2 * rows["y_driver"][band].sum() / rows["dte"][band].sum()):
            cost += 2 * 8 * np.log(1 + 0.1**2 * part / 1e-4)
            information += 2 * 8 * 1.1**2 * part / 1e-4
    assert found.cost_before == pytest.approx(cost, rel=1e-6)
    assert 1 / found.covariance[0, 0] == pytest.approx(information + 1 / 0.05**2, rel=1e-3)


def _rows() -> list[tuple[str, np.ndarray, float]]:
    turn = {"angle_driver": 6 * pi, "angle_driven": 4 * pi, "mesh_phase": 60.0}
    return [(name, value, turn.get(name, 0.0)) for name, value in answer(nominal(), excitation()).items()]


def test_bounds_and_failing_rigs_are_respected() -> None:
    limited = replace(PARAMETERS[0], high=1.05e8)

    def fragile(case: Case, given: xr.Dataset) -> xr.Dataset:
        if case.rig.support.driven.stiffness < 0.93e8:
            raise ValueError("no equilibrium")
        return simulate(case, given)

    found = recalibrate(nominal(), (limited, *PARAMETERS[1:]), [measured()], fragile)
    assert found.values[0] <= 1.05e8 * (1 + 1e-12)
    assert found.case.rig.support.driven.stiffness >= 0.93e8
    assert found.cost_after < found.cost_before


def test_a_perfect_start_does_not_move() -> None:
    found = recalibrate(truth(), PARAMETERS, [measured()], simulate)
    assert found.cost_after <= found.cost_before
    assert found.values == pytest.approx(TRUE, rel=1e-6)


def test_nothing_to_do_is_refused() -> None:
    with pytest.raises(DiagnosisError, match="at least one parameter and one record"):
        recalibrate(nominal(), [], [measured()], simulate)
    with pytest.raises(DiagnosisError, match=r"gain: sd = 0 must be positive"):
        Adjustable("gain", lambda case: 0.0, lambda case, value: case, 0.0)


# ---- adjustable numbers


def test_paths_read_and_set_without_touching_anything_else() -> None:
    case = nominal()
    moved = at_path("rig.drive.coupling.inertia", 4e-5).set(case, 2.5e-3)
    assert moved.rig.drive.coupling is not None and moved.rig.drive.coupling.inertia == 2.5e-3
    assert at_path("rig.drive.coupling.inertia", 4e-5).set(moved, 2e-3) == case
    errors = case.model_copy(
        update={
            "rig": case.rig.model_copy(
                update={"driver": case.rig.driver.model_copy(update={"pitch_error": tuple([0.0] * 20)})}
            )
        }
    )
    third = at_path("rig.driver.pitch_error.3", 1e-6).set(errors, 2e-6)
    assert third.rig.driver.pitch_error == (0.0, 0.0, 0.0, 2e-6, *([0.0] * 16))
    with pytest.raises(ValueError, match="greater than"):
        at_path("rig.support.driver.stiffness", 1.0).set(case, -1.0)
    with pytest.raises(DiagnosisError, match=r"no number at rig\.drive\.ripple\.orders"):
        at_path("rig.drive.ripple.orders", 1.0).get(case)


def test_uncertain_numbers_are_those_with_a_deviation() -> None:
    loose = nominal().model_copy(update={"uncertainty": {**nominal().uncertainty, "experiment.torque_mean": 1.0}})
    found = {one.name: (one.get(nominal()), one.sd) for one in uncertain(loose)}
    assert found["rig.support.driver.stiffness"] == (1e8, 1e7)
    assert found["rig.mesh.stiffness_scale"] == (1.0, 0.06)
    assert len(found) == 9


def test_variants_move_one_number_at_a_time_by_its_deviation() -> None:
    seen: list[tuple[float, float]] = []

    def note(case: Case, given: xr.Dataset) -> xr.Dataset:
        seen.append((case.rig.support.driver.stiffness, case.rig.mesh.stiffness_scale))
        return simulate(case, given)

    simulator: Simulate = note
    upper = replace(PARAMETERS[3], high=1.0)  # up is out of bounds: down
    found = variants(nominal(), [measured(), measured()], [PARAMETERS[0], upper], simulator)
    assert seen == [(1.1e8, 1.0)] * 2 + [(1e8, 0.94)] * 2
    assert [len(one) for one in found] == [2, 2]
    assert set(found[0][0]) == set(measured_channels(measured()))
