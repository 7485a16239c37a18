"""From columns to a record: clocks, delays, encoders, integration; refusals name channel, index and limit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from math import pi
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
import xarray as xr

import gearbench as gb
from gearbench.records import ChannelMap, ChannelSpec, RecordError

RATE, SAMPLES, PERIODS = 8000.0, 4000, 2
TEETH = (20, 30)
MESH = 40.0  # Hz; 20 mesh periods in an excitation period of 0.5 s
ABOUT: dict[str, float | str] = {
    "samples_per_period": SAMPLES,
    "mesh_frequency": MESH,
    "teeth_driver": TEETH[0],
    "teeth_driven": TEETH[1],
    "base_radius_driver": 0.03,
    "base_radius_driven": 0.045,
    "driven_boundary": "speed",
    "support_direction": "line-of-action",
}
SPEEDS = tuple(2 * pi * MESH / teeth for teeth in TEETH)


def vibration(t: np.ndarray, seed: int, highest: float = 900.0, lowest: float = 10.0) -> np.ndarray:
    """A sum of sines that repeats after 0.5 s, rms about 1."""
    return np.frombuffer(_vibration(t.tobytes(), seed, highest, lowest))


@lru_cache(maxsize=64)
def _vibration(times: bytes, seed: int, highest: float, lowest: float) -> bytes:
    t = np.frombuffer(times)
    rng = np.random.default_rng(seed)
    lines = rng.choice(np.arange(int(lowest / 2), int(highest / 2)), 40, replace=False) * 2.0
    phases = rng.uniform(0, 2 * pi, lines.size)
    return (np.sqrt(2 / lines.size) * np.sin(2 * pi * np.outer(t, lines) + phases).sum(axis=1)).tobytes()


def signals(t: np.ndarray) -> dict[str, np.ndarray]:
    """Torque, angles and displacement at any times."""
    return {
        "torque_driver": 100 + 10 * vibration(t, 1),
        "angle_driver": SPEEDS[0] * t + 1e-4 * vibration(t, 2),
        "angle_driven": SPEEDS[1] * t + 1e-4 * vibration(t, 3),
        "y_driver": 1e-5 * vibration(t, 4),
    }


TIME = np.arange(SAMPLES * PERIODS) / RATE


def write_columns(path: Path, data: Mapping[str, np.ndarray]) -> None:
    with h5py.File(path, "w") as file:
        for name, values in data.items():
            file[name] = values


def convert(
    tmp_path: Path, data: Mapping[str, np.ndarray], about: Mapping[str, Any] | None = None, **specs: dict[str, Any]
) -> xr.Dataset:
    """The record of columns in an HDF5 file; a channel is the column of its name unless `specs` says more."""
    write_columns(tmp_path / "m.h5", data)
    unit = {"torque": "N m", "angle": "rad", "y": "m"}
    channels = {}
    for name in signals(TIME[:1]):
        spec = {"column": (name,), "unit": unit[name.partition("_")[0]]} | specs.get(name, {})
        if all(column in data for column in spec["column"]):
            channels[name] = ChannelSpec(**spec)
    attributes = {key: value for key, value in {**ABOUT, "time": "t", **(about or {})}.items() if value is not None}
    return gb.convert(tmp_path / "m.h5", ChannelMap(channels, attributes))


def error(record: xr.Dataset, name: str, start: float = 0.0, run: int = 0) -> float:
    """Rms departure of a channel from what it was made of, over its rms without mean and trend."""
    t = start + np.arange(record.sizes["time"]) / float(record.attrs["sampling_rate"])
    true = signals(t)[name]
    swing = true - np.polynomial.Polynomial.fit(t, true, 1)(t)
    return float(np.std(record[name].values[run] - true) / swing.std())


def whole(**changes: np.ndarray) -> dict[str, np.ndarray]:
    return {"t": TIME, **signals(TIME)} | changes


def test_a_common_clock_copies(tmp_path: Path) -> None:
    record = convert(tmp_path, whole())
    for name, values in signals(TIME).items():
        np.testing.assert_array_equal(record[name].values[0], values)
    assert record.attrs["periods"] == 2 and record.attrs["sampling_rate"] == RATE
    assert "interpolation_error" not in record["y_driver"].attrs


def test_gain_offset_and_sign(tmp_path: Path) -> None:
    data = whole(torque_driver=-(signals(TIME)["torque_driver"] / 25.0) + 0.3)
    spec = {"sign": -1.0, "gain": 25.0, "offset": 0.3}
    record = convert(tmp_path, data, torque_driver=spec)
    np.testing.assert_allclose(record["torque_driver"].values[0], signals(TIME)["torque_driver"], rtol=1e-12)


@pytest.mark.parametrize("name", ["torque_driver", "angle_driven", "y_driver"])
@pytest.mark.parametrize("delay", [3.3e-4, -2.1e-4, 5e-4])
def test_delays_are_taken_off(tmp_path: Path, name: str, delay: float) -> None:
    data = whole(**{name: signals(TIME - delay)[name]})
    record = convert(tmp_path, data, **{name: {"delay": delay}})
    assert record.attrs["periods"] == 2  # what is lacking at an end is one period away
    assert error(record, name) < 1e-4
    assert record[name].attrs["delay_corrected"] == delay
    assert error(convert(tmp_path, data), name) > 0.1


def test_other_rates_come_onto_one_clock_within_the_stated_error(tmp_path: Path) -> None:
    fast, slow = np.arange(20000 + 200) / 20000.0, np.arange(5000 + 50) / 5000.0
    data = whole(y_driver=signals(fast)["y_driver"], torque_driver=signals(slow)["torque_driver"])
    specs = {"y_driver": {"sampling_rate": 20000.0}, "torque_driver": {"sampling_rate": 5000.0}}
    record = convert(tmp_path, data, {"sampling_rate": RATE}, **specs)
    for name in ("y_driver", "torque_driver"):
        assert error(record, name) < 1e-3
        assert record[name].attrs["interpolation_error"] < 1e-3
        assert f"{name} is interpolated from" in record.attrs["warnings"]


def test_the_stated_error_sees_what_a_slow_clock_loses(tmp_path: Path) -> None:
    """At 1500 Hz the sines above 750 Hz are lost on the way down, and the error says how much that is."""
    about = {"sampling_rate": 1500.0, "samples_per_period": 750}
    record = convert(tmp_path, whole(), about)
    assert 0.1 < error(record, "y_driver") < 1.0
    assert record["y_driver"].attrs["interpolation_error"] == pytest.approx(error(record, "y_driver"), rel=0.5)
    assert "more than 0.01" in record.attrs["warnings"]


def test_excitation_period_sets_the_clock(tmp_path: Path) -> None:
    """7999.5 Hz has no whole number of samples in 0.5 s: the record has 4000 all the same."""
    t = np.arange(8100) / 7999.5
    data = {"t": t, **signals(t)}
    record = convert(tmp_path, data, {"samples_per_period": None, "excitation_period": 0.5})
    assert (record.attrs["sampling_rate"], record.attrs["samples_per_period"]) == (8000.0, 4000)
    assert max(error(record, name) for name in signals(t)) < 1e-3


def test_jitter_and_missing_samples(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    t = np.arange(-20, 8030) / RATE + rng.uniform(-0.2, 0.2, 8050) / RATE
    t = np.delete(t, [1000, 3000, 3001])
    record = convert(tmp_path, {"t": t, **signals(t)}, {"sampling_rate": RATE})
    start = float(record["time"][0])
    for name in signals(t):
        stated = record[name].attrs["interpolation_error"]
        assert error(record, name, start) < 3 * stated < 0.05
    assert "about 3 sample(s) missing" in record.attrs["warnings"]


def test_printed_digits_are_no_jitter(tmp_path: Path) -> None:
    record = convert(tmp_path, whole(t=np.round(TIME, 5)))
    assert record.attrs["sampling_rate"] == RATE and "uniform within its digits" in record.attrs["warnings"]
    np.testing.assert_array_equal(record["y_driver"].values[0], signals(TIME)["y_driver"])


def test_wrapped_angles_are_unwrapped(tmp_path: Path) -> None:
    data = whole(angle_driver=np.degrees(signals(TIME)["angle_driver"]) % 360.0)
    record = convert(tmp_path, data, angle_driver={"unit": "deg"})
    assert error(record, "angle_driver") < 1e-9
    assert "starts again after every turn" in record.attrs["warnings"]


def test_speeds_become_angles_that_keep_step(tmp_path: Path) -> None:
    """rpm with 0.2 % of gain error: without the mesh's mean speed the transmission error would run away."""
    fine = np.arange(-1, SAMPLES * PERIODS + 1) / RATE
    data = whole()
    for number, gear in enumerate(("driver", "driven")):
        swing = signals(fine)[f"angle_{gear}"] - SPEEDS[number] * fine
        derivative = np.fft.irfft(2j * pi * np.fft.rfftfreq(8000, 1 / RATE) * np.fft.rfft(swing[1:-1]), 8000)
        data[f"angle_{gear}"] = (1.002 * SPEEDS[number] + derivative) * 30 / pi
    specs = {f"angle_{gear}": {"unit": "rpm"} for gear in ("driver", "driven")}
    record = convert(tmp_path, data, **specs)
    assert max(error(record, f"angle_{gear}") for gear in ("driver", "driven")) < 1e-6
    assert float(record["speed_driver"].mean()) == pytest.approx(1.002 * SPEEDS[0])
    assert "its zero is arbitrary" in record.attrs["warnings"]


