"""TDMS (LabVIEW): one column a channel; groups with channels of the same names are runs."""

from __future__ import annotations

import warnings
from logging import CRITICAL
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Column, Source, first_line, make_column, stacked


def read_tdms(path: Path) -> Source:
    """Channels of a TDMS file with `unit_string` and `wf_increment`. Raises RecordError."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    # What the reader logs of damaged files is said here in one sentence.
    log_manager.set_level(CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)  # of a file that ends early
            file = TdmsFile.read(path)
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
    for group in groups:
        for channel in group.channels():
            name = channel.name if runs or apart else f"{group.name}/{channel.name}"
            try:
                columns.append(_column(name, channel))
            except RecordError as reason:
                skipped[f"{group.name}/{channel.name}"] = str(reason)
    return Source(path, "TDMS", stacked(columns), _facts(file.properties), skipped)


def _column(name: str, channel: Any) -> Column:
    properties = channel.properties
    unit = properties.get("unit_string") or properties.get("NI_UnitDescription") or properties.get("unit")
    step = float(properties.get("wf_increment", 0.0) or 0.0)
    values = channel[:]
    if np.asarray(values).dtype.kind == "M":
        values = (values - values[0]) / np.timedelta64(1, "ns") * 1e-9
        unit = "s"
    if len(values) == 0:
        raise RecordError(f"{name} holds no samples")
    return make_column(
        name,
        values,
        unit=str(unit) if unit else None,
        rate=1.0 / step if step > 0 else None,
        start=float(properties.get("wf_start_offset", 0.0) or 0.0),
    )


def _facts(properties: Any) -> dict[str, float | str]:
    return {
        str(key): float(value) if isinstance(value, int | float) else value
        for key, value in properties.items()
        if isinstance(value, int | float | str)
    }
