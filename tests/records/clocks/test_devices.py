"""Channels of one device that are late together, on a pair whose wheel weighs forty times what the pinion does."""

import numpy as np
import pytest
import xarray as xr

import gearbench as gb
from gearbench.records.clocks.late import clocks_agree
from gearbench.records.seen.look import Look

PAIR = [
    'rig.driver="gears/luo2019_z16.toml"',
    'rig.driven="gears/luo2019_z48.toml"',
    'rig.support.direction="tangential"',
    "experiment.torque_mean_nm=60",
    "experiment.multisine.amplitude_nm=15",
    "rig.support.stiffness_n_per_m=3e8",
    "rig.support.damping_n_s_per_m=2e4",
    "experiment.realisations=1",
    "experiment.seed=5",
]
DEVICES = {
    "torques": ("torque_driver", "torque_driven"),
    "angles": ("angle_driver", "angle_driven"),
    "driver's channels": ("torque_driver", "angle_driver", "y_driver"),
}


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    return gb.simulate(gb.read_case("quick_lumped", PAIR)).drop_vars(["dte", "force"])


def late(record: xr.Dataset, names: tuple[str, ...], samples: int) -> xr.Dataset:
    """Channels of a periodic record `samples` later; angles go on turning as they did."""
    changed = {}
    for name in names:
        values, slope = record[name].values, 0.0
        if name.startswith("angle_"):
            teeth = record.attrs[f"teeth_{name.removeprefix('angle_')}"]
            slope = 2 * np.pi / (teeth * record.attrs["mesh_period"] * record.attrs["sampling_rate"])
        ramp = slope * np.arange(values.shape[1])
        moved = np.roll(values - ramp, samples, axis=1) + ramp - slope * samples
        changed[name] = (record[name].dims, moved, record[name].attrs)
    return record.assign(changed)


def cost(record: xr.Dataset, moved: xr.Dataset) -> float:
    """Relative rms by which dte over force differs from that of the record as it was, line by line but for those of the
    operating response."""
    spectra = []
    for one in (record, moved):
        force, dte = gb.force(one).values[0], gb.dte(one).values[0]
        spectra.append((np.fft.rfft(force - force.mean()), np.fft.rfft(dte)))
    (force, dte), (other_force, other_dte) = spectra
    mesh = round(record.sizes["time"] / record.attrs["sampling_rate"] / record.attrs["mesh_period"])
    lines = (np.abs(force) > 0.1 * np.abs(force).max()) & (np.arange(force.size) % mesh > 0)
    wrong = (other_dte * force / np.where(np.abs(other_force) > 0, other_force, 1) - dte)[lines]
    wrong = np.minimum(np.abs(wrong), 2 * np.abs(other_dte[lines]))
    return float(np.linalg.norm(wrong) / np.linalg.norm(dte[lines]))


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("samples", [2, 82, -30])
def test_a_late_device_is_named_with_its_delay(record: xr.Dataset, device: str, samples: int) -> None:
    """0.12 to 5 ms. Which of two sides is late and which is early is the same; the one named first is the late one."""
    (found,) = clocks_agree(Look(late(record, DEVICES[device], samples)))
    words = "lag behind" if samples > 0 else "lead"
    assert f"the {device} (" in found.sentence and f"{words} the other channels by " in found.sentence
    told = float(found.sentence.split("channels by ")[1].split(" us")[0])
    assert told == pytest.approx(1e6 * abs(samples) / record.attrs["sampling_rate"], rel=0.02)
    assert not found.refused
    assert found.error == pytest.approx(cost(record, late(record, DEVICES[device], samples)), rel=0.4)


@pytest.mark.parametrize("samples", [1500, -3001])
def test_a_device_that_was_started_at_another_time(record: xr.Dataset, samples: int) -> None:
    """0.1 and 0.2 s of a period of half a second: found by correlating the forces on both gears."""
    (found,) = clocks_agree(Look(late(record, DEVICES["driver's channels"], samples)))
    words = "lag behind" if samples > 0 else "lead"
    assert f"y_driver) {words} the other channels by " in found.sentence
    told = float(found.sentence.split("channels by ")[1].split(" us")[0])
    assert told == pytest.approx(1e6 * abs(samples) / record.attrs["sampling_rate"], abs=3.0)
    assert found.error > 0.3


def test_a_single_channel_is_still_named(record: xr.Dataset) -> None:
    (found,) = clocks_agree(Look(late(record, ("angle_driven",), 2)))
    assert found.sentence.startswith("angle_driven lags behind the other channels by 12")


@pytest.mark.parametrize(("real", "out_of_step"), [(0.02, 0.03), (0.055, 0.06)])
def test_a_gear_that_twists_is_no_late_channel(real: float, out_of_step: float) -> None:
    """A rim that turns beyond its hub takes momentum that the hub's angle does not show: one gear's account falls with
    the square of frequency (in kHz), out of step by its damping, and the others do not say so."""
    softer = [*PAIR, "rig.support.damping_n_s_per_m=5e3"]
    record = gb.simulate(gb.read_case("quick_lumped", softer)).drop_vars(["dte", "force"])
    torque, samples = record["torque_driver"], record.sizes["time"]
    kilohertz = np.fft.rfftfreq(samples, 1e3 / record.attrs["sampling_rate"])
    spectrum = np.fft.rfft(torque.values, axis=1) / (1 - (real - 1j * out_of_step) * np.minimum(kilohertz, 3) ** 2)
    twisting = record.assign(torque_driver=(torque.dims, np.fft.irfft(spectrum, samples, axis=1)))
    assert clocks_agree(Look(twisting)) == []


def test_one_clock_says_nothing(record: xr.Dataset) -> None:
    assert clocks_agree(Look(record)) == []
    everything = tuple(str(name) for name in record.data_vars if name != "mesh_phase")
    assert clocks_agree(Look(late(record, everything, 40))) == []


def test_a_lag_that_leaves_dte_over_force_as_it_is_spoils_the_sidebands() -> None:
    """Two equal gears swing against one another: one side late by tau multiplies force and dte of a line alike, by
    cos(w tau / 2), but sidebands come from the force of another line."""
    own = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=8"])).drop_vars(["dte", "force"])
    moved = late(own, DEVICES["driver's channels"], 20)
    assert cost(own, moved) < 0.01
    (found,) = clocks_agree(Look(moved))
    settings = gb.IdentificationSettings(
        harmonics=8, order=1, window=12, band=(800.0, 1700.0), phases=32, modes=0, accept_doubts=True
    )
    right, wrong = (gb.identify([one], settings) for one in (own, moved))
    sound, spoilt = (one["itf_re"].values + 1j * one["itf_im"].values for one in (right, wrong))
    difference = float(np.linalg.norm(spoilt - sound) / np.linalg.norm(sound))
    assert difference > 0.1
    assert found.error > 0.2 * difference  # an order of size: the force of whole lines is lost
