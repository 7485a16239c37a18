"""Channel maps: what they may say, the way to a file and back, units, and guesses from names."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest

from gearbench.records import ChannelMap, ChannelSpec, RecordError, Source, guess_map, map_text, read_map
from gearbench.records.conversion.channel_map import parse_map
from gearbench.records.formats.source import make_column
from gearbench.records.formats.unit_words import si_word, unit_of

CHANNEL = {"channel": {"dte": {"column": "te"}}}


def test_a_map_is_the_same_after_a_file(tmp_path: Path) -> None:
    spec = ChannelSpec(("A", "B"), "V", -1.0, 2.5, 0.1, 1e-4, 1024.0, 'housing "north"', "t2", 5e4, 3.0)
    about: dict[str, float | str] = {
        "samples_per_period": 4096,
        "mesh_period": 0.1 / 3,
        "base_radius_driver": 0.05826094248872632,
        "support_direction": "tangential",
        "time": "Zeit [s]",
    }
    made = ChannelMap({"angle_driver": spec, "dte": ChannelSpec(("te",))}, about)
    (tmp_path / "map.toml").write_text(map_text(made), encoding="utf-8")
    assert read_map(tmp_path / "map.toml") == made


def test_keys_carry_units() -> None:
    record = {"base_radius_driver_mm": 58.0, "working_pressure_angle_deg": 20.0, "speed_driver_rpm": 60.0}
    attributes = parse_map({**CHANNEL, "record": record}).attributes
    assert attributes["base_radius_driver"] == pytest.approx(0.058)
    assert attributes["working_pressure_angle"] == pytest.approx(pi / 9)
    assert attributes["speed_driver"] == pytest.approx(2 * pi)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"record": {}}, "the table channel is empty"),
        ({**CHANNEL, "record": {"teeth_drive": 3}}, "record.teeth_drive is no key of a channel map; did you mean"),
        ({**CHANNEL, "record": {"teeth_driver": 3.5}}, "must be a whole number"),
        ({**CHANNEL, "record": {"periods": -1}}, "must be positive"),
        ({**CHANNEL, "record": {"periods": float("nan")}}, "must be a finite number"),
        ({**CHANNEL, "record": {"periods": "two"}}, "'two' must be a finite number"),
        ({**CHANNEL, "record": {"driven_boundary": "free"}}, "must be one of torque, speed, inertia"),
        ({**CHANNEL, "record": {"mesh_period_s": 1.0, "mesh_frequency_hz": 1.0}}, "not both"),
        ({**CHANNEL, "record": {"base_radius_driver_m": 1.0, "base_radius_driver_mm": 1.0}}, "given twice"),
        ({"channel": {"angle_drivr": {"column": "a"}}}, "did you mean 'angle_driven'|did you mean 'angle_driver'"),
        ({"channel": {"dte": {}}}, "must name a column"),
        ({"channel": {"dte": {"column": ["a", "b", "c"]}}}, "must name a column"),
        ({"channel": {"dte": {"column": "a", "sign": 2}}}, "sign = 2 must be 1 or -1"),
        ({"channel": {"dte": {"column": "a", "gain": 0}}}, "gain = 0 must not be 0"),
        ({"channel": {"dte": {"column": "a", "delay": 1}}}, "did you mean 'delay_s'"),
        ({"channel": {"torque_driver": {"column": "a", "location": "x"}}}, "one of gear, outermost, shaft, motor"),
        ({"channel": {"dte": 3}}, "channel.dte = 3 must be a table"),
    ],
)  # fmt: skip
def test_refusals_name_key_value_and_limit(table: dict, words: str) -> None:
    with pytest.raises(RecordError, match=words):
        parse_map(table)


def test_a_map_that_is_no_toml(tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_text("[record\n")
    with pytest.raises(RecordError, match=r"map\.toml is not valid TOML"):
        read_map(tmp_path / "map.toml")
    with pytest.raises(RecordError, match="does not exist"):
        read_map(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("word", "quantity", "size"),
    [
        ("Nm", "torque", 1.0), ("N·m", "torque", 1.0), ("N*m", "torque", 1.0), ("N-m", "torque", 1.0),
        ("kNm", "torque", 1e3), ("N mm", "torque", 1e-3), ("Nmm", "torque", 1e-3), ("nm", "length", 1e-9),
        ("°", "angle", pi / 180), ("deg", "angle", pi / 180), ("Grad", "angle", pi / 180), ("rev", "angle", 2 * pi),
        ("rpm", "angular speed", pi / 30), ("1/min", "angular speed", pi / 30), ("min-1", "angular speed", pi / 30),
        ("U/min", "angular speed", pi / 30), ("min⁻¹", "angular speed", pi / 30), ("µm", "length", 1e-6),
        ("μm", "length", 1e-6), ("um", "length", 1e-6), ("mm/s²", "acceleration", 1e-3), ("m/s2", "acceleration", 1.0),
        ("m/s^2", "acceleration", 1.0), ("m s^-2", "acceleration", 1.0), ("g", "acceleration", 9.80665),
        ("mN", "force", 1e-3), ("MN", "force", 1e6), ("[kN]", "force", 1e3), ("ms", "time", 1e-3),
        ("pulses", "count", 1.0), ("ft-lb", "torque", 1.3558179483), ("lb-ft", "torque", 1.3558179483),
        ("ft lbf", "torque", 1.3558179483), ("in-lb", "torque", 0.1129848290), ("lb-in", "torque", 0.1129848290),
        ("oz-in", "torque", 0.00706155), ("FT-LB", "torque", 1.3558179483), ("cNm", "torque", 1e-2),
        ("daNm", "torque", 10.0), ("inch", "length", 0.0254), ("Inches", "length", 0.0254), ("mils", "length", 2.54e-5),
        ("µin", "length", 2.54e-8), ("uin", "length", 2.54e-8), ("radians", "angle", 1.0), ("RAD", "angle", 1.0),
        ("Degrees", "angle", pi / 180), ("Deg", "angle", pi / 180), ("º", "angle", pi / 180), ("Rev", "angle", 2 * pi),
        ("seconds", "time", 1.0), ("Sec", "time", 1.0), ("msec", "time", 1e-3), ("usec", "time", 1e-6),
        ("µsec", "time", 1e-6), ("Rpm", "angular speed", pi / 30), ("rad/sec", "angular speed", 1.0),
        ("Deg/Sec", "angular speed", pi / 180), ("º/s", "angular speed", pi / 180), ("1/Min", "angular speed", pi / 30),
        ("m/sec^2", "acceleration", 1.0), ("m/sec²", "acceleration", 1.0), ("m·s⁻²", "acceleration", 1.0),
        ("m/s/s", "acceleration", 1.0),
    ],
)  # fmt: skip
def test_unit_words(word: str, quantity: str, size: float) -> None:
    unit = unit_of(word, "here")
    assert (unit.quantity, unit.factor) == (quantity, pytest.approx(size))


@pytest.mark.parametrize("word", ["M", "NM", "MM", "Mm", "KN", "Kn", "mn", "S", "MS", "G", "MRAD", "IN", "lb", "LB"])
def test_case_counts_where_it_means_something_and_a_pound_may_be_a_mass(word: str) -> None:
    with pytest.raises(RecordError, match="which is not known"):
        unit_of(word, "here")


def test_a_pound_is_a_force_where_a_force_is_asked_for() -> None:
    assert unit_of("lb", "here", "force").factor == pytest.approx(4.4482216152605)
    with pytest.raises(RecordError, match="'lb', which is not known"):
        unit_of("lb", "here", "torque")
    found = guess_map(source(("force", "lb"), ("torque_driver", "lb")), KNOWN)
    assert set(found.channel_map.channels) == {"force"}


@pytest.mark.parametrize(
    ("word", "quantity", "hint"),
    [
        ("Newtn m", "torque", None), ("lbs-ft", "torque", "lb ft"), ("degre", "angle", "degree"),
        ("rad/ss", "angular speed", "rad/s"), ("micrn", "length", "micron"), ("secnds", "time", "seconds"),
        ("dNm", "torque", None), ("uNm", "torque", None), ("NM", "torque", None), ("mkm", "length", None),
        ("nsec", "time", None), ("grad", "angle", None), ("thou", "length", None),
    ],
)  # fmt: skip
def test_hints_stay_within_a_quantity_and_never_change_a_prefix(word: str, quantity: str, hint: str | None) -> None:
    with pytest.raises(RecordError) as caught:
        unit_of(word, "here", quantity)
    said = str(caught.value).partition("which is not known; ")[2]
    listed = f"units of {quantity} are {si_word(quantity)}, "
    assert said == f"did you mean {hint!r}?" if hint else said.startswith(listed)


def test_temperatures_have_a_zero() -> None:
    unit = unit_of("°C", "here")
    assert (20 + unit.zero) * unit.factor == pytest.approx(293.15)
    unit = unit_of("degF", "here")
    assert (68 + unit.zero) * unit.factor == pytest.approx(293.15)


def source(*columns: tuple[str, str | None], **facts: float | str) -> Source:
    values = np.random.default_rng(1).standard_normal(50)
    made = tuple(make_column(name, values, unit=unit) for name, unit in columns)
    return Source(Path("file.mat"), "MAT", made, facts)


NAMES = {
    "theta1": "angle_driver", "theta_2": "angle_driven", "angle_in": "angle_driver", "M1": "torque_driver",
    "input torque": "torque_driver", "enc_driver": "angle_driver", "Drehmoment_An": "torque_driver",
    "Winkel_Ab": "angle_driven", "TorqueOut": "torque_driven", "y2": "y_driven", "n1": "speed_driver",
    "Drehzahl Abtrieb": "speed_driven", "acc_pinion": "acceleration_driver", "meas.M2": "torque_driven",
    "angle_driver": "angle_driver", "dte": "dte", "t": "time", "Zeit": "time", "run": "run",
    "voltage": None, "channel 7": None, "torque": None, "theta": None, "in_out_angle": None,
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_names(name: str) -> None:
    from gearbench.records.conversion.guess import _use

    assert _use(make_column(name, np.arange(9.0))) == NAMES[name]


KNOWN: dict[str, float | str] = {
    "samples_per_period": 10, "teeth_driver": 20, "teeth_driven": 30, "base_radius_driver": 0.03,
    "base_radius_driven": 0.04, "driven_boundary": "speed",
}  # fmt: skip


def test_words_and_units_of_the_file_are_certain() -> None:
    found = guess_map(
        source(("time", "s"), ("input torque", "Nm"), ("driver angle", "deg"), ("driven angle", "deg")), KNOWN
    )
    assert found.certain
    assert set(found.channel_map.channels) == {"torque_driver", "angle_driver", "angle_driven"}
    assert found.channel_map.attributes == {"time": "time"}


def test_symbols_and_missing_units_are_doubts() -> None:
    found = guess_map(source(("t", None), ("M1", "Nm"), ("driver angle", None), ("theta2", "rad")), KNOWN)
    assert not found.certain and not found.missing and len(found.doubts) == 3
    assert any("the unit rad by guess" in doubt for doubt in found.doubts)


def test_two_columns_for_one_channel_are_never_chosen_between() -> None:
    found = guess_map(source(("input torque", "Nm"), ("driver torque", "Nm")), KNOWN)
    assert "torque_driver" not in found.channel_map.channels
    assert any("could each be torque_driver" in doubt for doubt in found.doubts)
    assert "[channel.torque_driver]" in found.missing


def test_units_that_do_not_fit_are_not_taken() -> None:
    found = guess_map(source(("input torque", "bar"), ("driver angle", "kN")), KNOWN)
    assert found.channel_map.channels == {} and len(found.doubts) == 2


def test_speeds_and_accelerations_stand_in() -> None:
    found = guess_map(source(("driver speed", "rpm"), ("driven angle", "rad"), ("driver acceleration", "g")), KNOWN)
    assert found.channel_map.channels["angle_driver"] == ChannelSpec(("driver speed",), "rpm")
    assert found.channel_map.channels["y_driver"] == ChannelSpec(("driver acceleration",), "g")


def test_missing_attributes_are_named_and_facts_of_the_file_count() -> None:
    columns = (("input torque", "Nm"), ("driver angle", "deg"), ("driven angle", "deg"))
    assert "teeth_driver" in guess_map(source(*columns)).missing
    assert "teeth_driver" not in guess_map(source(*columns, **{"bench.teeth_driver": 20.0})).missing