@pytest.mark.parametrize(("wander", "repeats"), [(0.03, True), (0.15, True), (3.0, False)])
def test_mesh_phase_follows_a_speed_that_varies(tmp_path: Path, wander: float, repeats: bool) -> None:
    """The speed swings by `wander` cycles of the mesh once in the record; a mesh period that means nothing is left
    out."""
    phase = MESH * TIME + wander * np.sin(2 * pi * TIME / (TIME.size / RATE))
    angles = {
        f"angle_{gear}": 2 * pi / teeth * phase + 1e-6 * vibration(TIME, 2)
        for gear, teeth in zip(("driver", "driven"), TEETH, strict=True)
    }
    record = convert(tmp_path, whole(**angles))
    found = record.mesh_phase.values[0]
    straight = phase - wander * np.sin(2 * pi * TIME / (TIME.size / RATE))
    assert ("mesh_period" in record.attrs) == repeats
    assert ("the speed varies" in str(record.attrs.get("warnings", ""))) == (wander > 0.05)
    apart = found - (phase if wander > 0.05 else straight)
    assert np.abs(apart - apart.mean()).max() < 1e-4
    if not repeats:
        speed = np.gradient(angles["angle_driver"], 1 / RATE) * 30 / pi
        with pytest.raises(RecordError, match=r"angle_driver is integrated.*varies by 2\.\d* cycles .*limit 0\.25"):
            convert(tmp_path, whole(**angles | {"angle_driver": speed}), angle_driver={"unit": "rpm"})


