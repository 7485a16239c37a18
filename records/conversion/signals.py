"""One channel: from its column, calibrated, in SI units, on the column's own clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from gearbench.records.channels import unit_of_channel
from gearbench.records.conversion.channel_map import ChannelSpec
from gearbench.records.conversion.clock import Clock, clock_of_times, roundest
from gearbench.records.conversion.counters import counted_on
from gearbench.records.conversion.rotation import pulse_angle, quadrature_counts, rising_edges, unwrapped
from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Array, Column, Source
from gearbench.records.formats.unit_words import Unit, si_word, unit_of

# What a channel measures, by its unit in a record.
QUANTITIES = {
    "rad": "angle",
    "rad/s": "angular speed",
    "m": "length",
    "m/s^2": "acceleration",
    "N": "force",
    "N m": "torque",
    "K": "temperature",
    "cycles": "mesh cycles",
}
# Quantity of a channel -> quantities that integrate to it, and how often.
INTEGRALS = {
    "angle": {"angular speed": 1, "angular acceleration": 2},
    "length": {"speed": 1, "acceleration": 2},
}
PULSES = ("count", "quadrature count", "pulse time", "level")
# Equal successive samples at the end of the range, and how many times more of them than beside it: clipped.
_RUN, _CROWD = 4, 3.0


@dataclass(frozen=True, eq=False)
class Signal:
    """A channel `values` (runs, n) in SI on its clock, to be integrated `integrals` times; `slope`: it is an angle that
    turns; `resolution`: of an encoder [rad]; `absolute`: an angle's zero is that of the sensor."""

    name: str
    values: Array
    clock: Clock
    integrals: int = 0
    turns: bool = False
    absolute: bool = True
    resolution: float | None = None


def signal_of(
    name: str, spec: ChannelSpec, source: Source, attributes: Mapping[str, float | str], notes: list[str]
) -> Signal:
    """The signal of a channel. Raises RecordError naming channel, index and limit."""
    columns = [find_column(source, column, f"channel.{name}.column") for column in spec.column]
    where = f"channel {name} (column {' and '.join(spec.column)})"
    unit = _unit(name, spec, columns[0], where)
    _check_scaling(spec, unit, where)
    if unit.quantity == "pulse time":
        return _pulses(name, spec, columns[0], unit, where, notes)
    for column in columns:
        _check_finite(column, where)
    clock = replace_start(_clock(columns[0], spec, source, attributes, notes), -spec.delay)
    if unit.quantity in PULSES:
        return _encoder(name, spec, columns, clock, unit, where, notes)
    _check_clipped(columns[0], where)
    wanted = QUANTITIES[unit_of_channel(name)]
    integrals = 0 if unit.quantity == wanted else INTEGRALS[wanted][unit.quantity]
    zero = unit.zero / unit.factor if unit.zero else 0.0
    values = spec.sign * spec.gain * (columns[0].values - spec.offset)
    values = (values + unit.zero) * unit.factor if zero else values * unit.factor
    if wanted == "angle" and not integrals:
        values = unwrapped(values, where, notes)
    return Signal(name, values, clock, integrals, wanted == "angle", not integrals)


def find_column(source: Source, name: str, where: str) -> Column:
    """A column by its name; `name[2]` is the second run (MATLAB's counting) of a column with several."""
    for column in source.columns:
        if column.name == name:
            return column
    if name in source.skipped:
        raise RecordError(f"{where} = {name!r} is no signal in {source.path}: it {source.skipped[name]}")
    base, bracket, number = name.rpartition("[")
    for column in source.columns:
        if bracket and column.name == base and number.rstrip("]").isdecimal():
            row = int(number.rstrip("]"))
            if not 1 <= row <= column.runs:
                raise RecordError(f"{where} = {name!r}: {base} has {column.runs} rows, counted from 1")
            return replace(column, name=name, values=column.values[row - 1 : row])
    raise RecordError(f"{where} = {name!r} is no column of {source.path}; there are {shortened(source.names)}")


