"""A channel map guessed from names and units of columns, with everything that is doubtful about it.

What is not said by the file is a doubt: a guess with doubts is shown, and used only by who confirms it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from gearbench.records.channels import NAMED_UNITS, PREFIX_UNITS, unit_of_channel
from gearbench.records.conversion.attributes import facts_of, merged, missing_attributes
from gearbench.records.conversion.channel_map import ChannelMap, ChannelSpec
from gearbench.records.conversion.signals import INTEGRALS, QUANTITIES, shortened
from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Column, Source
from gearbench.records.formats.unit_words import is_unit, unit_of

# Words in a column's name -> what it measures (prefix of a channel).
_QUANTITY = {
    "torque": "torque moment drehmoment moments trq tq mom md torq",
    "angle": "angle theta phi winkel drehwinkel enc encoder drehgeber rotation ang",
    "speed": "speed omega rpm drehzahl winkelgeschwindigkeit angvel",
    "acceleration": "acc accel acceleration beschleunigung accelerometer",
    "y": "y disp displacement weg verschiebung wegaufnehmer prox proximity deflection lager bearing",
    "x": "x",
    "temperature": "temp temperature temperatur",
}
_SINGLE = {"m": "torque", "n": "speed", "a": "acceleration", "w": "speed"}  # symbols that need a side beside them
_SIDE = {
    "driver": "driver driving drive in input an antrieb pinion ritzel motor eingang 1",
    "driven": "driven out output ab abtrieb wheel rad load last brake bremse ausgang 2",
}
_TIME = {"t", "time", "zeit", "timestamp", "timestamps", "times", "elapsed"}
_RUN = {"run", "realisation", "realization", "lauf", "runs"}
_QUANTITIES = {word: name for name, words in _QUANTITY.items() for word in words.split()}
_SIDES = {word: name for name, words in _SIDE.items() for word in words.split()}
# What a unit says where the name does not.
_BY_UNIT = {
    "torque": "torque",
    "angle": "angle",
    "angular speed": "speed",
    "length": "y",
    "acceleration": "acceleration",
}


class Row(NamedTuple):
    """What is thought of a column: `use` is a channel, `time`, `run`, or empty."""

    column: str
    unit: str
    samples: str
    use: str
    remark: str


@dataclass(frozen=True)
class Guess:
    """A map, what is thought of every column, what is doubtful, and which attributes are lacking."""

    channel_map: ChannelMap
    rows: tuple[Row, ...]
    doubts: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def certain(self) -> bool:
        """Whether nothing is assumed, ambiguous or lacking."""
        return not self.doubts and not self.missing


def guess_map(source: Source, known: Mapping[str, float | str] | None = None) -> Guess:
    """The channel map that names and units of a source suggest; `known`: attributes (SI) that a case tells."""
    doubts: list[str] = []
    uses = {column.name: _use(column) for column in source.columns}
    attributes: dict[str, float | str] = {}
    for what in ("time", "run"):
        named = [column for column in source.columns if uses[column.name] == what]
        if len(named) == 1:
            attributes[what] = named[0].name
        elif named:
            doubts.append(f"{shortened([one.name for one in named])} could each be the {what}: none is taken")
    channels, remarks = _channels(source, uses, doubts)
    _angles_from_speeds(channels, remarks, uses)
    facts = facts_of(source)
    missing = missing_attributes(merged(known or {}, facts), channels)
    missing += _missing_channels(channels)
    rows = tuple(
        Row(one.name, one.unit or "", _size(one), _shown(one.name, channels, attributes), remarks.get(one.name, ""))
        for one in source.columns
    )
    return Guess(ChannelMap(channels, attributes), rows, tuple(doubts), tuple(missing))


def _channels(
    source: Source, uses: Mapping[str, str | None], doubts: list[str]
) -> tuple[dict[str, ChannelSpec], dict[str, str]]:
    """Channels that exactly one column suggests, and remarks on columns."""
    channels: dict[str, ChannelSpec] = {}
    remarks: dict[str, str] = {}
    for channel in dict.fromkeys(use for use in uses.values() if use and use not in ("time", "run")):
        named = [column for column in source.columns if uses[column.name] == channel]
        # A column that bears the channel's own name goes before others.
        exact = [column for column in named if column.name == channel] or named
        if len(exact) > 1:
            doubts.append(f"{shortened([one.name for one in exact])} could each be {channel}: none is taken")
            remarks |= {one.name: f"{channel}?" for one in exact}
            continue
        column = exact[0]
        unit = _unit(column, channel, doubts, remarks)
        if unit is None:
            continue
        channels[channel] = ChannelSpec((column.name,), unit=unit)
        if column.name != channel:
            spelt = _is_spelt(column.name, channel)
            guessed = ([] if spelt else ["quantity and gear"]) + ([] if column.unit else [f"the unit {unit}"])
            if guessed:
                doubts.append(f"{column.name} is taken as {channel}: {' and '.join(guessed)} by guess")
                remarks[column.name] = "a guess" if not spelt else "unit is a guess"
    return channels, remarks


def _unit(column: Column, channel: str, doubts: list[str], remarks: dict[str, str]) -> str | None:
    """The unit to write into the map; None, with a remark, where the column's own does not fit."""
    wanted = unit_of_channel(channel)
    if column.unit is None:
        return wanted
    of_channel = QUANTITIES[wanted]
    if not is_unit(column.unit, of_channel):
        doubts.append(f"{column.name} has the unit {column.unit!r}, which is not known: it is not taken as {channel}")
        remarks[column.name] = "unknown unit"
        return None
    quantity = unit_of(column.unit, column.name, of_channel).quantity
    if quantity == of_channel or quantity in INTEGRALS.get(of_channel, {}):
        return column.unit
    doubts.append(f"{column.name} is named like {channel} but has the unit {column.unit!r}: it is not taken")
    remarks[column.name] = "unit does not fit"
    return None


