"""A record that is written piece by piece, so that it need not fit into memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import h5netcdf
import numpy as np
from numpy.typing import NDArray

from gearbench.files import DeferredFile, write_whole
from gearbench.records.channels import unit_of_channel
from gearbench.records.errors import RecordError
from gearbench.records.record import SCHEMA, check_description, check_finite, check_sampling

Array = NDArray[np.float64]

_TIMES = 2**18  # samples of the time coordinate that are made at once


class Piece(NamedTuple):
    """Channels (n,) in SI units of one realisation from sample `at` on."""

    realisation: int
    at: int
    channels: Mapping[str, Array]


@dataclass(frozen=True)
class Head:
    """What a record is beside its samples: number of realisations and samples, attributes (None: left out), those of
    channels that it may have, beside their units, and the time [s] of its first sample; as for `make_record`."""

    realisations: int
    samples: int
    attributes: Mapping[str, Any]
    channel_attributes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    start: float = 0.0


def write_pieces(path: str | Path, head: Head, pieces: Iterable[Piece]) -> None:
    """The record whose samples `pieces` bring, in any order, each once, all with the same channels; it reads as one
    that `write_record` has written, to the last bit, and appears when it is whole.

    Raises RecordError for what is no record, also where pieces are missing, and FileError.
    """
    attrs = {"schema": SCHEMA, **{key: value for key, value in head.attributes.items() if value is not None}}
    check_sampling(attrs)
    wanted = int(attrs["samples_per_period"]) * int(attrs["periods"])
    if head.samples != wanted:
        raise RecordError(f"the record has {head.samples} samples, but samples_per_period x periods is {wanted}")

    def write(temporary: Path) -> None:
        with DeferredFile(temporary) as file:
            try:
                with h5netcdf.File(file, "w") as out:
                    _fill(out, head, attrs, pieces, file)
            except Exception:
                file.check()
                raise
        file.check()

    write_whole(path, write)


def _fill(out: Any, head: Head, attrs: Mapping[str, Any], pieces: Iterable[Piece], file: DeferredFile) -> None:
    for key, value in attrs.items():
        out.attrs[key] = value
    out.dimensions = {"realisation": head.realisations, "time": head.samples}
    channels: dict[str, Any] = {}
    missing = head.realisations * head.samples
    for piece in pieces:
        if not channels:
            check_description(attrs, piece.channels)
            channels = {name: _channel(out, name, head) for name in piece.channels}
            _write_time(out, head, float(attrs["sampling_rate"]))
        for name, values in piece.channels.items():
            check_finite(name, piece.realisation, values, piece.at)
            channels[name][piece.realisation, piece.at : piece.at + len(values)] = values
        missing -= len(values)
        file.check()
        del piece, values  # before the next one is made
    if missing:
        raise RecordError(f"{missing} samples of the record are missing, or were written twice")


def _channel(out: Any, name: str, head: Head) -> Any:
    channel = out.create_variable(name, ("realisation", "time"), np.float64)
    for key, value in {"units": unit_of_channel(name), **head.channel_attributes.get(name, {})}.items():
        channel.attrs[key] = value
    return channel


def _write_time(out: Any, head: Head, rate: float) -> None:
    clock = out.create_variable("time", ("time",), np.float64)
    clock.attrs["units"] = "s"
    for at in range(0, head.samples, _TIMES):
        clock[at : at + _TIMES] = head.start + np.arange(at, min(at + _TIMES, head.samples)) / rate
