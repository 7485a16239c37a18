"""Rotation that creeps against the excitation, against the same motion without that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.measured import MESH, SAMPLES, channels, nominal, record

from gearbench.diagnosis.intake.creeping import in_step
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.intake.signals import measured_channels

CYCLES = 60  # of the mesh in a repetition
BESIDE = np.setdiff1d(np.arange(CYCLES - 20, CYCLES + 20), [CYCLES])


def taken(
    creep: float = 0.0, periods: int = 3, noise: float = 0.0, ahead: np.ndarray | float = 0.0
) -> Measurement:
    """A rig whose mesh is ahead by `creep` cycles at the end of a record that says nothing of it, and besides by
    `ahead` (samples * periods,)."""
    values = channels(mesh=MESH * (1 + creep / (CYCLES * periods)), periods=periods, noise=noise, ahead=ahead)
    del values["mesh_phase"]
    return measurement(record(values, periods=periods, mesh_phase=0.0), "base", nominal())


def lines(rows: np.ndarray) -> np.ndarray:
    return np.fft.rfft(rows, axis=-1) / rows.shape[-1]


@pytest.mark.parametrize("creep", [0.012, -0.06])
def test_a_rotation_that_creeps_is_turned_back_to_a_steady_one(creep: float) -> None:
    before, steady = taken(creep), taken()
    made = in_step(before)
    np.testing.assert_allclose(before.creep.mean(axis=1), creep * (np.arange(3) - 1) / 3, rtol=0.01, atol=1e-5)
    for name, rows in made.periods.items():
        start, after, wanted = (lines(one) for one in (before.periods[name], rows, steady.periods[name]))
        # The mean rotation is that of the middle.
        wanted[:, CYCLES] *= np.exp(1j * np.pi * creep)
        level = 1e-5 * np.abs(lines(steady.periods["angle_driver"]))[:, 1:].max() if "angle" in name else 1e-11
        np.testing.assert_allclose(after[:, 1:], wanted[:, 1:], atol=level)
        if name == "angle_driver":
            assert np.abs(start - wanted)[:, 1:].max() > 100 * level
    shift = made.record["angle_driver"].values[0] - before.record["angle_driver"].values[0]
    expected = made.periods["angle_driver"] - before.periods["angle_driver"]
    np.testing.assert_allclose(shift, expected.ravel(), atol=1e-13)
    assert made.noise["angle_driver"] < 0.05 * before.noise["angle_driver"]
    assert any("creeps by" in sentence for sentence in made.warnings)
    assert in_step(made) is made


def test_gears_that_come_to_rest_within_a_repetition_are_turned_back() -> None:
    """A driver's motion behind a heavy load: teeth and shafts move through their lines while it lasts."""
    time = np.arange(2 * SAMPLES) / SAMPLES
    before = taken(periods=2, ahead=0.01 * np.exp(-4.0 * time))
    made, steady = in_step(before), taken(periods=2)
    start, after, wanted = (lines(measured_channels(one)["dte"])[:, BESIDE] for one in (before, made, steady))
    # What is left is smooth, the same in both repetitions, and still to be seen in both angles.
    assert np.abs(np.diff(after, axis=0)).max() < 0.04 * np.abs(np.diff(start, axis=0)).max()
    assert np.abs(after - wanted).max() < 0.2 * np.abs(start - wanted).max()


def test_a_rotation_in_step_stays_as_it_is() -> None:
    for noise in (0.0, 1.0):
        steady = taken(noise=noise)
        assert in_step(steady) is steady


def test_what_creeps_little_is_not_told() -> None:
    told, quiet = (in_step(taken(creep)).warnings for creep in (2e-3, 5e-4))
    assert any("creeps" in one for one in told) and not any("creeps" in one for one in quiet)


def test_a_line_of_a_shaft_that_is_excited_is_left() -> None:
    before = taken(0.012)
    torque = before.periods["torque_driver"] + 30.0 * np.cos(2 * np.pi * CYCLES * np.arange(SAMPLES) / SAMPLES)
    excited = replace(before, periods={**before.periods, "torque_driver": torque})
    after = in_step(excited).periods
    np.testing.assert_allclose(lines(after["angle_driver"])[:, CYCLES],
                               lines(before.periods["angle_driver"])[:, CYCLES], rtol=1e-4)  # fmt: skip
