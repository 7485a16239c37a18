"""Importers on files that other programs wrote, and on damaged ones."""

from __future__ import annotations

import wave
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import nptdms
import numpy as np
import pytest
import scipy.io
import xarray as xr
from measured_files import OCTAVE, dataset_58, write_matlab73, write_uff

from gearbench.records import RecordError, Source, read_source

TIME = np.arange(200) / 1000.0
SIGNAL = np.sin(2 * np.pi * 30.0 * TIME) + 0.1 * np.arange(200)


def column(source: Source, name: str) -> np.ndarray:
    return next(one.values for one in source.columns if one.name == name)


def test_octave_v7_holds_the_same_numbers_as_its_table() -> None:
    mat, table = read_source(OCTAVE / "octave_v7.mat"), read_source(OCTAVE / "measurement.csv")
    assert mat.format == "MAT" and set(mat.names) == set(table.names)
    for name in table.names:
        np.testing.assert_array_equal(column(mat, name), column(table, name))
    assert [one.unit for one in table.columns] == ["s", "Nm", "Nm", "rad", "rad", "m", "m"]


def test_octave_v6_struct_gives_fields_facts_and_what_is_skipped() -> None:
    source = read_source(OCTAVE / "octave_v6.mat")
    assert source.names == ("bench.torque_driver",)
    assert source.facts == {"bench.rig": "test rig", "bench.fs": 2048.0}
    assert "cell array" in source.skipped["bench.labels"]


def test_octave_text_is_named_as_such() -> None:
    with pytest.raises(RecordError, match="Octave's text format: save it with -v7"):
        read_source(OCTAVE / "octave_text.mat")


@pytest.mark.parametrize("compress", [True, False])
def test_scipy_mat(tmp_path: Path, compress: bool) -> None:
    path = tmp_path / "m.mat"
    scipy.io.savemat(
        path, {"theta1": np.stack([SIGNAL, 2 * SIGNAL], axis=1), "bench": {"M1": SIGNAL}}, do_compression=compress
    )
    source = read_source(path)
    assert set(source.names) == {"theta1", "bench.M1"}
    np.testing.assert_array_equal(column(source, "theta1"), [SIGNAL, 2 * SIGNAL])  # time is the longer dimension


def test_matlab_73(tmp_path: Path) -> None:
    path = tmp_path / "m.mat"
    write_matlab73(path, M1=SIGNAL, **{"bench.theta1": np.stack([SIGNAL, SIGNAL + 1]), "fs": np.array([[1000.0]])})
    source = read_source(path)
    assert source.format == "MAT 7.3" and set(source.names) == {"M1", "bench.theta1"}
    assert source.facts == {"fs": 1000.0, "rig": "test"} and "cell" in source.skipped["labels"]
    assert column(source, "bench.theta1").shape == (2, 200)


@pytest.mark.parametrize("binary", [0, 1])
def test_uff(tmp_path: Path, binary: int) -> None:
    path = tmp_path / "m.uff"
    frf = dataset_58("H", SIGNAL, "g", func_type=4, abscissa_spec_data_type=18)
    write_uff(path, dataset_58("M1", SIGNAL, "N m", binary=binary), dataset_58("acc", SIGNAL, "g", binary=binary), frf)
    source = read_source(path)
    assert source.names == ("M1", "acc") and [one.unit for one in source.columns] == ["N m", "g"]
    tolerance = 0.0 if binary else 1e-11 * 20
    np.testing.assert_allclose(column(source, "M1")[0], SIGNAL, rtol=0, atol=tolerance)
    assert "no function of time" in next(iter(source.skipped.values()))


def test_uff_prints_its_rate_with_six_digits(tmp_path: Path) -> None:
    write_uff(tmp_path / "m.uff", dataset_58("M1", SIGNAL, "N m", rate=16384.0))
    (one,) = read_source(tmp_path / "m.uff").columns
    assert one.rate is not None and one.rate != 16384.0
    assert abs(one.rate / 16384.0 - 1) <= one.rate_tolerance < 1e-6


