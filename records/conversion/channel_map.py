"""The channel map: which column of a file is which channel of the record, and what the record says of its rig.

    [record]
    samples_per_period = 8192
    mesh_frequency_hz = 20.0
    teeth_driver = 62

    [channel.angle_driver]
    column = "enc1"
    unit = "deg"

A value of a channel is sign x gain x (column - offset), in `unit`; the channel lags by `delay_s`, which is taken off.
"""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, pi
from pathlib import Path
from typing import Any

from gearbench.records.channels import unit_of_channel
from gearbench.records.errors import RecordError

_LARGEST_FILE = 1_000_000  # bytes

# Key of [record] -> attribute (SI) and its size in the attribute's unit.
_NUMBERS: dict[str, tuple[str, float]] = {
    "sampling_rate_hz": ("sampling_rate", 1.0),
    "samples_per_period": ("samples_per_period", 1.0),
    "periods": ("periods", 1.0),
    "excitation_period_s": ("excitation_period", 1.0),
    "start_s": ("start", 1.0),
    "mesh_period_s": ("mesh_period", 1.0),
    "mesh_frequency_hz": ("mesh_frequency", 1.0),
    "speed_driver_rpm": ("speed_driver", pi / 30),
    "teeth_driver": ("teeth_driver", 1.0),
    "teeth_driven": ("teeth_driven", 1.0),
    "base_radius_driver_m": ("base_radius_driver", 1.0),
    "base_radius_driven_m": ("base_radius_driven", 1.0),
    "base_radius_driver_mm": ("base_radius_driver", 1e-3),
    "base_radius_driven_mm": ("base_radius_driven", 1e-3),
    "inertia_driver_kg_m2": ("inertia_driver", 1.0),
    "inertia_driven_kg_m2": ("inertia_driven", 1.0),
    "working_pressure_angle_rad": ("working_pressure_angle", 1.0),
    "working_pressure_angle_deg": ("working_pressure_angle", pi / 180),
    "torque_mean_nm": ("torque_mean", 1.0),
}
_WHOLE = ("samples_per_period", "periods", "teeth_driver", "teeth_driven")
_WORDS: dict[str, tuple[str, ...]] = {
    "support_direction": ("tangential", "line-of-action"),
    "driven_boundary": ("torque", "speed", "inertia"),
    "mesh_phase_origin": ("geometry", "arbitrary"),
    "condition": (),
    "time": (),
    "run": (),
}
_SAME = (("mesh_period", "mesh_frequency", "speed_driver"), ("samples_per_period", "excitation_period"))
# Orders of a turn that an encoder may repeat.
MOST_ORDERS = 32
# Where a torque may be measured.
LOCATIONS = ("gear", "outermost", "shaft", "motor")


@dataclass(frozen=True)
class ChannelSpec:
    """Where a channel comes from. Value = sign x gain x (column - offset) in `unit` (None: the file's own).

    `column`: one, or the two tracks of a quadrature encoder. `delay` [s] by which the channel lags; `time`: its own
    column of times; `sampling_rate` [Hz] where the file knows none; `lowest` [Hz]: integration leaves out what lies
    below. `location`: of the sensor. `runout_orders`: what an angle repeats with each turn is taken off up to that
    order. `clock` "teeth": the channel comes from a device whose clock runs at a rate of its own, known by the teeth
    that both gears pass.
    """

    column: tuple[str, ...]
    unit: str | None = None
    sign: float = 1.0
    gain: float = 1.0
    offset: float = 0.0
    delay: float = 0.0
    pulses_per_revolution: float | None = None
    location: str | None = None
    time: str | None = None
    sampling_rate: float | None = None
    lowest: float | None = None
    runout_orders: float | None = None
    clock: str | None = None


@dataclass(frozen=True)
class ChannelMap:
    """Channels by name, and attributes of the record in SI units as far as the map tells them."""

    channels: Mapping[str, ChannelSpec]
    attributes: Mapping[str, float | str] = field(default_factory=dict)


_SPEC_KEYS: dict[str, str] = {
    "column": "column",
    "unit": "unit",
    "sign": "sign",
    "gain": "gain",
    "offset": "offset",
    "delay_s": "delay",
    "pulses_per_revolution": "pulses_per_revolution",
    "location": "location",
    "time": "time",
    "sampling_rate_hz": "sampling_rate",
    "lowest_hz": "lowest",
    "runout_orders": "runout_orders",
    "clock": "clock",
}


def read_map(path: str | Path) -> ChannelMap:
    """The channel map in a TOML file. Raises RecordError naming key, value and limit."""
    file = Path(path)
    if not file.is_file():
        raise RecordError(f"channel map {file} does not exist")
    if file.stat().st_size > _LARGEST_FILE:
        raise RecordError(f"channel map {file} has more than {_LARGEST_FILE // 1_000_000} MB, which no map needs")
    try:
        table = tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise RecordError(f"channel map {file} is not valid TOML: {error}") from error
    try:
        return parse_map(table)
    except RecordError as error:
        raise RecordError(f"channel map {file}: {error}") from None


