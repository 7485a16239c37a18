"""The record: one labelled dataset, the only thing that identification and diagnosis read.

A record is an `xarray.Dataset` with dimensions `realisation` and `time`, coordinate `time` [s], and float64
channels `(realisation, time)` in SI units. Attributes describe sampling and rig.

Periods: a record holds `periods` excitation periods of `samples_per_period` samples each. A simulation in
steady state repeats itself, so it may store the mean over several periods instead: then
`periods_averaged` tells how many blocks of `periods` periods the mean was taken over, and each channel's
attribute `period_scatter` is the rms of the departure of single blocks from that mean, in the channel's
unit.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.records.attributes import SAMPLING_ATTRIBUTES, check_attributes, numeric_attribute
from gearbench.records.channels import REDUCED_CHANNELS, RIG_CHANNELS, unit_of_channel
from gearbench.records.errors import RecordError

SCHEMA = "gearbench-record/1"

# Without these the DTE and the generalised force cannot be computed from angles and torques
# (docs/physics.md, "Axes, signs, zeros").
RIG_ATTRIBUTES = ("base_radius_driver", "base_radius_driven", "driven_boundary")
INERTIA_ATTRIBUTES = ("inertia_driver", "inertia_driven")
# Largest departure of the time coordinate from a uniform grid, in samples.
TIME_TOLERANCE = 1e-3


def make_record(
    channels: Mapping[str, NDArray[np.float64]],
    attributes: Mapping[str, Any],
    *,
    channel_attributes: Mapping[str, Mapping[str, Any]] | None = None,
    start: float = 0.0,
) -> xr.Dataset:
    """A validated record of `channels`, each (realisations, samples) in SI units.

    `attributes` needs at least `sampling_rate` [Hz], `samples_per_period` and `periods`; entries that are
    None are dropped. `channel_attributes` adds attributes to single channels, `start` [s] is the time of
    the first sample. Raises RecordError for an unknown channel, a wrong shape, or anything that
    `validate_record` refuses.

    >>> import gearbench as gb
    >>> import numpy as np
    >>> signals = {"force": np.ones((1, 8)), "dte": np.zeros((1, 8))}
    >>> record = gb.make_record(signals, {"sampling_rate": 1000.0, "samples_per_period": 4, "periods": 2})
    >>> dict(record.sizes), record["dte"].attrs["units"]
    ({'realisation': 1, 'time': 8}, 'm')
    """
    if not channels:
        raise RecordError("a record needs at least one channel")
    attrs = {"schema": SCHEMA, **{k: v for k, v in attributes.items() if v is not None}}
    check_sampling(attrs)
    variables = {}
    samples = np.shape(next(iter(channels.values())))[-1:]
    for name, values in channels.items():
        data = np.asarray(values, dtype=np.float64)
        if data.ndim != 2 or data.shape[1:] != samples:
            raise RecordError(
                f"channel {name} has shape {data.shape}; every channel must be (realisations, samples) with"
                f" {samples[0] if samples else 0} samples like the first one"
            )
        extra = dict((channel_attributes or {}).get(name, {}))
        variables[name] = (("realisation", "time"), data, {"units": unit_of_channel(name), **extra})
    realisations = {name: data.shape[0] for name, (_, data, _) in variables.items()}
    if len(set(realisations.values())) > 1:
        raise RecordError(f"channels differ in their number of realisations: {realisations}")
    time = start + np.arange(samples[0]) / float(attrs["sampling_rate"])
    coords = {"time": ("time", time, {"units": "s"})}
    record = xr.Dataset(variables, coords=coords, attrs=attrs)
    validate_record(record)
    return record


def validate_record(record: xr.Dataset) -> None:
    """Raise RecordError, in one sentence, if the dataset is not a usable record.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"]))
    >>> gb.validate_record(record)
    >>> gb.validate_record(record.drop_vars("time"))
    Traceback (most recent call last):
    gearbench.records.errors.RecordError: a record needs the coordinate time [s]
    """
    check_description(record.attrs, [str(name) for name in record.data_vars])
    phases = np.size(record.attrs.get("mesh_phase", 0.0))
    if phases not in (1, record.sizes.get("realisation", 1)):
        raise RecordError(
            f"attribute mesh_phase has {phases} values, must be one, or one for each of"
            f" {record.sizes.get('realisation', 1)} realisations"
        )
    if "time" not in record.coords:
        raise RecordError("a record needs the coordinate time [s]")
    for name in record.data_vars:
        _check_channel(record, str(name))
    _check_time(record)


def check_description(attrs: Mapping[str, Any], names: Collection[str]) -> None:
    """Raise RecordError, in one sentence, unless these attributes and channels make a record."""
    schema = attrs.get("schema")
    if not isinstance(schema, str) or schema != SCHEMA:
        raise RecordError(f"schema is {schema!r}, but a record has schema {SCHEMA!r}")
    check_sampling(attrs)
    _check_channel_sets(attrs, set(names))


def check_sampling(attrs: Mapping[str, Any]) -> None:
    """Raise RecordError where attributes are not of their kind, or too few to cut the record into periods."""
    for name in SAMPLING_ATTRIBUTES:
        if name not in attrs:
            raise RecordError(f"attribute {name} is missing; a record needs {', '.join(SAMPLING_ATTRIBUTES)}")
    check_attributes(attrs)


def _check_channel_sets(attrs: Mapping[str, Any], names: set[str]) -> None:
    if names >= REDUCED_CHANNELS:
        return
    missing = sorted(RIG_CHANNELS - names)
    if missing:
        raise RecordError(
            f"channel {', '.join(missing)} is missing; a record needs {', '.join(sorted(RIG_CHANNELS))},"
            f" or else {' and '.join(sorted(REDUCED_CHANNELS))}"
        )
    both_free = attrs.get("driven_boundary") not in (None, "speed")
    for name in RIG_ATTRIBUTES + (INERTIA_ATTRIBUTES if both_free else ()):
        if name not in attrs:
            raise RecordError(f"attribute {name} is missing; without it dte and force cannot be computed")
    if both_free and "torque_driven" not in names:
        raise RecordError(
            f"channel torque_driven is missing, which driven_boundary = {attrs['driven_boundary']!r} needs"
        )


def _check_channel(record: xr.Dataset, name: str) -> None:
    channel = record[name]
    if channel.dims != ("realisation", "time"):
        raise RecordError(f"channel {name} has dimensions {channel.dims}, not ('realisation', 'time')")
    if channel.dtype != np.float64:
        raise RecordError(f"channel {name} is {channel.dtype}, not float64")
    numeric_attribute(channel.attrs, "period_scatter")
    unit = unit_of_channel(name)
    if channel.attrs.get("units") != unit:
        raise RecordError(f"channel {name} has units {channel.attrs.get('units')!r}, not {unit!r}")
    require_finite(channel)


def require_finite(channel: xr.DataArray) -> None:
    """Raise RecordError if a channel (realisation, time) holds values that are not finite."""
    for row, values in enumerate(channel.values):
        check_finite(str(channel.name), row, values)


def check_finite(name: str, realisation: int, values: NDArray[np.float64], at: int = 0) -> None:
    """Raise RecordError if a stretch (n,) of a channel, from sample `at` on, holds values that are not finite."""
    if not np.isfinite(values).all():
        bad = np.flatnonzero(~np.isfinite(values))
        raise RecordError(
            f"channel {name} holds {bad.size} value(s) that are not finite, first at realisation {realisation},"
            f" sample {at + bad[0]}"
        )


def _check_time(record: xr.Dataset) -> None:
    time = np.asarray(record["time"].values, dtype=float)
    rate = float(record.attrs["sampling_rate"])
    wanted = int(record.attrs["samples_per_period"]) * int(record.attrs["periods"])
    if time.size != wanted:
        raise RecordError(
            f"the record has {time.size} samples, but samples_per_period x periods is {wanted}"
            f" ({record.attrs['samples_per_period']} x {record.attrs['periods']})"
        )
    error = np.abs((time - time[0]) * rate - np.arange(time.size)).max()
    # Times since an epoch have no more digits than this.
    if not error <= TIME_TOLERANCE + rate * float(np.spacing(np.abs(time).max())):
        raise RecordError(
            f"time is not uniform at sampling_rate = {rate:g} Hz: it departs by {error:.3g} samples"
            f" (limit {TIME_TOLERANCE:g})"
        )