def test_uff_functions_of_one_name_are_runs_and_of_several_nodes_columns(tmp_path: Path) -> None:
    runs = [dataset_58("M1", number * SIGNAL, "N m") for number in (1, 2, 3)]
    write_uff(tmp_path / "m.uff", *runs)
    assert column(read_source(tmp_path / "m.uff"), "M1").shape == (3, 200)
    nodes = [dataset_58("acc", SIGNAL, "g", rsp_node=node, rsp_dir=-2) for node in (1, 2)]
    write_uff(tmp_path / "n.uff", *nodes)
    assert read_source(tmp_path / "n.uff").names == ("acc 1:-Y", "acc 2:-Y")


def test_tdms(tmp_path: Path) -> None:
    path = tmp_path / "m.tdms"
    properties = {"wf_increment": 1e-3, "wf_start_offset": 0.25, "unit_string": "Nm"}
    with nptdms.TdmsWriter(path) as writer:
        root = nptdms.RootObject(properties={"operator": "me", "teeth_driver": 20})
        runs = [nptdms.ChannelObject(f"run{n}", "M1", (n + 1) * SIGNAL, properties=properties) for n in range(2)]
        writer.write_segment([root, *runs])
    (one,) = read_source(path).columns
    assert (one.name, one.unit, one.runs, one.start) == ("M1", "Nm", 2, 0.25)
    assert one.rate == pytest.approx(1000.0, rel=1e-12)
    assert read_source(path).facts["teeth_driver"] == 20.0


@pytest.mark.parametrize("binary", [0, 1])
def test_uff_that_is_cut_anywhere_is_refused(tmp_path: Path, binary: int) -> None:
    """But where a dataset ends: nothing tells that another one followed."""
    path = tmp_path / "m.uff"
    write_uff(path, *(dataset_58(name, SIGNAL[:9], "N m", binary=binary) for name in ("M1", "M2", "M3")))
    content = path.read_bytes()
    third = content.rfind(b"    -1\n    58")
    ends = [content.find(b"    -1\n", 60), content.rfind(b"    -1\n", 0, third), len(content) - 7]
    for cut in range(third + 5, len(content) - 1):
        path.write_bytes(content[:cut])
        with pytest.raises(RecordError, match=r"m\.uff is truncated: dataset 3( \(M.?\))? is not ended by -1"):
            read_source(path)
    for number, end in enumerate(ends, start=1):
        path.write_bytes(content[:end])
        with pytest.raises(RecordError, match=rf"truncated: dataset {number} \(M{number}\) is not ended by -1"):
            read_source(path)
        path.write_bytes(content[: end + 6])  # without the last end of line
        assert len(read_source(path).names) == number


def test_uff_with_uneven_abscissas_is_whole(tmp_path: Path) -> None:
    """Its writer counts half the bytes of a binary set."""
    write_uff(tmp_path / "m.uff", *(dataset_58(name, SIGNAL, "N m", abscissa_spacing=0) for name in ("M1", "M2")))
    source = read_source(tmp_path / "m.uff")
    assert source.names == ("M1", "M2")
    np.testing.assert_array_equal(column(source, "M2"), [SIGNAL])


def test_uff_with_fewer_values_than_it_says_names_the_dataset(tmp_path: Path) -> None:
    write_uff(tmp_path / "m.uff", *(dataset_58(name, SIGNAL, "N m", binary=0) for name in ("M1", "M2")))
    lines = (tmp_path / "m.uff").read_text().splitlines(keepends=True)
    (tmp_path / "m.uff").write_text("".join(lines[:-3] + lines[-1:]))
    with pytest.raises(RecordError, match=r"m\.uff: dataset 2 \(M2\) is truncated: it has 19\d of 200 values"):
        read_source(tmp_path / "m.uff")


def write_starts(path: Path, starts: Mapping[str, np.datetime64 | None], offset: float = 0.0) -> None:
    """A TDMS file of channels `group/name` that begin at these times; None: the file does not say."""
    with nptdms.TdmsWriter(path) as writer:
        made = []
        for place, start in starts.items():
            properties = {"wf_increment": 1e-3, "wf_start_offset": offset, "unit_string": "Nm"}
            group, _, name = place.partition("/")
            begins = {} if start is None else {"wf_start_time": start}
            made.append(nptdms.ChannelObject(group, name, SIGNAL, properties=properties | begins))
        writer.write_segment(made)


NOON = np.datetime64("2026-11-28T12:00:00.000000")


