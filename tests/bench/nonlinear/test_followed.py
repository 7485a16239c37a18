"""Replays whose driven gear turns as recorded, whatever holds the load: against records of rigs that say what does."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import simulate
from gearbench.bench.nonlinear.followed import Followed, followed
from gearbench.bench.nonlinear.replay import replay
from gearbench.cases import case_files
from gearbench.rig import Case, Load, OutputShaft, Sensors, read_case

# Soft enough that the driven gear moves as much as the mesh deflects; and ten times as stiff, so that the part of the
# twist that vibrates, which the simulation of such a rig leaves out of the mesh phase, is small.
SOFT, STIFF = (Load(coupling=OutputShaft(stiffness=one, damping=50.0)) for one in (4e5, 4e6))
KNOWN = ("dte", "y_driver", "y_driven", "torque_driven", "angle_driver", "angle_driven")


def case_of(load: Load, **sensors: float) -> Case:
    nominal = read_case(case_files()["gap_demo"])
    case = nominal.under(nominal.conditions[0])
    rig = case.rig.model_copy(update={"load": load, "sensors": Sensors(**sensors)})
    return case.model_copy(update={"rig": rig})


def swing(values: np.ndarray) -> np.ndarray:
    return values - values.mean()


def apart(measured: xr.Dataset, replayed: xr.Dataset, channel: str) -> float:
    """Rms difference over the rms of the measured swing, over one period, without the angles' rotation."""
    n = replayed.sizes["time"]
    one, two = measured[channel].values[0, :n], replayed[channel].values[0]
    if channel.startswith("angle"):
        ramp = np.arange(n) * (measured[channel].values[0, n] - one[0]) / n
        one, two = one - ramp, two - ramp
    return float(np.std(one - two) / np.std(one))


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    return simulate(case_of(SOFT))


@pytest.fixture(scope="module")
def stiff() -> tuple[xr.Dataset, xr.Dataset]:
    record = simulate(case_of(STIFF))
    return record, replay(case_of(Load()), record)


@pytest.mark.parametrize("channel", KNOWN)
def test_a_rig_that_does_not_know_its_load_answers_as_one_that_does(
    stiff: tuple[xr.Dataset, xr.Dataset], channel: str
) -> None:
    assert apart(*stiff, channel) < 5e-3


@pytest.mark.parametrize("channel", KNOWN)
def test_at_an_unturned_mesh_phase_it_answers_so_to_a_thousandth(
    record: xr.Dataset, channel: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The simulation's mesh phase is that of the steady rotation and the mean twist."""

    def steadily(self: Followed, time: np.ndarray) -> np.ndarray:
        return self.first + self.departures.mean() + time * 10240 * self.cycles_per_sample

    monkeypatch.setattr(Followed, "cycles", steadily)
    assert apart(record, replay(case_of(Load()), record), channel) < 3e-3


def test_the_mesh_phase_is_that_of_the_driven_gear(record: xr.Dataset) -> None:
    case, n = case_of(Load()), 12288
    found = followed(case.rig, record, 0, 60 / n, 0.0)
    assert found is not None
    angle = record["angle_driven"].values[0, :n] * case.rig.driven.teeth / (2 * np.pi)
    assert found.cycles(np.arange(n) / 10240) == pytest.approx(angle, abs=1e-9)
    fine = found.cycles(np.arange(-4, 2 * n) / (10240 * 4))
    assert fine[4::4] == pytest.approx(angle[: n // 2], abs=1e-9)
    rate, told = np.diff(fine) * 10240 * 4, found.frequency(np.arange(-4, 2 * n) / (10240 * 4))
    assert (told[1:] + told[:-1]) / 2 == pytest.approx(rate, abs=1e-2 * np.ptp(rate))


def test_a_driven_gear_that_is_held_answers_otherwise(record: xr.Dataset) -> None:
    still = record.assign(angle_driven=record["angle_driven"].copy(data=steady(record)))
    found = replay(case_of(Load()), still)
    assert apart(record, found, "dte") > 0.1 and apart(record, found, "torque_driven") > 0.1


def steady(record: xr.Dataset) -> np.ndarray:
    angle = record["angle_driven"].values
    number = np.arange(angle.shape[1])
    return np.polyval(np.polyfit(number, angle[0], 1), number)[None]


def test_sensors_of_the_driven_angle_are_taken_back(record: xr.Dataset) -> None:
    """Delay, filter and run-out of its encoder change what is recorded, not how the rig turned."""
    chain = {"delay_angle_driven": 4e-5, "filter": 4000.0, "encoder_runout_driven": 2e-5}
    seen = simulate(case_of(SOFT, **chain))
    found = replay(case_of(Load(), **chain), seen)
    assert apart(seen, found, "angle_driven") < 1e-3
    assert apart(seen, found, "dte") < 0.02
    assert apart(record, seen, "dte") > 0.05


def test_noise_of_the_angle_is_not_followed(record: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice differentiated it would shake the driver: a replay of a noisy record is that of a clean one."""
    rng = np.random.default_rng(5)
    angle = record["angle_driven"]
    noise = 0.02 * np.std(swing(angle.values[0] - steady(record)[0]))
    noisy = record.assign(angle_driven=angle.copy(data=angle.values + noise * rng.standard_normal(angle.shape)))
    clean, found = (replay(case_of(Load()), one) for one in (record, noisy))
    picked = apart(clean, found, "dte")
    assert picked < 0.02
    monkeypatch.setattr("gearbench.bench.nonlinear.followed.SEEN", 0.0)
    assert apart(clean, replay(case_of(Load()), noisy), "dte") > 2 * picked
