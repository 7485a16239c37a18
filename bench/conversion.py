"""Measured files to a record, with what a case tells of the rig."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import xarray as xr

from gearbench.bench.errors import BenchError
from gearbench.bench.record.attributes import rig_attributes
from gearbench.geometry import pair
from gearbench.records.conversion.channel_map import ChannelMap, read_map
from gearbench.records.conversion.convert import convert_sources, read_sources
from gearbench.records.conversion.guess import guess_map
from gearbench.records.errors import RecordError
from gearbench.rig import Case

Attributes = dict[str, float | str]


def convert(
    files: str | Path | Sequence[str | Path],
    channel_map: ChannelMap | str | Path | None = None,
    *,
    case: Case | None = None,
    condition: str | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> xr.Dataset:
    """The record in measured files (MAT, UFF58, CSV, TDMS, HDF5, NetCDF, WAV).

    `channel_map`: which column is which channel, or the TOML file that says so; without it names and units of the file
    must leave no doubt. `case` tells what the map does not say of the rig, its `condition` of speed and sampling.
    Several files with the same columns are realisations, with different ones parts of one measurement. Attribute
    `warnings` says what was done and what is lost. Raises RecordError (one sentence) for what cannot be converted.

    >>> import gearbench as gb
    >>> import numpy as np
    >>> t = np.arange(64) / 1000.0
    >>> table = np.column_stack([t, np.sin(2 * np.pi * 125.0 * t), 0 * t])
    >>> np.savetxt("run.csv", table, delimiter=",", header="time [s],force [kN],dte [um]", comments="")
    >>> spoken = {"force": gb.records.ChannelSpec(("force",)), "dte": gb.records.ChannelSpec(("dte",))}
    >>> about = {"time": "time", "samples_per_period": 32, "mesh_frequency": 31.25}
    >>> record = gb.convert("run.csv", gb.records.ChannelMap(spoken, about))
    >>> record.attrs["sampling_rate"], record.attrs["periods"], f"{float(record['force'].max()):.0f} N"
    (1000.0, 2, '1000 N')
    """
    paths = [files] if isinstance(files, str | Path) else list(files)
    known = case_attributes(case, condition) if case is not None else {}
    source = read_sources(paths)
    if channel_map is None:
        guess = guess_map(source, known)
        if not guess.certain:
            reasons = [*guess.doubts, *(f"{name} is missing" for name in guess.missing)]
            raise RecordError(f"{paths[0]} does not say which column is which channel: {'; '.join(reasons[:4])}")
        channel_map = guess.channel_map
    elif not isinstance(channel_map, ChannelMap):
        channel_map = read_map(channel_map)
    return convert_sources(paths, channel_map, known, source=source, progress=progress)


def case_attributes(case: Case, condition: str | None = None) -> Attributes:
    """What a case tells of a record of its rig: teeth, radii, inertias, sampling, period and mesh period (SI).

    The mean torque is the record's own. Raises BenchError for a condition that the case has not, GeometryError for
    gears that do not mesh.
    """
    rig, experiment = case.rig, case.experiment
    if condition is not None:
        named = {one.name: one.experiment for one in case.conditions}
        if condition not in named:
            raise BenchError(
                f"condition {condition!r} is none of the case's; it has {', '.join(named) or 'no conditions'}"
            )
        experiment = named[condition]
    about: Attributes = rig_attributes(rig, pair(rig))
    if condition is not None:
        about["condition"] = condition
    return about | {
        "sampling_rate": experiment.sampling_rate,
        "samples_per_period": experiment.samples_per_period,
        "mesh_period": 1.0 / experiment.mesh_frequency_for(rig.driver.teeth),
    }
