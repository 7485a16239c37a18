"""Record: what is accepted, what is refused and in which words, and the round trip through a file."""

from __future__ import annotations

import gc
import json
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

from gearbench.files import FileError
from gearbench.records import (
    RecordError,
    make_record,
    provenance,
    read_record,
    source_digest,
    unit_of_channel,
    validate_record,
    write_record,
)

SAMPLING: dict[str, Any] = {"sampling_rate": 100.0, "samples_per_period": 20, "periods": 2}
RIG: dict[str, Any] = {
    **SAMPLING,
    "base_radius_driver": 0.05,
    "base_radius_driven": 0.1,
    "driven_boundary": "speed",
}


def _signals(*names: str) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    return {name: rng.standard_normal((3, 40)) for name in names}


def _record(**changes: Any) -> xr.Dataset:
    return make_record(
        _signals("torque_driver", "angle_driver", "angle_driven", "y_driver", "y_driven"), {**RIG, **changes}
    )


def test_record_carries_units_time_and_schema() -> None:
    record = _record()
    assert record.attrs["schema"] == "gearbench-record/1"
    assert record["torque_driver"].attrs["units"] == "N m"
    assert record["y_driver"].dims == ("realisation", "time")
    np.testing.assert_allclose(record["time"], np.arange(40) / 100.0)
    assert record["time"].attrs["units"] == "s"


def test_dte_and_force_with_sampling_alone_are_a_record() -> None:
    record = make_record(_signals("dte", "force"), SAMPLING)
    assert set(record.data_vars) == {"dte", "force"}


def test_angles_without_support_motion_are_a_record() -> None:
    make_record(_signals("torque_driver", "angle_driver", "angle_driven"), RIG)


def test_file_round_trip_is_exact(tmp_path: Path) -> None:
    record = _record(mesh_period=0.05, condition="hot", mesh_phase_origin="geometry")
    record["y_driver"].attrs["location"] = "bearing"
    path = tmp_path / "record.nc"
    write_record(record, path)
    xr.testing.assert_identical(read_record(path), record)
    assert [p.name for p in tmp_path.iterdir()] == ["record.nc"]


def test_plain_hdf5_readers_see_channels_and_units(tmp_path: Path) -> None:
    record = _record()
    path = tmp_path / "record.nc"
    write_record(record, path)
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["torque_driver"][()], record["torque_driver"].values)
        assert file["torque_driver"].attrs["units"] == "N m"
        assert file.attrs["schema"] == "gearbench-record/1"
        assert file["time"].shape == (40,)


def test_failed_write_leaves_the_old_file_and_no_litter(tmp_path: Path) -> None:
    path = tmp_path / "record.nc"
    good = _record()
    write_record(good, path)
    bad = good.copy(deep=True)
    bad.attrs["unwritable"] = object()
    with pytest.raises(TypeError):
        write_record(bad, path)
    xr.testing.assert_identical(read_record(path), good)
    assert [p.name for p in tmp_path.iterdir()] == ["record.nc"]


@pytest.mark.parametrize("keep", [0, 100, 3000, -1])
def test_truncated_file_is_refused(tmp_path: Path, keep: int) -> None:
    path = tmp_path / "record.nc"
    write_record(_record(), path)
    content = path.read_bytes()
    path.write_bytes(content[:keep] if keep >= 0 else content[: len(content) - 500])
    with pytest.raises(RecordError, match="truncated or no NetCDF-4 file"):
        read_record(path)


def test_missing_file_and_missing_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"nothing\.nc does not exist"):
        read_record(tmp_path / "nothing.nc")
    with pytest.raises(FileError, match=r"folder .*deep must exist"):
        write_record(_record(), tmp_path / "deep" / "record.nc")


def test_foreign_netcdf_file_is_refused_by_schema(tmp_path: Path) -> None:
    path = tmp_path / "foreign.nc"
    xr.Dataset({"a": ("x", np.zeros(3))}).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(RecordError, match="schema is None"):
        read_record(path)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_located(value: float) -> None:
    signals = _signals("dte", "force")
    signals["force"][2, 7] = value
    with pytest.raises(RecordError, match=r"force holds 1 value.*realisation 2, sample 7"):
        make_record(signals, SAMPLING)