def test_accelerations_are_integrated_and_the_loss_is_said(tmp_path: Path) -> None:
    omega = 2 * pi * np.fft.rfftfreq(8000, 1 / RATE)
    slow = 1e-6 * np.sin(2 * pi * 2.0 * TIME)  # below the band: lost
    y = signals(TIME)["y_driver"] + slow
    data = whole(y_driver=np.fft.irfft(-(omega**2) * np.fft.rfft(y), 8000) / 9.80665)
    record = convert(tmp_path, data, y_driver={"unit": "g", "lowest": 8.0})
    assert error(record, "y_driver") < 1e-9
    assert record["y_driver"].attrs["integrated_from_hz"] == 8.0
    np.testing.assert_allclose(record["acceleration_driver"].values[0], 9.80665 * data["y_driver"])
    assert "what lies below 8 Hz" in record.attrs["warnings"]


def test_pulse_times(tmp_path: Path) -> None:
    fine = np.arange(-800, 8800) / RATE
    angle = signals(fine)["angle_driver"]
    turns = np.arange(np.ceil(angle[0] / (2 * pi) * 2048), np.floor(angle[-1] / (2 * pi) * 2048))
    times = np.interp(turns * 2 * pi / 2048, angle, fine)
    for _ in range(6):  # Newton on the exact angle
        rate = (signals(times + 1e-7)["angle_driver"] - signals(times - 1e-7)["angle_driver"]) / 2e-7
        times -= (signals(times)["angle_driver"] - turns * 2 * pi / 2048) / rate
    spec = {"unit": "pulse times us", "pulses_per_revolution": 2048.0}
    record = convert(tmp_path, whole(angle_driver=1e6 * times), angle_driver=spec)
    found = record["angle_driver"].values[0] + turns[0] * 2 * pi / 2048
    assert np.abs(found - signals(TIME)["angle_driver"]).max() < 1e-6
    assert record["angle_driver"].attrs["pulses_per_revolution"] == 2048


@pytest.mark.parametrize("forward", [True, False])
def test_quadrature_tracks_know_the_direction(tmp_path: Path, forward: bool) -> None:
    lines = 64
    angle = signals(TIME)["angle_driver"] * (1 if forward else -1)
    a, b = (5 * (np.sin(lines * angle + shift) > 0) + 0.1 for shift in (pi / 2, 0.0))
    data = {key: value for key, value in whole().items() if key != "angle_driver"} | {"A": a, "B": b}
    spec = {"column": ("A", "B"), "unit": "V", "pulses_per_revolution": float(lines)}
    if not forward:
        with pytest.raises(RecordError, match=r"angle_driver turns backwards .* sign = -1"):
            convert(tmp_path, data, angle_driver=spec)
        spec["sign"] = -1.0
    record = convert(tmp_path, data, angle_driver=spec)
    resolution = 2 * pi / (4 * lines)
    assert record["angle_driver"].attrs["resolution"] == pytest.approx(resolution)
    off = record["angle_driver"].values[0] - signals(TIME)["angle_driver"]
    assert np.ptp(off) < 1.1 * resolution