def test_tdms_channels_start_when_their_devices_did(tmp_path: Path) -> None:
    path, later = tmp_path / "m.tdms", NOON + np.timedelta64(250_125, "us")
    unset = np.datetime64("1904-01-01T00:00:00.000000")  # a time that LabVIEW was not told
    write_starts(path, {"a/M1": later, "a/M2": NOON, "b/y1": None, "b/y2": unset}, offset=0.5)
    starts = {one.name: one.start for one in read_source(path).columns}
    assert starts == pytest.approx({"M1": 0.750125, "M2": 0.5, "y1": 0.5, "y2": 0.5}, abs=1e-9)


def test_tdms_runs_begin_one_after_another(tmp_path: Path) -> None:
    path, minute, late = tmp_path / "m.tdms", np.timedelta64(60, "s"), np.timedelta64(3, "ms")
    starts = {"1/M1": NOON, "1/y1": NOON + late, "2/M1": NOON + minute, "2/y1": NOON + minute + late}
    write_starts(path, starts)
    assert [(one.runs, one.start) for one in read_source(path).columns] == [(2, 0.0), (2, pytest.approx(0.003))]
    write_starts(path, starts | {"2/y1": NOON + minute})
    with pytest.raises(RecordError, match=r"y1 starts 0 s into one run and 0\.003 s into another \(limit 1e-06 s"):
        read_source(path)