def parse_map(table: Mapping[str, Any]) -> ChannelMap:
    """The channel map in a parsed table. Raises RecordError naming key, value and limit."""
    _known(table, ("record", "channel"), "")
    attributes: dict[str, float | str] = {}
    for key, value in _table(table.get("record", {}), "record").items():
        attribute, found = _attribute(key, value)
        if attribute in attributes:
            raise RecordError(f"record.{key} is given twice, in two units")
        attributes[attribute] = found
    for group in _SAME:
        given = [name for name in group if name in attributes]
        if len(given) > 1:
            raise RecordError(f"record: give one of {' and '.join(given)}, not both")
    channels = {
        name: _spec(name, _table(entry, f"channel.{name}"))
        for name, entry in _table(table.get("channel", {}), "channel").items()
    }
    if not channels:
        raise RecordError('the table channel is empty: [channel.NAME] with column = "..." names each one')
    return ChannelMap(channels, attributes)


def map_text(channel_map: ChannelMap, missing: Sequence[str] = ()) -> str:
    """The map as TOML, in SI units, which `read_map` reads back exactly; keys still `missing` as comments."""
    lines = ["# Channel map: value = sign x gain x (column - offset), in the unit given.", "[record]"]
    keys = {attribute: key for key, (attribute, size) in _NUMBERS.items() if size == 1.0}
    for attribute, value in channel_map.attributes.items():
        if attribute == "speed_driver":
            lines.append(f"speed_driver_rpm = {float(value) * 30 / pi!r}")
        elif attribute in _WHOLE:
            lines.append(f"{attribute} = {int(value)}")
        else:
            lines.append(f"{keys.get(attribute, attribute)} = {_toml(value)}")
    lines += [f"# missing: {key}" for key in missing]
    defaults = ChannelSpec(())
    for name, spec in channel_map.channels.items():
        lines += ["", f"[channel.{name}]"]
        for key, attribute in _SPEC_KEYS.items():
            given = getattr(spec, attribute)
            if key == "column":
                lines.append(f"column = {_toml(given[0] if len(given) == 1 else list(given))}")
            elif given != getattr(defaults, attribute):
                lines.append(f"{key} = {_toml(given)}")
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    """A number, a text or a list of texts; what JSON escapes is escaped so in TOML too."""
    return repr(float(value)) if isinstance(value, int | float) else json.dumps(value, ensure_ascii=False)


def _attribute(key: str, value: object) -> tuple[str, float | str]:
    _known({key: value}, (*_NUMBERS, *_WORDS), "record.")
    where = f"record.{key}"
    if key in _WORDS:
        if not isinstance(value, str) or not value:
            raise RecordError(f"{where} = {value!r} must be a text")
        if _WORDS[key] and value not in _WORDS[key]:
            raise RecordError(f"{where} = {value!r} must be one of {', '.join(_WORDS[key])}")
        return key, value
    attribute, size = _NUMBERS[key]
    number = _number(value, where)
    if number < 0 or (number == 0 and attribute != "start"):
        raise RecordError(f"{where} = {number:g} must be positive")
    if key in _WHOLE and number != round(number):
        raise RecordError(f"{where} = {number:g} must be a whole number")
    return attribute, number if size == 1.0 else number * size


def _spec(name: str, table: Mapping[str, Any]) -> ChannelSpec:
    where = f"channel.{name}."
    try:
        unit_of_channel(name)
    except RecordError as error:
        raise RecordError(f"[channel.{name}]: {error}") from None
    _known(table, tuple(_SPEC_KEYS), where)
    column = table.get("column")
    columns = [column] if isinstance(column, str) else column
    if not isinstance(columns, list) or len(columns) not in (1, 2) or not all(isinstance(c, str) for c in columns):
        raise RecordError(f"{where}column = {column!r} must name a column, or the two tracks of an encoder")
    found: dict[str, Any] = {"column": tuple(columns)}
    for key, value in table.items():
        if key in ("unit", "location", "time", "clock"):
            if not isinstance(value, str) or not value:
                raise RecordError(f"{where}{key} = {value!r} must be a text")
            found[_SPEC_KEYS[key]] = value
        elif key != "column":
            found[_SPEC_KEYS[key]] = _number(value, where + key)
    spec = ChannelSpec(**found)
    if spec.sign not in (1.0, -1.0):
        raise RecordError(f"{where}sign = {spec.sign:g} must be 1 or -1")
    if spec.gain == 0.0:
        raise RecordError(f"{where}gain = 0 must not be 0")
    for key in ("pulses_per_revolution", "sampling_rate", "lowest"):
        value = getattr(spec, key)
        if value is not None and not value > 0:
            raise RecordError(f"{where}{key} = {value:g} must be positive")
    if spec.clock not in (None, "teeth"):
        raise RecordError(f"{where}clock = {spec.clock!r} must be 'teeth'")
    orders = spec.runout_orders
    if orders is not None and (orders != round(orders) or not 1 <= orders <= MOST_ORDERS):
        raise RecordError(f"{where}runout_orders = {orders:g} must be a whole number from 1 to {MOST_ORDERS}")
    if name.startswith("torque_") and spec.location is not None and spec.location not in LOCATIONS:
        raise RecordError(f"{where}location = {spec.location!r} must be one of {', '.join(LOCATIONS)}")
    return spec


def _known(table: Mapping[str, Any], keys: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in keys:
            near = difflib.get_close_matches(key, keys, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(keys)}"
            raise RecordError(f"{where}{key} is no key of a channel map{hint}")


def _table(value: object, where: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise RecordError(f"{where} = {value!r} must be a table")
    return value


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise RecordError(f"{where} = {value!r} must be a finite number")
    return float(value)