def shortened(names: Sequence[str]) -> str:
    """Names in a row, the first twelve of them."""
    return ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def replace_start(clock: Clock, shift: float) -> Clock:
    """The clock moved by a time [s]."""
    if not shift:
        return clock
    return replace(clock, start=clock.start + shift, time=None if clock.time is None else clock.time + shift)


def _unit(name: str, spec: ChannelSpec, column: Column, where: str) -> Unit:
    word = spec.unit or column.unit
    if word is None:
        raise RecordError(f'{where} has no unit: give [channel.{name}] unit = "{unit_of_channel(name)}" or another one')
    wanted = QUANTITIES[unit_of_channel(name)]
    unit = unit_of(word, where, wanted)
    fits = {wanted, *INTEGRALS.get(wanted, {})} | (set(PULSES) if wanted == "angle" else set())
    if unit.quantity not in fits:
        raise RecordError(
            f"{where} has the unit {word!r} ({unit.quantity}), but the channel is a {wanted} in"
            f" {si_word(wanted)}" + (" (newton metres are written N m or Nm)" if word == "nm" else "")
        )
    return unit


def _clock(
    column: Column, spec: ChannelSpec, source: Source, attributes: Mapping[str, float | str], notes: list[str]
) -> Clock:
    """The clock of a column: its own, the map's, or the file's."""
    own = column.time is not None or column.rate or spec.sampling_rate
    chosen = spec.time or (None if own else attributes.get("time"))
    if chosen is not None:
        times = find_column(source, str(chosen), "time")
        unit = unit_of(times.unit or "s", f"column {times.name}", "time")
        if unit.quantity != "time":
            raise RecordError(f"column {times.name} has the unit {times.unit!r}, but times are given in s")
        if times.samples != column.samples:
            raise RecordError(
                f"column {column.name} has {column.samples} samples, but its times in {times.name} are {times.samples}:"
                " they must be equal"
            )
        return clock_of_times(times.values[0] * unit.factor, f"time column {times.name}", notes)
    if column.time is not None:
        return clock_of_times(column.time, f"the times of {column.name}", notes)
    rate, declared = column.rate, attributes.get("sampling_rate")
    if spec.sampling_rate is not None:
        return Clock(column.start, spec.sampling_rate, column.samples)
    if rate is None:
        if declared is None:
            raise RecordError(
                f"column {column.name} has neither times nor a sampling rate: give [record] time or sampling_rate_hz"
            )
        _check_equal(column, source)
        notes.append(f"the file has no clock: its samples are taken at {float(declared):.9g} Hz, as declared")
        return Clock(column.start, float(declared), column.samples)
    return Clock(column.start, _exact_rate(rate, column.rate_tolerance, declared, notes), column.samples)


def _exact_rate(rate: float, tolerance: float, declared: float | str | None, notes: list[str]) -> float:
    """A rate that a format prints with few digits: the declared one where it agrees, else the roundest."""
    if declared is not None and abs(float(declared) / rate - 1) <= 2 * tolerance:
        return float(declared)
    exact = roundest(rate, tolerance)
    if exact != rate and tolerance > 1e-9:
        notes.append(f"the file prints its sampling rate with few digits ({rate:.9g} Hz): taken as {exact:.9g} Hz")
    return exact


def _check_equal(column: Column, source: Source) -> None:
    """Without a clock of its own a column must be as long as the others."""
    longest = max(other.samples for other in source.columns if other.rate is None and other.time is None)
    if column.samples != longest and column.samples > 1:
        raise RecordError(
            f"column {column.name} has {column.samples} samples where others have {longest}, and no clock of its own:"
            " give [channel.NAME] sampling_rate_hz or time"
        )


