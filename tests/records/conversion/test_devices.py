"""Encoders that run out and devices with clocks of their own: what was put in comes out, and the rest is left alone."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

from gearbench.records import ChannelMap, ChannelSpec, RecordError
from gearbench.records.conversion.convert import convert_sources

RATE, SAMPLES, PERIODS = 2000.0, 2000, 2
TEETH, MESH = (20, 30), 100.0  # 10 and 6.7 turns in two seconds
SPEEDS = tuple(2 * pi * MESH / teeth for teeth in TEETH)
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
UNITS = {"torqu": "N m", "angle": "rad", "y_dri": "m"}
TIME = np.arange(SAMPLES * PERIODS) / RATE
E1, E2 = 1.2e-3 * np.exp(-0.7j), 2e-4 * np.exp(-2.1j)  # e cos(theta - phi): e exp(-j phi)


def angle(gear: int, t: np.ndarray) -> np.ndarray:
    """True angle: steady rotation, a vibration that repeats after a second, which both gears in mesh share, and a
    tenth of it that they do not."""
    swing = vibration(7, t) + 0.1 * vibration(gear, t)
    return SPEEDS[gear] * t + 0.3 + 2e-5 * TEETH[0] / TEETH[gear] * swing


def vibration(seed: int, t: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(seed)
    lines, phases = rng.choice(np.arange(2, 400), 30, replace=False), rng.uniform(0, 2 * pi, 30)
    return np.sin(2 * pi * np.outer(t, lines) + phases).sum(axis=1)


def read(true: np.ndarray) -> np.ndarray:
    """What an encoder that runs out says."""
    return true + (E1 * np.exp(1j * true) + E2 * np.exp(2j * true)).real


def columns() -> dict[str, np.ndarray]:
    return {
        "t": TIME,
        "torque_driver": 50 + np.sin(2 * pi * 70 * TIME),
        "angle_driver": angle(0, TIME),
        "angle_driven": angle(1, TIME),
        "y_driver": 1e-6 * np.sin(2 * pi * 70 * TIME),
    }


def convert(tmp_path: Path, data: dict[str, np.ndarray], **specs: dict[str, Any]) -> xr.Dataset:
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file.update(data)
    channels = {
        name: ChannelSpec(**({"column": (name,), "unit": UNITS[name[:5]]} | specs.get(name, {})))
        for name in data
        if name != "t"
    }
    return convert_sources([tmp_path / "m.h5"], ChannelMap(channels, ABOUT | {"time": "t"}))


def test_runout_is_found_and_taken_off(tmp_path: Path) -> None:
    data = columns() | {"angle_driven": read(angle(1, TIME))}
    record = convert(tmp_path, data, angle_driven={"runout_orders": 3.0})
    found = record["angle_driven"]
    assert found.attrs["runout_removed"] == pytest.approx(abs(E1), rel=0.005)
    assert found.attrs["runout_phase"] == pytest.approx(0.7, abs=0.005)
    left = found.values[0] - angle(1, TIME)
    assert np.ptp(left) < 0.01 * 2 * abs(E1)
    assert "order 3: nothing above" in record.attrs["warnings"]
    # The other angle, and the same one unasked, stay as they are.
    np.testing.assert_array_equal(record["angle_driver"].values[0], data["angle_driver"])
    np.testing.assert_array_equal(convert(tmp_path, data)["angle_driven"].values[0], data["angle_driven"])


def test_an_angle_without_runout_stays_as_it_is(tmp_path: Path) -> None:
    record = convert(tmp_path, columns(), angle_driven={"runout_orders": 2.0})
    # A tenth of a line of the vibration, that both orders may hold by chance.
    assert np.abs(record["angle_driven"].values[0] - angle(1, TIME)).max() < 2e-6
    assert record["angle_driven"].attrs["runout_removed"] < 2e-6


@pytest.mark.parametrize("course", ["run-up", "wander"])
def test_runout_is_found_whatever_the_speed_does(tmp_path: Path, course: str) -> None:
    """Both encoders run out, of one gear or the other or both it is asked; nothing is made up of the speed."""
    more = 0.2 * TIME**2 if course == "run-up" else 0.05 * np.sin(2 * pi * 1.7 * TIME)  # turns of the driver
    true = [angle(gear, TIME) + 2 * pi * more * TEETH[0] / TEETH[gear] for gear in (0, 1)]
    for runs_out in ((False, False), (True, False), (True, True)):
        given = {
            f"angle_{name}": read(one) if runs else one
            for name, one, runs in zip(("driver", "driven"), true, runs_out, strict=True)
        }
        orders = {name: {"runout_orders": 2.0} for name in given}
        record = convert(tmp_path, columns() | given, **orders)
        for name, one, runs in zip(given, true, runs_out, strict=True):
            removed = record[name].attrs["runout_removed"]
            assert removed == pytest.approx(abs(E1) if runs else 0.0, rel=0.01, abs=2e-6)
            assert np.ptp(record[name].values[0] - one) < 0.02 * 2 * abs(E1)
    # Of both that run out only one is asked for; the other's does not go with it.
    record = convert(tmp_path, columns() | given, angle_driver={"runout_orders": 2.0})
    assert record["angle_driver"].attrs["runout_removed"] == pytest.approx(abs(E1), rel=0.01)
    np.testing.assert_array_equal(record["angle_driven"].values[0], given["angle_driven"])


def test_runout_of_a_single_angle_needs_a_steady_speed(tmp_path: Path) -> None:
    data = columns()
    del data["angle_driver"]
    data["angle_driven"] = data["angle_driven"] + 0.2 * 2 * pi * TIME**2
    with pytest.raises(RecordError, match=r"angle_driven.runout_orders: the speed varies, by \S* cycles .*limit 0\.05"):
        convert(tmp_path, data, angle_driven={"runout_orders": 3.0})


def test_uneven_pulses_are_evened(tmp_path: Path) -> None:
    fine = np.arange(-200, TIME.size + 200) / RATE
    reading = read(angle(1, fine))
    lines = 512
    numbers = np.arange(np.ceil(reading[0] / (2 * pi) * lines), np.floor(reading[-1] / (2 * pi) * lines))
    times = np.interp(numbers * 2 * pi / lines, reading, fine)
    for _ in range(4):  # secants on the exact reading
        speed = (read(angle(1, times + 1e-7)) - read(angle(1, times - 1e-7))) / 2e-7
        times -= (read(angle(1, times)) - numbers * 2 * pi / lines) / speed
    pulses = {"unit": "pulse times s", "pulses_per_revolution": float(lines)}
    data = {name: values for name, values in columns().items() if name != "angle_driven"} | {"angle_driven": times}
    plain, clean = (
        convert(tmp_path, data, angle_driven=pulses | more)["angle_driven"].values[0] - angle(1, TIME)
        for more in ({}, {"runout_orders": 2.0})
    )
    assert np.ptp(plain) > 2 * abs(E1)
    assert np.ptp(clean) < 0.02 * np.ptp(plain)


@pytest.mark.parametrize("departure", [40e-6, -150e-6])
def test_a_clock_of_its_own_is_found_by_the_teeth(tmp_path: Path, departure: float) -> None:
    """The driven gear's device samples at RATE (1 + departure) and says RATE."""
    count = TIME.size + 40
    own = np.arange(count) / (RATE * (1 + departure))
    late = {"angle_driven": angle(1, own), "y_driver": 1e-6 * np.sin(2 * pi * 70 * own)}
    data = {name: values for name, values in columns().items() if name not in late} | late
    given = {"sampling_rate": RATE}
    specs: dict[str, dict[str, Any]] = {name: {"clock": "teeth", **given} for name in late}
    record = convert(tmp_path, data, **specs)
    said = record.attrs["warnings"]
    ppm = float(said.split("y_driver runs ")[1].split(" ppm")[0])
    assert ppm == pytest.approx(1e6 * departure, abs=1.0)
    assert record.attrs["sampling_rate"] == RATE
    truth = angle(1, record["time"].values)
    assert np.abs(record["angle_driven"].values[0] - truth)[100:-100].max() < 2e-6
    # Without the key it is reported, and the angle is wrong.
    plain = convert(tmp_path, data, **{name: given for name in late})
    told = float(plain.attrs["warnings"].split("rates that differ by ")[1].split(" ppm")[0])
    assert told == pytest.approx(1e6 * departure, abs=1.0)
    assert np.abs(plain["angle_driven"].values[0] - truth).max() > 5e-4


