"""One virtual measurement as a MAT-file made by Octave, as UFF58, CSV and others: the response is the same."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import nptdms
import numpy as np
import pytest
import scipy.io
import xarray as xr
from measured_files import OCTAVE, dataset_58, write_matlab73, write_uff

import gearbench as gb
from gearbench.records import ChannelMap, ChannelSpec

RIG = [
    "experiment.sampling_rate_hz=2048",
    "experiment.samples_per_period=1024",
    "experiment.multisine.band_hz=[1.0,900.0]",
    "identification.band_hz=[1.0,900.0]",
]
COLUMNS = {
    "torque_driver": ("M1", "N m"),
    "torque_driven": ("M2", "N m"),
    "angle_driver": ("theta1", "rad"),
    "angle_driven": ("theta2", "rad"),
    "y_driver": ("y1", "m"),
    "y_driven": ("y2", "m"),
}
SETTINGS = gb.IdentificationSettings(harmonics=4, order=1, window=12, band=(200.0, 600.0))


def channel_map(time: bool = True) -> ChannelMap:
    channels = {
        name: ChannelSpec((column,), unit, location="gear")
        for name, (column, unit) in COLUMNS.items()
        if name.startswith("torque")
    }
    channels |= {name: ChannelSpec((column,), unit) for name, (column, unit) in COLUMNS.items() if name not in channels}
    return ChannelMap(channels, {"time": "t"} if time else {})


def measured() -> dict[str, np.ndarray]:
    table = np.loadtxt(OCTAVE / "measurement.csv", delimiter=",", skiprows=1)
    return dict(zip(["t", "M1", "M2", "theta1", "theta2", "y1", "y2"], table.T, strict=True))


def write(format_name: str, folder: Path) -> Path:
    """The measurement in a file of another program."""
    data = measured()
    path = folder / f"m.{format_name}"
    if format_name == "uff":
        write_uff(path, *(dataset_58(c, data[c], unit, rate=2048.0) for c, unit in COLUMNS.values()))
    elif format_name == "mat":
        scipy.io.savemat(path, data)
    elif format_name == "h5":
        write_matlab73(path, **data)
    elif format_name == "tdms":
        with nptdms.TdmsWriter(path) as writer:
            made = [nptdms.ChannelObject("g", c, data[c], {"wf_increment": 1 / 2048}) for c, _ in COLUMNS.values()]
            writer.write_segment(made)
    elif format_name == "nc":
        variables = {name: ("t", values) for name, values in data.items() if name != "t"}
        xr.Dataset(variables, {"t": ("t", data["t"])}).to_netcdf(path, engine="h5netcdf")
    return path


@pytest.fixture(scope="module")
def case() -> gb.Case:
    return gb.read_case("quick_lumped", RIG)


@pytest.fixture(scope="module")
def from_octave(case: gb.Case) -> xr.Dataset:
    return gb.convert(OCTAVE / "octave_v7.mat", channel_map(), case=case)


@pytest.fixture(scope="module")
def truth(from_octave: xr.Dataset) -> np.ndarray:
    return gb.itf(gb.identify([from_octave], SETTINGS)).values


def response(record: xr.Dataset) -> np.ndarray:
    return gb.itf(gb.identify([record], SETTINGS)).values


def test_same_response_from_text(case: gb.Case, truth: np.ndarray) -> None:
    found = response(gb.convert(OCTAVE / "measurement.csv", channel_map(), case=case))
    assert np.abs(truth).max() > 0
    assert np.abs(found - truth).max() <= 1e-9 * np.abs(truth).max()


@pytest.mark.parametrize("format_name", ["uff", "mat", "h5", "tdms", "nc"])
def test_same_record_from_every_format(
    format_name: str, case: gb.Case, from_octave: xr.Dataset, tmp_path: Path
) -> None:
    """All that a response is made of: channels, phase, and the attributes of clock and rig."""
    found = gb.convert(write(format_name, tmp_path), channel_map(format_name not in ("uff", "tdms")), case=case)
    assert set(found.data_vars) == set(from_octave.data_vars)
    for name, wanted in from_octave.data_vars.items():
        np.testing.assert_allclose(found[name], wanted, rtol=0, atol=1e-12 * float(np.abs(wanted).max()), err_msg=name)
    numbers = {key: value for key, value in from_octave.attrs.items() if isinstance(value, (int, float, np.number))}
    assert {"sampling_rate", "samples_per_period", "mesh_period", "base_radius_driver"} <= numbers.keys()
    assert {key: found.attrs[key] for key in numbers} == pytest.approx(numbers, rel=1e-12)


def test_units_are_converted_at_the_door(case: gb.Case, truth: np.ndarray, tmp_path: Path) -> None:
    data = measured()
    sizes = {"M1": ("N mm", 1e-3), "theta1": ("deg", np.pi / 180), "theta2": ("rev", 2 * np.pi), "y1": ("um", 1e-6)}
    for name, (_, size) in sizes.items():
        data[name] = data[name] / size
    head = ",".join(
        f"{name} [{sizes[name][0] if name in sizes else unit}]" for name, unit in [("t", "s"), *COLUMNS.values()]
    )
    np.savetxt(
        tmp_path / "m.csv", np.column_stack(list(data.values())), delimiter=",", header=head, comments="", fmt="%.17g"
    )
    spoken = {name: ChannelSpec((column,)) for name, (column, _) in COLUMNS.items()}
    found = response(gb.convert(tmp_path / "m.csv", ChannelMap(spoken, {"time": "t"}), case=case))
    assert np.abs(found - truth).max() <= 1e-9 * np.abs(truth).max()


def test_record_is_what_was_simulated(case: gb.Case, from_octave: xr.Dataset) -> None:
    """The way out and in loses nothing: channels to the last digit, and the attributes of the rig."""
    simulated = gb.simulate(gb.read_case("quick_lumped", [*RIG, "experiment.realisations=1"]))
    for name in COLUMNS:
        np.testing.assert_allclose(from_octave[name], simulated[name], rtol=0, atol=1e-12 * abs(simulated[name]).max())
    for key in ("teeth_driver", "base_radius_driven", "inertia_driver", "driven_boundary", "mesh_period"):
        assert from_octave.attrs[key] == simulated.attrs[key]
    np.testing.assert_allclose(from_octave["mesh_phase"], simulated["mesh_phase"], atol=0.02)


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="GNU Octave is not installed")
def test_octave_still_writes_what_is_kept(tmp_path: Path) -> None:
    for name in ("make.m", "measurement.csv"):
        shutil.copy(OCTAVE / name, tmp_path)
    subprocess.run(["octave-cli", "--no-init-file", "make.m"], cwd=tmp_path, check=True, capture_output=True)
    kept, made = (gb.records.read_source(folder / "octave_v7.mat") for folder in (OCTAVE, tmp_path))
    for one, other in zip(kept.columns, made.columns, strict=True):
        assert one.name == other.name
        np.testing.assert_array_equal(one.values, other.values)