def _pulses(name: str, spec: ChannelSpec, column: Column, unit: Unit, where: str, notes: list[str]) -> Signal:
    """Angle at the pulses of one track: its clock are the pulse times."""
    pulses = _per_turn(spec, where)
    if column.runs > 1:
        raise RecordError(f"{where} has {column.runs} runs of pulse times; convert them one by one")
    times, angle = pulse_angle(column.values[0] * unit.factor - spec.delay, pulses, where, notes)
    clock = Clock(float(times[0]), 1 / float(np.median(np.diff(times))), times.size, times)
    return Signal(name, spec.sign * angle[np.newaxis], clock, turns=True, absolute=False)


def _encoder(
    name: str, spec: ChannelSpec, columns: Sequence[Column], clock: Clock, unit: Unit, where: str, notes: list[str]
) -> Signal:
    """Angle from counts, or from one or two sampled tracks."""
    pulses = _per_turn(spec, where)
    values = columns[0].values
    if unit.quantity == "level" and len(columns) == 1:
        if columns[0].runs > 1:
            raise RecordError(f"{where} has {columns[0].runs} runs of an encoder track; convert them one by one")
        edges, angle = pulse_angle(rising_edges(values[0], clock.times, where), pulses, where, notes)
        track = Clock(float(edges[0]), 1 / float(np.median(np.diff(edges))), edges.size, edges)
        return Signal(name, spec.sign * angle[np.newaxis], track, turns=True, absolute=False)
    if len(columns) == 2:
        if columns[0].values.shape != columns[1].values.shape:
            raise RecordError(f"{where}: the two tracks have {columns[0].samples} and {columns[1].samples} samples")
        counts = np.array([quadrature_counts(a, b, where) for a, b in zip(values, columns[1].values, strict=True)])
    else:
        counts = counted_on(values - spec.offset, pulses, where, notes)
    size = 2 * pi / (pulses * (4 if len(columns) == 2 or unit.quantity == "quadrature count" else 1))
    return Signal(name, spec.sign * counts * size, clock, turns=True, absolute=len(columns) == 1, resolution=size)


def _check_scaling(spec: ChannelSpec, unit: Unit, where: str) -> None:
    """Refuse a gain of what is counted, and an offset of all but counts."""
    words = {"pulse time": "pulse times (delay_s takes off a lag)", "level": "an encoder track"}
    for key, given, neutral in (("gain", spec.gain, 1.0), ("offset", spec.offset, 0.0)):
        if unit.quantity in PULSES and given != neutral and (key == "gain" or unit.quantity in words):
            raise RecordError(
                f"{where}: {key} = {given:g} means nothing for {words.get(unit.quantity, 'counts')}, must be"
                f" {neutral:g} or left out"
            )


def _per_turn(spec: ChannelSpec, where: str) -> float:
    if spec.pulses_per_revolution is None:
        raise RecordError(f"{where} counts pulses: give pulses_per_revolution")
    return spec.pulses_per_revolution


def _check_finite(column: Column, where: str) -> None:
    if np.isfinite(column.values).all():
        return
    bad = np.argwhere(~np.isfinite(column.values))
    raise RecordError(
        f"{where} has {len(bad)} value(s) that are missing or not finite, first at sample {bad[0][1]} (run {bad[0][0]})"
    )


def _check_clipped(column: Column, where: str) -> None:
    """Refuse a signal whose range ends in runs of equal samples, unless its digits are so coarse that all do."""
    for run, values in enumerate(column.values):
        if np.ptp(values) == 0.0:
            continue
        for end in (values.max(), values.min()):
            at_end = np.concatenate([[False], values == end, [False]])
            edges = np.flatnonzero(np.diff(at_end.astype(np.int8)))
            lengths = edges[1::2] - edges[::2]
            if lengths.max() < _RUN:
                continue
            levels, counts = np.unique(values, return_counts=True)
            beside = counts[1:4] if end == levels[0] else counts[-4:-1]
            if int(lengths.sum()) < _CROWD * float(beside.mean()):
                continue
            first = int(edges[::2][lengths.argmax()])
            raise RecordError(
                f"{where} is clipped at {end:g}: {int(lengths.sum())} samples stand there, {lengths.max()} in a row"
                f" from sample {first} (run {run}; limit {_RUN - 1})"
            )
