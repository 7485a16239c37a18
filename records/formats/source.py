"""What a measured file holds: named columns with what the file knows of them, before anything is interpreted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.records.errors import RecordError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Column:
    """One signal (runs, samples) as the file has it, in `unit` (None: the file does not say).

    Its clock: `rate` [Hz], good to a relative `rate_tolerance` (formats print it with few digits), and `start` [s] of
    the first sample; or `time` (samples,) [s]; neither: the file does not say.
    """

    name: str
    values: Array
    unit: str | None = None
    rate: float | None = None
    rate_tolerance: float = 1e-12
    start: float = 0.0
    time: Array | None = None

    @property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.values.shape[0])

    @property
    def samples(self) -> int:
        """Samples of a run."""
        return int(self.values.shape[1])


@dataclass(frozen=True, eq=False)
class Source:
    """The columns of a file in its order; `facts`: its single numbers and texts; `skipped`: what it holds beside
    signals, with the reason why that is no column."""

    path: Path
    format: str
    columns: tuple[Column, ...]
    facts: Mapping[str, float | str] = field(default_factory=dict)
    skipped: Mapping[str, str] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(one.name for one in self.columns)


def make_column(name: str, values: NDArray, **known: object) -> Column:
    """A column of an array of one dimension (one run) or two: the longer one is time, the other counts the runs.

    Raises RecordError for other shapes, other types, and for a square, where nobody can tell.
    """
    data = np.asarray(values)
    if data.dtype.kind not in "fiub":
        raise RecordError(f"{name} holds {data.dtype} values, not real numbers")
    data = np.squeeze(data) if data.ndim > 2 else data
    if data.ndim == 1:
        data = data[np.newaxis, :]
    if data.ndim != 2:
        raise RecordError(f"{name} has {data.ndim} dimensions, not one (samples) or two (samples and runs)")
    rows, columns = data.shape
    if rows == columns and rows > 1:
        raise RecordError(f"{name} has {rows} x {rows} values: which dimension is time cannot be told")
    if rows > columns:
        data = data.T
    return Column(name, np.ascontiguousarray(data, dtype=np.float64), **known)  # type: ignore[arg-type]


def first_line(reason: Exception) -> str:
    """The first line of a reader's complaint, or its kind."""
    lines = str(reason).splitlines()
    return lines[0][:200] if lines else type(reason).__name__


def stacked(columns: Iterable[Column]) -> tuple[Column, ...]:
    """Columns of one name become the runs of one column, in their order. Raises RecordError where they differ."""
    groups: dict[str, list[Column]] = {}
    for column in columns:
        groups.setdefault(column.name, []).append(column)
    return tuple(_joined(group) for group in groups.values())


def _joined(group: list[Column]) -> Column:
    first = group[0]
    if len(group) == 1:
        return first
    for number, other in enumerate(group[1:], start=2):
        for what in ("samples", "unit", "rate"):
            if getattr(other, what) != getattr(first, what):
                raise RecordError(
                    f"column {first.name} is there {len(group)} times, but the {number}. has {what}"
                    f" {getattr(other, what)} and the first {getattr(first, what)}: runs must be equal"
                )
        if (first.time is None) != (other.time is None) or (
            first.time is not None and other.time is not None and not np.array_equal(first.time, other.time)
        ):
            raise RecordError(f"column {first.name}: run {number} has other times than the first; runs must be equal")
    return replace(first, values=np.concatenate([one.values for one in group]))