def test_equal_clocks_are_not_spoken_of(tmp_path: Path) -> None:
    assert "ppm" not in convert(tmp_path, columns()).attrs.get("warnings", "")


REFUSED: dict[str, tuple[dict[str, dict[str, Any]], str]] = {
    "not an angle": ({"y_driver": {"runout_orders": 1.0}}, "runout_orders = 1 belongs to a measured angle"),
    "no angle": ({"y_driver": {"clock": "teeth"}}, "must name the angle of one gear"),
    "both": (
        {"angle_driver": {"clock": "teeth"}, "angle_driven": {"clock": "teeth"}},
        "angle_driver and angle_driven: it must name the angle of one gear, and not of both",
    ),
    "no clock": ({"angle_driven": {"clock": "teeth", "gain": 1.004}}, r"differ by -0.40% \(limit 0.1% for clocks\)"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals(tmp_path: Path, name: str) -> None:
    specs, words = REFUSED[name]
    with pytest.raises(RecordError, match=words):
        convert(tmp_path, columns(), **specs)


def test_less_than_two_turns_tell_no_runout(tmp_path: Path) -> None:
    data = columns() | {"angle_driven": angle(1, TIME) / 5}
    with pytest.raises(RecordError, match=r"angle_driven makes 1\.33 turns, at least 2 are needed"):
        convert(tmp_path, data, angle_driven={"runout_orders": 1.0})
