"""TDMS (LabVIEW): one column a channel; groups with channels of the same names are runs."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from logging import CRITICAL
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Column, Source, first_line, make_column, stacked

# Parts of a second in which TDMS keeps times.
_FRACTIONS = 2**64
# Times are often written from double precision, which holds those of today to half a microsecond [s].
_SAME_START = 1e-6


def read_tdms(path: Path) -> Source:
    """Channels of a TDMS file with `unit_string`, `wf_increment`, and the start of each within its run by
    `wf_start_time` and `wf_start_offset`. Raises RecordError."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    # What the reader logs of damaged files is said here in one sentence.
    log_manager.set_level(CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)  # of a file that ends early
            file = TdmsFile.read(path, raw_timestamps=True)  # whose clocks are finer than 1 us
    except Exception as reason:  # the reader has no error of its own
        raise RecordError(f"{path} is truncated or no TDMS file ({first_line(reason)})") from reason
    if file.file_status.incomplete_final_segment:
        raise RecordError(f"{path} is truncated: its last segment is incomplete")
    groups = file.groups()
    names = [{channel.name for channel in group.channels()} for group in groups if group.channels()]
    # Groups that share no name are one run, those that share all are runs; in between names say their group.
    runs = all(other == names[0] for other in names)
    apart = sum(map(len, names)) == len(set().union(*names)) if names else True
    columns, skipped = [], {}
    # Runs are measured one after another: each has a beginning of its own.
    beginnings = [_beginning([group] if runs else groups) for group in groups]
    for group, beginning in zip(groups, beginnings, strict=True):
        for channel in group.channels():
            name = channel.name if runs or apart else f"{group.name}/{channel.name}"
            try:
                columns.append(_column(name, channel, beginning))
            except RecordError as reason:
                skipped[f"{group.name}/{channel.name}"] = str(reason)
    _check_starts(path, columns)
    return Source(path, "TDMS", stacked(columns), _facts(file.properties), skipped)


def _began(channel: Any) -> int | None:
    """When a channel began [2^-64 s since 1904]; None where it does not say: LabVIEW writes 0 for a time not set."""
    stamp = channel.properties.get("wf_start_time")
    if not hasattr(stamp, "second_fractions"):
        return None
    return (int(stamp.seconds) * _FRACTIONS + int(stamp.second_fractions)) or None


def _beginning(groups: Sequence[Any]) -> int | None:
    """When the earliest of their channels began [2^-64 s since 1904]; None if none of them says."""
    known = [_began(channel) for group in groups for channel in group.channels()]
    return min((one for one in known if one is not None), default=None)


def _check_starts(path: Path, columns: Sequence[Column]) -> None:
    """Runs share one clock: a channel must start in each as long after the earliest as in the first."""
    first: dict[str, Column] = {}
    for column in columns:
        start = first.setdefault(column.name, column).start
        if abs(column.start - start) > _SAME_START:
            raise RecordError(
                f"{path}: column {column.name} starts {column.start:.9g} s into one run and {start:.9g} s into another"
                f" (limit {_SAME_START:g} s between them): convert each run for itself"
            )


def _column(name: str, channel: Any, beginning: int | None) -> Column:
    properties = channel.properties
    unit = properties.get("unit_string") or properties.get("NI_UnitDescription") or properties.get("unit")
    step = float(properties.get("wf_increment", 0.0) or 0.0)
    values = channel[:]
    if len(values) == 0:
        raise RecordError(f"{name} holds no samples")
    if hasattr(values, "second_fractions"):
        whole, parts = values.seconds, values.second_fractions.astype(np.float64)
        values = (whole - whole[0]) + (parts - parts[0]) / _FRACTIONS
        unit = "s"
    began = _began(channel)
    late = (began - beginning) / _FRACTIONS if began is not None and beginning is not None else 0.0
    return make_column(
        name,
        values,
        unit=str(unit) if unit else None,
        rate=1.0 / step if step > 0 else None,
        start=late + float(properties.get("wf_start_offset", 0.0) or 0.0),
    )


def _facts(properties: Any) -> dict[str, float | str]:
    return {
        str(key): float(value) if isinstance(value, int | float) else value
        for key, value in properties.items()
        if isinstance(value, int | float | str)
    }