def test_tdms_times_of_samples_are_seconds(tmp_path: Path) -> None:
    times = NOON + np.arange(0, 2_000_000, 400_000).astype("timedelta64[us]")
    with nptdms.TdmsWriter(tmp_path / "m.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("g", "t", times)])
    (one,) = read_source(tmp_path / "m.tdms").columns
    assert one.unit == "s"
    np.testing.assert_allclose(one.values, [[0.0, 0.4, 0.8, 1.2, 1.6]], atol=1e-9)


def test_netcdf_and_hdf5(tmp_path: Path) -> None:
    values = (("realisation", "time"), np.stack([SIGNAL, SIGNAL]), {"units": "N m"})
    made = xr.Dataset({"M1": values}, {"time": ("time", TIME, {"units": "s"})}, {"fs": 1000.0})
    made.to_netcdf(tmp_path / "m.nc", engine="h5netcdf")
    source = read_source(tmp_path / "m.nc")
    assert set(source.names) == {"M1", "time"} and source.facts["fs"] == 1000.0
    assert {one.name: one.unit for one in source.columns} == {"M1": "N m", "time": "s"}
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file.create_dataset("a/b", data=SIGNAL.astype(np.float32)).attrs["unit"] = "g"
        file.create_dataset("names", data=["x", "y"])
    plain = read_source(tmp_path / "m.h5")
    assert plain.names == ("a.b",) and plain.columns[0].unit == "g" and "names" in plain.skipped


def write_packed(path: Path, stored: np.ndarray, **attributes: Any) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("M1", data=stored).attrs.update(attributes)
        file.create_dataset("M2", data=SIGNAL)


def test_packed_netcdf_is_unpacked(tmp_path: Path) -> None:
    """As xarray writes it, and as it reads it back."""
    made = xr.Dataset({"M1": ("n", np.where(TIME < 0.15, SIGNAL, np.nan))})
    packing = {"dtype": "int16", "scale_factor": 2e-3, "add_offset": 10.0, "_FillValue": -32768}
    made.to_netcdf(tmp_path / "m.nc", engine="h5netcdf", encoding={"M1": packing})
    with xr.open_dataset(tmp_path / "m.nc", engine="h5netcdf") as back:
        found = column(read_source(tmp_path / "m.nc"), "M1")[0]
        np.testing.assert_allclose(found, back["M1"].values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[:150], SIGNAL[:150], rtol=0, atol=1.01e-3)
    assert np.isnan(found[150:]).all()


def test_values_that_stand_for_missing_ones_are_not_a_number(tmp_path: Path) -> None:
    path, stored = tmp_path / "m.h5", np.array([0.5, 1e20, -9999.0, 3.0], dtype=np.float32)
    write_packed(path, stored, _FillValue=1e20, missing_value=[-9999.0, -1.0])
    np.testing.assert_array_equal(column(read_source(path), "M1"), [[0.5, np.nan, np.nan, 3.0]])
    write_packed(path, np.array([241, 1, 2], dtype=np.uint8), _FillValue=-15)  # 241 modulo 256
    np.testing.assert_array_equal(column(read_source(path), "M1"), [[241.0, 1.0, 2.0]])
    write_packed(path, np.array([-9999.0]), _FillValue=-9999.0)
    assert read_source(path).skipped == {"M1": "is missing"}


@pytest.mark.parametrize(
    ("attributes", "words"),
    [
        ({"scale_factor": 0.0}, "has scale_factor = 0.0, which must be one finite number, not 0"),
        ({"scale_factor": "2"}, "has scale_factor = 2, which must be one finite number, not 0"),
        ({"add_offset": np.nan}, "has add_offset = nan, which must be one finite number"),
        ({"add_offset": [1.0, 2.0]}, "has add_offset = [1. 2.], which must be one finite number"),
    ],
)
def test_a_packing_that_is_none_makes_no_column(tmp_path: Path, attributes: dict[str, Any], words: str) -> None:
    write_packed(tmp_path / "m.h5", SIGNAL, **attributes)
    source = read_source(tmp_path / "m.h5")
    assert source.names == ("M2",) and source.skipped == {"M1": words}


@pytest.mark.parametrize(("width", "tolerance"), [(1, 1 / 128), (2, 2**-15), (3, 2**-23)])
def test_wav(tmp_path: Path, width: int, tolerance: float) -> None:
    sine = 0.5 * np.sin(2 * np.pi * 30.0 * TIME)
    whole = np.round(sine * 2 ** (8 * width - 1)).astype(np.int64) + (128 if width == 1 else 0)
    with wave.open(str(tmp_path / "m.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(width)
        file.setframerate(1000)
        file.writeframes(b"".join(int(v).to_bytes(width, "little", signed=width > 1) for v in whole))
    (one,) = read_source(tmp_path / "m.wav").columns
    assert one.rate == 1000.0 and one.name == "m"
    np.testing.assert_allclose(one.values[0], sine, atol=tolerance)


TABLES = {
    "brackets": "time [s],theta1 [deg],M1\n0.0,1.5,2\n0.001,2.5,3\n",
    "unit row": "# bench 4\ntime,theta1,M1\ns,deg,\n0.0,1.5,2\n0.001,2.5,3\n",
    "tabs and comments": "% made by a logger\n% time [s]\ttheta1 (deg)\tM1\n0.0\t1.5\t2\n0.001\t2.5\t3\n",
    "decimal comma": '"time [s]";"theta1 [deg]";"M1"\r\n0,0;1,5;2\r\n0,001;2,5;3\r\n',
    "blanks": "time[s]  theta1[deg]  M1\n 0.0    1.5  2\n 1e-3 2.5  3\n",
    "blanks before units": "time [s] theta1 [deg] M1\n 0.0    1.5  2\n 1e-3 2.5  3\n",
    "blanks and a row of units": "time theta1 M1\n[s] [deg] []\n 0.0    1.5  2\n 1e-3 2.5  3\n",
    "decimal commas in quotes": '"time [s]","theta1 [deg]","M1"\r\n"0,0","1,5","2"\r\n"0,001","2,5","3"\r\n',
    "semicolons and quotes": '"time [s]";"theta1 [deg]";"M1"\r\n"0,0";"1,5";"2,0"\r\n"0,001";"2,5";"3,0"\r\n',
    "Fortran": "time [s],theta1 [deg],M1\n0.0D+00,1.5D0,2\n1.0d-03,.25D+1,3\n",
    "separator at the end": "time [s],theta1 [deg],M1,\n0.0,1.5,2,\n0.001,2.5,3,\n",
}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_text_tables(tmp_path: Path, name: str, encoding: str) -> None:
    path = tmp_path / "m.csv"
    path.write_bytes(TABLES[name].encode(encoding))
    source = read_source(path)
    assert source.names == ("time", "theta1", "M1")
    assert [one.unit for one in source.columns] == ["s", "deg", None]
    np.testing.assert_array_equal(column(source, "theta1"), [[1.5, 2.5]])
    np.testing.assert_array_equal(column(source, "time"), [[0.0, 0.001]])


def test_text_keeps_every_digit_and_old_encodings(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(TIME.tolist(), SIGNAL.tolist(), strict=True))
    path.write_bytes(f"t [s],Winkel An [\u00b0]\n{rows}\n".encode("latin-1"))
    source = read_source(path)
    np.testing.assert_array_equal(column(source, "Winkel An"), [SIGNAL])
    assert source.columns[1].unit == "\u00b0"


def test_units_with_blanks_stay_whole_in_a_head_with_blanks(tmp_path: Path) -> None:
    (tmp_path / "m.txt").write_text("t [s] M1 [N m] M2 (kN m)\n0 1 2\n1 2 3\n")
    source = read_source(tmp_path / "m.txt")
    assert source.names == ("t", "M1", "M2") and [one.unit for one in source.columns] == ["s", "N m", "kN m"]


def test_missing_cells_are_not_a_number(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("t,a\n0,1\n1,\n2,3\n")
    assert np.isnan(column(read_source(tmp_path / "m.csv"), "a")).tolist() == [[False, True, False]]


BAD: dict[str, tuple[bytes, str]] = {
    "empty.mat": (b"", "is empty"),
    "blank.csv": (b" \n\n", "is empty"),
    "garbage.mat": (b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\xff" * 200, "truncated or no MAT-file"),
    "garbage.tdms": (b"TDSm" + b"\x00" * 60, "TDMS"),
    "garbage.wav": (b"RIFF\x00\x00\x00\x00WAVEfmt ", "truncated or no WAV"),
    "garbage.h5": (b"\x89HDF\r\n\x1a\n" + b"\x00" * 100, "truncated or no HDF5"),
    "nothing.uff": (b"    -1\n   151\nx\n    -1\n", "no dataset 58"),
    "words.csv": (b"a,b\nx,y\n", "no table of numbers"),
    "headless.csv": (b"1,2\n3,4\n", "has no head"),
    "short.csv": (b"a,b,c\n1,2,3\n4,5,6\n7,8\n", r"row 2 .* has 2 cells, the head names 3"),
    "odd.csv": (b"a,b\n1,2\n3,4\n5,x\n", r"row 2 .* 'x' in column 2"),
    "twice.csv": (b"a,a\n1,2\n3,4\n", "2 columns called 'a'"),
    "binary.csv": (b"a,b\n1,2\n\x00\x00\x00", "is no text"),
    "sheet.xlsx": (b"PK\x03\x04....", "ZIP archive"),
    "what.xyz": (b"hello", "no known format"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_read_is_one_sentence(tmp_path: Path, name: str) -> None:
    content, words = BAD[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RecordError, match=words) as caught:
        read_source(tmp_path / name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", ["mat", "h5", "uff", "tdms", "wav"])
def test_truncated_files_are_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"m.{suffix}"
    values = np.random.default_rng(3).standard_normal(20000)
    if suffix == "mat":
        scipy.io.savemat(path, {"a": values})
    elif suffix == "h5":
        h5py.File(path, "w").create_dataset("a", data=values).file.close()
    elif suffix == "uff":
        write_uff(path, dataset_58("a", values, "m"))
    elif suffix == "tdms":
        with nptdms.TdmsWriter(path) as writer:
            writer.write_segment([nptdms.ChannelObject("g", "a", values)])
    else:
        scipy.io.wavfile.write(path, 1000, values)
    assert read_source(path).columns[0].samples == 20000
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(RecordError) as caught:
        read_source(path)
    assert "\n" not in str(caught.value)


def test_a_file_that_crashes_its_reader_is_refused(tmp_path: Path) -> None:
    """Bytes of the file are changed at random; read in our own process it would end that without a word."""
    with pytest.raises(RecordError, match="truncated or no MAT-file"):
        read_source(OCTAVE / "crash.mat")


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    """Object arrays are what pickles hide in: they are skipped by type, and never decoded."""
    scipy.io.savemat(tmp_path / "m.mat", {"a": np.array([SIGNAL, "text"], dtype=object)})
    with pytest.raises(RecordError, match="holds no signal: a is a cell array"):
        read_source(tmp_path / "m.mat")


def test_a_square_has_no_direction_of_time(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "m.mat", {"a": np.ones((5, 5))})
    with pytest.raises(RecordError, match="5 x 5 values: which dimension is time cannot be told"):
        read_source(tmp_path / "m.mat")