@pytest.mark.parametrize("name", ["torque_driver", "angle_driver", "angle_driven"])
def test_missing_channel_is_named(name: str) -> None:
    with pytest.raises(RecordError, match=f"channel {name} is missing"):
        validate_record(_record().drop_vars(name))


def test_free_driven_gear_needs_its_torque_and_inertias() -> None:
    with pytest.raises(RecordError, match="inertia_driver is missing"):
        _record(driven_boundary="torque")
    with pytest.raises(RecordError, match="torque_driven is missing"):
        _record(driven_boundary="torque", inertia_driver=1e-3, inertia_driven=1e-3)


@pytest.mark.parametrize("name", ["base_radius_driver", "driven_boundary", "sampling_rate", "periods"])
def test_missing_attribute_is_named(name: str) -> None:
    with pytest.raises(RecordError, match=f"attribute {name} is missing"):
        _record(**{name: None})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"periods": 1.5}, "periods = 1.5 must be a whole number"),
        ({"sampling_rate": -1.0}, "sampling_rate = -1 must be positive"),
        ({"sampling_rate": "fast"}, "'fast' is not a number"),
        ({"periods": 3}, r"40 samples, but samples_per_period x periods is 60"),
    ],
)
def test_bad_sampling_is_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(RecordError, match=words):
        _record(**change)


def test_unequal_lengths_and_realisations_are_refused() -> None:
    signals = _signals("dte", "force")
    with pytest.raises(RecordError, match=r"force has shape \(3, 39\)"):
        make_record({**signals, "force": signals["force"][:, :-1]}, SAMPLING)
    with pytest.raises(RecordError, match="number of realisations"):
        make_record({**signals, "force": signals["force"][:2]}, SAMPLING)


def test_time_that_does_not_match_the_sampling_rate_is_refused() -> None:
    record = _record()
    shifted = record.assign_coords(time=record["time"] * 1.01)
    with pytest.raises(RecordError, match="time is not uniform at sampling_rate = 100 Hz"):
        validate_record(shifted)


def test_wrong_unit_precision_and_dimensions_are_refused() -> None:
    record = _record()
    wrong = record.copy(deep=True)
    wrong["y_driver"].attrs["units"] = "mm"
    with pytest.raises(RecordError, match="y_driver has units 'mm', not 'm'"):
        validate_record(wrong)
    with pytest.raises(RecordError, match="y_driver is float32"):
        validate_record(record.assign(y_driver=record["y_driver"].astype(np.float32)))
    with pytest.raises(RecordError, match="dimensions"):
        validate_record(record.assign(y_driver=record["y_driver"].isel(realisation=0, drop=True)))


def test_units_follow_the_table_and_unknown_names_suggest_the_nearest() -> None:
    assert unit_of_channel("acceleration_housing") == "m/s^2"
    assert unit_of_channel("temperature_oil") == "K"
    with pytest.raises(RecordError, match="did you mean 'torque_driver'"):
        unit_of_channel("torque_drivr")


def test_provenance_is_json_with_the_digest_of_the_sources() -> None:
    content = json.loads(provenance("name = 'a'", 7, {"substeps": 4}, release="1.2.3"))
    assert content["version"] == "1.2.3"
    assert content["seed"] == 7
    assert content["case"] == "name = 'a'"
    assert content["settings"] == {"substeps": 4}
    assert content["sources"] == source_digest()
    assert len(content["sources"]) == 64


def test_damaged_metadata_is_one_sentence_and_nothing_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    complaints: list[str] = []  # what Python would print of an exception that nobody can catch
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: complaints.append(str(unraisable.exc_value)))
    path = tmp_path / "record.nc"
    write_record(_record(), path)
    whole = bytearray(path.read_bytes())
    generator = np.random.default_rng(3)
    refused = 0
    for _ in range(8):
        damaged = whole.copy()
        for place in generator.integers(0, min(len(whole), 12_000), 20):
            damaged[place] = generator.integers(256)
        path.write_bytes(damaged)
        try:
            read_record(path)
        except RecordError:
            refused += 1
    gc.collect()
    assert refused > 1
    assert complaints == []
