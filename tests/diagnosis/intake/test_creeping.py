"""Rotation that creeps against the excitation, against the same motion without that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.measured import MESH, SAMPLES, channels, nominal, record

from gearbench.diagnosis.intake.creeping import in_step
from gearbench.diagnosis.intake.measurements import Measurement, measurement

CYCLES = 60  # of the mesh in a repetition


def taken(creep: float = 0.0, periods: int = 3, noise: float = 0.0) -> Measurement:
    """A rig whose mesh is ahead by `creep` cycles at the end of a record that says nothing of it."""
    values = channels(mesh=MESH * (1 + creep / (CYCLES * periods)), periods=periods, noise=noise)
    del values["mesh_phase"]
    return measurement(record(values, periods=periods, mesh_phase=0.0), "base", nominal())


def lines(rows: np.ndarray) -> np.ndarray:
    return np.fft.rfft(rows, axis=-1) / rows.shape[-1]


@pytest.mark.parametrize("creep", [0.012, -0.06])
def test_lines_that_turn_are_turned_back_and_excited_ones_stay(creep: float) -> None:
    before = taken(creep)
    made = in_step(before)
    start, after = (lines(one.periods["angle_driver"]) for one in (before, made))
    np.testing.assert_allclose(before.creep, creep * (np.arange(3) - 1) / 3, rtol=0.01, atol=1e-5)
    mesh = start[:, CYCLES]
    # All repetitions have the phase of the middle one now; that of a line at half a turn of the mesh spreads them.
    assert np.abs(np.ptp(np.angle(mesh))) == pytest.approx(2 * np.pi * abs(creep) * 2 / 3, rel=0.01)
    np.testing.assert_allclose(after[:, CYCLES], mesh[1], rtol=3e-3 * abs(creep) / 0.012)
    for excited in (31, 91, 151):
        np.testing.assert_allclose(after[:, excited], start[:, excited], atol=1e-18)
    shift = made.record["angle_driver"].values[0] - before.record["angle_driver"].values[0]
    expected = made.periods["angle_driver"] - before.periods["angle_driver"]
    np.testing.assert_allclose(shift, expected.ravel(), atol=1e-13)
    assert made.noise["angle_driver"] < 0.05 * before.noise["angle_driver"]
    assert any("creeps by" in sentence for sentence in made.warnings)
    assert in_step(made) is made


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
                               lines(before.periods["angle_driver"])[:, CYCLES], rtol=1e-9)  # fmt: skip
