"""What noise leaves of measured minus simulated, on gears so heavy that they hardly resonate: the driven gear's inertia
makes a reaction of its angle's noise."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import simulate
from gearbench.cases import case_files
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.intake.signals import excited, measured_channels, noise_of_mean, simulated_channels
from gearbench.diagnosis.replay.replays import Replay, Replays
from gearbench.diagnosis.simulation.passed_noise import noise_left
from gearbench.diagnosis.simulation.target import BY_TEETH, INDEPENDENT, target_of
from gearbench.rig import Case, read_case

ANGLE, SWING = 1e-6, 3e-6  # rad, rms


HEAVY = (
    "rig.driver.inertia_kg_m2=3e-2",
    "rig.driven.inertia_kg_m2=0.15",
    "rig.drive.coupling.inertia_kg_m2=0.2",
    "rig.sensors.noise_angle_urad=0",
    "rig.sensors.noise_displacement_um=0",
    "rig.sensors.noise_torque_nm=0",
)
BAND = (1500.0, 3000.0)  # Hz


class Rig:
    """The demonstration's first condition on gears of a hundred times their inertia, its record without noise and one
    with that of the driven angle."""

    def __init__(self) -> None:
        self.case: Case = read_case(case_files()["gap_demo"], list(HEAVY))
        self.record = simulate(self.case.under(self.case.conditions[0]))

    def measured(self, noise: float) -> Measurement:
        """The driven gear swings a little with the drive's torque: what does not stand out of noise is not replayed."""
        angle, torque = self.record.angle_driven, self.record.torque_driven
        drive = self.record.torque_driver.values
        swing = SWING * (drive - drive.mean()) / drive.std()
        omega = 2 * np.pi * np.fft.rfftfreq(swing.size, 1 / self.record.attrs["sampling_rate"])
        turning = np.fft.irfft(omega**2 * np.fft.rfft(swing), swing.size)
        noisy = angle + swing + noise * np.random.default_rng(3).standard_normal(angle.shape)
        record: xr.Dataset = self.record.assign(
            angle_driven=noisy.assign_attrs(angle.attrs),
            torque_driven=(torque + 0.15 * turning).assign_attrs(torque.attrs),
        )
        return measurement(record.drop_vars(["dte", "force"], errors="ignore"), "base", self.case)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig()


@pytest.fixture(scope="module")
def noisy(rig: Rig) -> tuple[Measurement, Replay]:
    measured = rig.measured(ANGLE)
    return measured, Replays(problem_of([measured], rig.case).model.sound)


def lines(measured: Measurement, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Excited lines (parts, K) of a noise (parts, N) in the band, and their frequencies [rad/s]."""
    number = excited(measured)
    omega = 2 * np.pi * np.fft.rfftfreq(parts.shape[-1], 1 / measured.sampling_rate)[number]
    inside = (omega > 2 * np.pi * BAND[0]) & (omega < 2 * np.pi * BAND[1])
    return np.fft.rfft(parts, axis=-1)[:, number[inside]] / parts.shape[-1], omega[inside]


def test_the_driven_inertia_makes_a_reaction_of_the_noise_of_its_angle(
    rig: Rig, noisy: tuple[Measurement, Replay]
) -> None:
    measured, replayed = noisy
    left, _ = lines(measured, noise_left(rig.case, measured, replayed)["torque_driven"])
    own, _ = lines(measured, noise_of_mean(measured.periods["torque_driven"]))
    angle, omega = lines(measured, noise_of_mean(measured.periods["angle_driven"]))
    inertia = rig.case.rig.driven.inertia
    assert inertia is not None
    expected = inertia * omega**2 * np.abs(angle)
    # The mesh takes up to k rb^2 = 4e5 N m/rad off 1.3e7 and more.
    np.testing.assert_allclose(np.abs(left), expected, rtol=0.05)
    assert np.abs(own).max() < 1e-3 * expected.min()


@pytest.mark.parametrize("channel", ["dte", "y_driver", "y_driven", "torque_driven"])
def test_residuals_scatter_as_it_says(rig: Rig, noisy: tuple[Measurement, Replay], channel: str) -> None:
    """What noise changes of measured minus simulated, on another draw: that of the mean of two repetitions, of which
    the parts know the difference alone."""
    measured, replayed = noisy
    changed = residual(rig, measured, replayed, channel) - residual(rig, rig.measured(0.0), replayed, channel)
    parts = noise_left(rig.case, measured, replayed)[channel]
    found, said = (lines(measured, one)[0] for one in (changed[None], parts))
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(said), rel=0.25)
    assert np.abs(parts.sum(axis=0)).max() < 1e-6 * np.abs(parts).max()


def residual(rig: Rig, measured: Measurement, replayed: Replay, channel: str) -> np.ndarray:
    """Measured minus simulated (N,)."""
    simulated = simulated_channels(measured, replayed(rig.case, measured.record))
    return np.asarray(measured_channels(measured)[channel].mean(axis=0) - simulated[channel])


def test_records_without_noise_or_without_a_simulation_have_that_of_their_channels(rig: Rig) -> None:
    def refused(case: Case, record: xr.Dataset) -> xr.Dataset:
        raise ValueError("it does not settle")

    measured = rig.measured(ANGLE)
    left = noise_left(rig.case, measured, refused)
    np.testing.assert_array_equal(left["dte"], noise_of_mean(measured_channels(measured)["dte"]))


def test_a_rig_that_goes_another_way_for_any_noise_says_nothing_of_it(
    rig: Rig, noisy: tuple[Measurement, Replay]
) -> None:
    """A hundred times what the noise does, with the same sign for the opposite noise, as after an impact."""
    measured, replayed = noisy

    def rattling(case: Case, record: xr.Dataset) -> xr.Dataset:
        out = replayed(case, record)
        shaken = float(np.abs(record["angle_driven"] - measured.record["angle_driven"]).max()) > 0.0
        way = 1e-4 * np.cos(np.arange(out.sizes["time"]))
        return out.assign(angle_driver=out["angle_driver"] + way) if shaken else out

    left = noise_left(rig.case, measured, rattling)
    np.testing.assert_array_equal(left["dte"], noise_of_mean(measured_channels(measured)["dte"]))
    linear = noise_left(rig.case, measured, replayed)
    assert not np.array_equal(linear["dte"], left["dte"])


def test_a_target_has_the_noise_that_it_is_given_and_counts_lines_of_shafts_by_teeth(
    rig: Rig, noisy: tuple[Measurement, Replay]
) -> None:
    measured, replayed = noisy
    problem = problem_of([measured], rig.case)
    plain = target_of([measured], problem.conditions)
    given = target_of([measured], problem.conditions, [noise_left(rig.case, measured, replayed)])
    reaction = np.array([one.channel == "torque_driven" for one in plain.blocks])
    assert (given.noise[reaction] > 100 * plain.noise[reaction]).all()
    assert (given.floors - given.noise == pytest.approx(plain.floors - plain.noise, rel=1e-9))
    teeth = problem.conditions[0].teeth
    for block, count, size in zip(given.blocks, given.counts, given.sizes, strict=True):
        most = INDEPENDENT
        if block.kind.endswith("-shaft"):
            most = max(INDEPENDENT, round(BY_TEETH * teeth[("driver-shaft", "driven-shaft").index(block.kind)]))
        assert count == min(most, size)
