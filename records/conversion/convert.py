"""A measured file becomes a record: channels onto one clock, whole excitation periods, angles and displacements."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from gearbench.files import digest_of
from gearbench.records.conversion.attributes import (
    Attributes,
    declared_mesh_period,
    facts_of,
    merged,
    missing_attributes,
    record_attributes,
)
from gearbench.records.conversion.channel_map import ChannelMap, map_text
from gearbench.records.conversion.common import common_clock, from_a_near_origin
from gearbench.records.conversion.derive import (
    Assembly,
    add_mesh_phase,
    integrate_all,
    mesh_period_of,
    put_on_clock,
    say_locations,
)
from gearbench.records.conversion.devices import clocks_by_teeth, reference_rate
from gearbench.records.conversion.runout import taken_off
from gearbench.records.conversion.signals import find_column, shortened, signal_of
from gearbench.records.errors import RecordError
from gearbench.records.formats.importers import read_source
from gearbench.records.formats.source import Column, Source, stacked
from gearbench.records.provenance import provenance
from gearbench.records.record import make_record

Progress = Callable[[float, str], None]


def read_sources(paths: Sequence[str | Path]) -> Source:
    """Several files as one: with the same columns they are runs, with different ones parts of one measurement.

    Raises RecordError.
    """
    if not paths:
        raise RecordError("no file to convert")
    sources = [read_source(path) for path in paths]
    first = sources[0]
    if len(sources) == 1:
        return first
    facts = {key: value for source in reversed(sources) for key, value in source.facts.items()}
    skipped = {key: value for source in sources for key, value in source.skipped.items()}
    names = [set(source.names) for source in sources]
    if all(one == names[0] for one in names):
        columns = stacked(column for source in sources for column in source.columns)
        return replace(first, columns=columns, facts=facts, skipped=skipped)
    twice = sorted({name for name in set().union(*names) if sum(name in one for one in names) > 1})
    if twice:
        raise RecordError(
            f"{', '.join(str(source.path) for source in sources)} have columns {shortened(twice)} in common, but not"
            " all: files of one measurement have all columns in common (runs) or none"
        )
    return replace(first, columns=tuple(c for source in sources for c in source.columns), facts=facts, skipped=skipped)


def convert_sources(
    paths: Sequence[str | Path],
    channel_map: ChannelMap,
    known: Mapping[str, float | str] | None = None,
    *,
    source: Source | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The record in measured files after a channel map; `known`: attributes (SI) that a case tells.

    What the map says goes before the case, the case before the file. `source`: the files, if already read. The
    record's attribute `warnings` says what was done and what is lost. Raises RecordError naming channel, index and
    limit for what is missing, not finite, unequal, clipped or wrongly sampled.
    """
    report = progress or (lambda part, note: None)
    source = by_runs(source or read_sources(paths), channel_map)
    attributes = merged(channel_map.attributes, known or {}, facts_of(source))
    missing = missing_attributes(attributes, channel_map.channels)
    if missing:
        raise RecordError(f"the record needs {', '.join(missing)}: give them in [record] of the channel map, or a case")
    notes: list[str] = []
    signals = [signal_of(name, spec, source, attributes, notes) for name, spec in channel_map.channels.items()]
    runs = {signal.name: signal.values.shape[0] for signal in signals}
    if len(set(runs.values())) > 1:
        raise RecordError(f"channels differ in their number of runs: {runs}")
    signals = from_a_near_origin(signals, notes)
    signals, details = taken_off(signals, channel_map.channels, notes, attributes)
    signals = clocks_by_teeth(signals, channel_map.channels, attributes, notes)
    common = common_clock(signals, reference_rate(signals, channel_map.channels) | attributes, notes)
    work = Assembly(tuple(signals), common, channel_map, attributes, notes, details=details)
    period = declared_mesh_period(attributes)
    for number, signal in enumerate(signals):
        report(number / len(signals), signal.name)
        put_on_clock(work, signal, period, partial(_report_part, report, number, len(signals), signal.name))
    period = mesh_period_of(work, period)
    integrate_all(work, period)
    period = add_mesh_phase(work, period)
    say_locations(work)
    about = record_attributes(attributes) | {
        "sampling_rate": common.rate,
        "samples_per_period": common.samples,
        "periods": common.periods,
        "mesh_period": period,
        "mesh_phase_origin": attributes.get("mesh_phase_origin", "arbitrary"),
        "warnings": "\n".join(dict.fromkeys(notes)) or None,
        "provenance": _origin(paths, source, channel_map, attributes),
    }
    return make_record(work.channels, about, channel_attributes=work.details, start=common.start)


def _report_part(report: Progress, done: int, total: int, name: str, part: float) -> None:
    report((done + part) / total, name)


def by_runs(source: Source, channel_map: ChannelMap) -> Source:
    """The source with its rows divided by a column that numbers the runs, if the map names one."""
    if "run" not in channel_map.attributes:
        return source
    marks = find_column(source, str(channel_map.attributes["run"]), "record.run")
    numbers = marks.values[0]
    starts = np.concatenate([[0], np.flatnonzero(np.diff(numbers)) + 1, [numbers.size]])
    lengths = np.diff(starts)
    if len(set(lengths)) > 1:
        odd = int(np.argmax(lengths != lengths[0]))
        raise RecordError(f"run {numbers[starts[odd]]:g} has {lengths[odd]} samples, the first run {lengths[0]}")
    if len(set(numbers[starts[:-1]])) < lengths.size:
        raise RecordError(f"column {marks.name} returns to an earlier run: each run must be in one piece")
    columns = [_divided(one, int(lengths[0]), numbers.size, channel_map) for one in source.columns if one is not marks]
    return replace(source, columns=tuple(columns))


def _divided(column: Column, length: int, total: int, channel_map: ChannelMap) -> Column:
    if column.samples != total or column.runs > 1:
        raise RecordError(f"column {column.name} has {column.samples} samples, the column of runs {total}")
    values = column.values.reshape(-1, length)
    if column.name == channel_map.attributes.get("time"):
        own = values - values[:, :1]
        if np.abs(own - own[0]).max() > 1e-3 * abs(own[0, -1]) / length:
            raise RecordError(f"column {column.name} has other times in other runs; they must be equal")
        values = values[:1]
    return replace(column, values=values)


def _origin(paths: Sequence[str | Path], source: Source, channel_map: ChannelMap, attributes: Attributes) -> str:
    files = [{"name": Path(path).name, "sha256": digest_of(Path(path))} for path in paths]
    settings = {
        "converted": files,
        "format": source.format,
        "channel_map": map_text(channel_map),
        "attributes": json.loads(json.dumps(attributes)),
    }
    return provenance("", None, settings)