def test_counts_and_one_track(tmp_path: Path) -> None:
    angle = signals(TIME)["angle_driver"]
    counts = np.floor(angle / (2 * pi) * 4096)
    record = convert(
        tmp_path, whole(angle_driver=counts), angle_driver={"unit": "counts", "pulses_per_revolution": 4096.0}
    )
    assert np.abs(record["angle_driver"].values[0] - angle).max() < 2 * pi / 4096
    t = np.arange(-800, 8800) / RATE
    track = {"track": np.sin(64 * signals(t)["angle_driver"])}
    spec = {"column": ("track",), "unit": "V", "pulses_per_revolution": 64.0, "time": "t2"}
    data = {key: value for key, value in whole().items() if key != "angle_driver"} | track | {"t2": t}
    record = convert(tmp_path, data, {"periods": 2}, angle_driver=spec)
    off = record["angle_driver"].values[0] - angle
    assert np.ptp(off) < 2e-3


REFUSALS: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any], str]] = {
    "nan": ({"y_driver": np.where(np.arange(8000) == 77, np.nan, signals(TIME)["y_driver"])}, {}, {},
            r"channel y_driver .* first at sample 77 \(run 0\)"),
    "clipped": ({"torque_driver": np.minimum(signals(TIME)["torque_driver"], 110.0)}, {}, {},
                r"channel torque_driver .* is clipped at 110: .* in a row from sample \d+"),
    "unequal": ({"y_driver": signals(TIME)["y_driver"][:-5]}, {}, {}, "7995 samples, but its times in t are 8000"),
    "no clock": ({}, {"time": None}, {}, "neither times nor a sampling rate"),
    "gap": ({"t": np.where(np.arange(8000) > 500, TIME + 0.01, TIME)}, {}, {}, "gap of 0.01012 s after sample 500"),
    "clock falls": ({"t": np.where(np.arange(8000) == 300, 0.0, TIME)}, {}, {}, "does not rise at sample 300"),
    "short": ({}, {"periods": 3}, {}, "share 8000 samples at 8000 Hz, less than the 3 x 4000"),
    "wrong rate": ({}, {"time": None, "sampling_rate": 16000.0}, {}, "mesh frequency of 80 Hz, but 40 Hz is declared"),
    "ms": ({"t": 1e3 * TIME}, {"sampling_rate": RATE}, {}, "has 8 Hz, where sampling_rate_hz = 8000 .*time in ms"),
    "unknown unit": ({}, {}, {"y_driver": {"unit": "furlong"}}, "unit 'furlong', which is not known"),
    "nm": ({}, {}, {"torque_driver": {"unit": "nm"}}, r"'nm' \(length\).*newton metres are written N m"),
    "wrong unit": ({}, {}, {"y_driver": {"unit": "kN"}}, r"'kN' \(force\), but the channel is a length in m"),
    "no unit": ({}, {}, {"y_driver": {"unit": None}}, r"has no unit: give \[channel.y_driver\] unit"),
    "no column": ({}, {}, {"y_driver": {"column": ("t[2]",)}}, "t has 1 rows, counted from 1"),
    "lacks": ({}, {"teeth_driver": None, "base_radius_driven": None}, {}, "needs teeth_driver, base_radius_driven_mm"),
    "pulses": ({}, {}, {"angle_driver": {"unit": "counts"}}, "counts pulses: give pulses_per_revolution"),
    "whose samples": (
        {},
        {},
        {"y_driver": {"sampling_rate": 20000.0}},
        r"different clocks .*y_driver 20000 Hz.*say sampling_rate_hz",
    ),
    "jump": ({"angle_driver": np.where(TIME > 0.3, 50.0, 0.0) + signals(TIME)["angle_driver"]}, {}, {},
             r"angle_driver .* jumps by .* after sample 2400"),
    "backwards": ({}, {}, {"angle_driven": {"sign": -1.0}}, "angle_driven turns backwards"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSALS)
def test_refusals_name_channel_index_and_limit(tmp_path: Path, name: str) -> None:
    data, about, specs, words = REFUSALS[name]
    if name == "no column":
        with pytest.raises(RecordError, match=words):
            write_columns(tmp_path / "n.h5", whole())
            spec = {
                n: ChannelSpec(("t[2]",) if n == "y_driver" else (n,), "m" if n == "y_driver" else None)
                for n in ["y_driver"]
            }
            gb.convert(tmp_path / "n.h5", ChannelMap(spec, {**ABOUT, "time": "t"}))
        return
    with pytest.raises(RecordError, match=words) as caught:
        convert(tmp_path, whole(**data), about, **specs)
    assert "\n" not in str(caught.value)


def test_runs_become_realisations(tmp_path: Path) -> None:
    data = {name: values if name == "t" else np.stack([values, values]) for name, values in whole().items()}
    record = convert(tmp_path, data)
    assert record.sizes["realisation"] == 2
    data["y_driver"] = data["y_driver"][:1]
    with pytest.raises(RecordError, match="differ in their number of runs"):
        convert(tmp_path, data)


def test_a_column_may_number_the_runs(tmp_path: Path) -> None:
    table = np.vstack([np.column_stack([np.full(8000, n), *whole().values()]) for n in (1, 2)])
    np.savetxt(tmp_path / "m.csv", table, delimiter=",", header=",".join(["run", *whole()]), comments="", fmt="%.17g")
    units = {"torque_driver": "N m", "angle_driver": "rad", "angle_driven": "rad", "y_driver": "m"}
    spoken = {name: ChannelSpec((name,), unit) for name, unit in units.items()}
    record = gb.convert(tmp_path / "m.csv", ChannelMap(spoken, {**ABOUT, "time": "t", "run": "run"}))
    assert record.sizes["realisation"] == 2
    np.testing.assert_array_equal(record["y_driver"].values[1], signals(TIME)["y_driver"])


def test_several_files_are_runs_or_parts(tmp_path: Path) -> None:
    data = whole()
    spoken = {n: ChannelSpec((n,), u) for n, u in {"torque_driver": "N m", "angle_driver": "rad",
                                                   "angle_driven": "rad"}.items()}  # fmt: skip
    paths = [tmp_path / f"{n}.h5" for n in range(2)]
    for path in paths:
        write_columns(path, data)
    made = gb.convert(paths, ChannelMap(spoken, {**ABOUT, "time": "t"}))
    assert made.sizes["realisation"] == 2
    for name in spoken:
        scipy.io.wavfile.write(tmp_path / f"{name}.wav", 8000, data[name])
    made = gb.convert([tmp_path / f"{name}.wav" for name in spoken], ChannelMap(spoken, ABOUT))
    assert made.sizes["realisation"] == 1 and error(made, "angle_driver") < 1e-9


def test_shaft_torque_is_said_to_be_one(tmp_path: Path) -> None:
    for location, said in ((None, "(location: not given)"), ("shaft", "(location: shaft)"), ("gear", None)):
        record = convert(tmp_path, whole(), torque_driver={"location": location})
        warned = "it is not gear torque unless" in str(record.attrs.get("warnings", ""))
        assert warned == (said is not None) and (said or "") in str(record.attrs.get("warnings", ""))
        np.testing.assert_array_equal(record["torque_driver"].values[0], signals(TIME)["torque_driver"])


def test_provenance_names_the_file_and_the_map(tmp_path: Path) -> None:
    import hashlib

    record = convert(tmp_path, whole())
    settings = json.loads(record.attrs["provenance"])["settings"]
    digest = hashlib.sha256((tmp_path / "m.h5").read_bytes()).hexdigest()
    assert settings["converted"] == [{"name": "m.h5", "sha256": digest}]
    assert "[channel.y_driver]" in settings["channel_map"]


def test_what_a_file_marks_as_missing_is_refused_with_its_place(tmp_path: Path) -> None:
    """In NetCDF and HDF5 a number of the file's own choice stands for a missing value."""
    data = whole()
    units = {"torque_driver": "N m", "angle_driver": "rad", "angle_driven": "rad"}
    channels = {name: ChannelSpec((name,), unit) for name, unit in units.items()}
    for marked, words in (
        ("torque_driver", r"torque_driver .* has 2 value\(s\) that are missing or not finite, first at sample 70"),
        ("t", r"time column t has 2 value\(s\) that are not finite, first at sample 70"),
    ):
        held = data[marked].copy()
        held[70:72] = -9999.0
        write_columns(tmp_path / "m.h5", data | {marked: held})
        with h5py.File(tmp_path / "m.h5", "a") as file:
            file[marked].attrs["_FillValue"] = -9999.0
        with pytest.raises(RecordError, match=words):
            gb.convert(tmp_path / "m.h5", ChannelMap(channels, {**ABOUT, "time": "t"}))