def _angles_from_speeds(
    channels: dict[str, ChannelSpec], remarks: dict[str, str], uses: Mapping[str, str | None]
) -> None:
    """Speeds stand for angles that are not there, accelerations for displacements."""
    for gear in ("driver", "driven"):
        for raw, wanted in ((f"speed_{gear}", f"angle_{gear}"), (f"acceleration_{gear}", f"y_{gear}")):
            if raw in channels and wanted not in channels and wanted not in uses.values():
                spec = channels.pop(raw)
                channels[wanted] = spec
                remarks[spec.column[0]] = "to be integrated"


def _missing_channels(channels: Mapping[str, ChannelSpec]) -> list[str]:
    if {"dte", "force"} <= set(channels):
        return []
    wanted = ("torque_driver", "angle_driver", "angle_driven")
    return [f"[channel.{name}]" for name in wanted if name not in channels]


def _use(column: Column) -> str | None:
    """Channel, "time" or "run" that a column's name and unit suggest; None if they do not."""
    name = column.name.rpartition(".")[2].rpartition("/")[2]
    if _is_channel(name):
        return name
    words = _words(name)
    if words & _TIME and (column.unit is None or _quantity(column.unit) == "time"):
        return "time"
    if words & _RUN:
        return "run"
    sides = {_SIDES[word] for word in words if word in _SIDES}
    quantities = {_QUANTITIES[word] for word in words if word in _QUANTITIES}
    if not quantities:
        quantities = {_SINGLE[word] for word in words if word in _SINGLE}
    if not quantities and column.unit is not None:
        quantities = {_BY_UNIT[q] for q in [_quantity(column.unit)] if q in _BY_UNIT}
    if len(quantities) != 1 or len(sides) != 1:
        return None
    return f"{quantities.pop()}_{sides.pop()}"


def _quantity(unit: str) -> str:
    return unit_of(unit, "").quantity if is_unit(unit) else ""


def _is_spelt(name: str, channel: str) -> bool:
    """Whether a name says quantity and gear in words, not by symbols, numbers or its unit."""
    words = _words(name.rpartition(".")[2].rpartition("/")[2])
    quantity, _, side = channel.rpartition("_")
    sides = {word for word in words if _SIDES.get(word) == side and not word.isdecimal() and len(word) > 2}
    # Angles may come from speeds, displacements from accelerations.
    meant = {quantity, {"angle": "speed", "y": "acceleration"}.get(quantity, quantity)}
    spelt = {word for word in words if _QUANTITIES.get(word) in meant and len(word) > 2}
    return bool(sides and spelt)


def _is_channel(name: str) -> bool:
    try:
        unit_of_channel(name)
    except RecordError:
        return False
    return name in NAMED_UNITS or any(name in (f"{p}driver", f"{p}driven") for p in PREFIX_UNITS)


def _words(name: str) -> set[str]:
    """Lower-case words and numbers of a name, divided at signs, digits and capitals."""
    divided = re.sub(r"([a-z\u00e4\u00f6\u00fc\u00df])([A-Z])", r"\1 \2", name)
    divided = re.sub(r"([A-Za-z])(\d)", r"\1 \2", divided)
    return {word for word in re.split(r"[^a-z0-9\u00e4\u00f6\u00fc\u00df]+", divided.lower()) if word}


def _shown(name: str, channels: Mapping[str, ChannelSpec], attributes: Mapping[str, float | str]) -> str:
    used = [channel for channel, spec in channels.items() if name in spec.column]
    return ", ".join([*used, *(key for key, value in attributes.items() if value == name)])


def _size(column: Column) -> str:
    return f"{column.samples}" if column.runs == 1 else f"{column.runs} x {column.samples}"
