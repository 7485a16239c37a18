"""Angles from too few pulses: what lies beyond them is said, and counted where it is identified."""

import numpy as np
import pytest
import xarray as xr

import gearbench as gb
from gearbench.records import ChannelMap, ChannelSpec
from gearbench.records.conversion.clock import Clock, resampled
from gearbench.records.conversion.convert import convert_sources

RATE = 16000.0


def test_splines_err_by_what_is_believed_of_them() -> None:
    """A line at 0.35 of the pulse rate loses 2.4 %, 1 / (1 + (0.35 / 0.65)^6), and gains as much of its image."""
    pulses = np.arange(4000) / 5000.0 + 1e-6 * np.random.default_rng(0).standard_normal(4000)
    clock = Clock(float(pulses[0]), 5000.0, pulses.size, pulses)
    for part, least, most in ((0.35, 0.01, 0.06), (0.2, 0.0, 0.003)):
        frequency = part * 5000.0
        found, _ = resampled(np.sin(2 * np.pi * frequency * pulses)[None], clock, 0.1, RATE, 8000)
        wanted = np.sin(2 * np.pi * frequency * (0.1 + np.arange(8000) / RATE))
        error = float(np.linalg.norm(found[0] - wanted) / np.linalg.norm(wanted))
        assert least < error < most


@pytest.fixture(scope="module")
def slow() -> xr.Dataset:
    """A simulated record whose angles are marked as told up to 2 kHz; excited to 3.5 kHz."""
    record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"]))
    for gear in ("driver", "driven"):
        record[f"angle_{gear}"].attrs["believed_to_hz"] = 2000.0
    return record


def test_the_part_of_the_response_beyond_is_said_and_counted_there_only(slow: xr.Dataset) -> None:
    size = np.abs(np.fft.rfft(slow["dte"].values[0]))
    frequency = np.fft.rfftfreq(slow.sizes["time"], 1 / slow.attrs["sampling_rate"])
    band = (frequency > 0.5) & (frequency <= 3500)
    share = float(np.linalg.norm(size[band & (frequency > 2000)]) / np.linalg.norm(size[band]))
    given = {"harmonics": 4, "order": 1, "window": 30, "phases": 16, "modes": 0, "accept_doubts": True}
    bands = ((2100.0, 3000.0), (800.0, 1500.0))
    above, below = (gb.identify([slow], gb.IdentificationSettings(band=band, **given)) for band in bands)
    for one in (above, below):
        assert "angle_driver and angle_driven can be believed up to 2000 Hz" in one.attrs["warnings"]
    assert above.attrs["record_error"] == pytest.approx(share, rel=0.3)
    assert below.attrs["record_error"] == 0.0


def test_conversion_keeps_how_far_an_angle_goes(tmp_path) -> None:
    time = np.arange(4000) / 4000.0
    turned = 2 * np.pi * 5.0 * time + 1e-5 * np.sin(2 * np.pi * 300 * time)
    edges = np.interp(np.arange(1, 4990) * 2 * np.pi / 1000, turned, time)
    for name, values in {"t": time, "m": 50 + np.sin(2 * np.pi * 300 * time), "y": 1e-6 * time, "p": edges}.items():
        np.savetxt(tmp_path / f"{name}.csv", values, header=name, comments="", fmt="%.12g")
    pulses = ChannelSpec(("p",), "pulse times s", pulses_per_revolution=1000.0)
    spec = {
        "torque_driver": ChannelSpec(("m",), "N m", sampling_rate=4000.0),
        "angle_driver": pulses,
        "angle_driven": pulses,
    }
    about = {
        "sampling_rate": 4000.0, "samples_per_period": 1000, "mesh_frequency": 100.0, "teeth_driver": 20,
        "teeth_driven": 20, "base_radius_driver": 0.03, "base_radius_driven": 0.03, "driven_boundary": "speed",
        "support_direction": "line-of-action", "mesh_phase_origin": "geometry",
    }  # fmt: skip
    record = convert_sources([tmp_path / "m.csv", tmp_path / "p.csv"], ChannelMap(spec, about))
    assert record["angle_driver"].attrs["believed_to_hz"] == pytest.approx(0.35 * 5000, rel=1e-3)
    assert "counted without an absolute zero" in record.attrs["warnings"]
