"""Outputs of one realisation, stretch by stretch into one array, or, where they are long, into a file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearbench.files import FileError

Array = NDArray[np.float64]

LONG = 2**26  # bytes of outputs from which they go into a file, where there is one
PIECE = 2**18  # samples that are handled at a time


@dataclass(frozen=True)
class Stored:
    """Outputs (samples, columns) in a file of float64 numbers, read by slices of samples."""

    path: Path
    samples: int
    columns: int

    def __len__(self) -> int:
        return self.samples

    def __getitem__(self, part: slice) -> Array:
        start, stop, step = part.indices(self.samples)
        if step != 1:
            raise ValueError(f"stored outputs are read sample by sample, not with step {step}")
        count = max(stop - start, 0) * self.columns
        try:
            found = np.fromfile(self.path, np.float64, count, offset=8 * start * self.columns)
        except OSError as error:
            raise FileError(f"{self.path} cannot be read: {error.strerror or error}") from error
        if found.size != count:
            raise FileError(f"{self.path} ends early: it has been changed since it was written")
        return found.reshape(-1, self.columns)


class Gather(Protocol):
    """Makes one of stretches (n, columns) that follow one another, cut off after `samples`."""

    def __call__(self, stretches: Iterable[Array], samples: int) -> Array | Stored: ...


def in_memory(stretches: Iterable[Array], samples: int) -> Array:
    """The stretches (n, columns) as one array (samples, columns); the same one where there is but one."""
    out, done = np.empty((0, 0)), 0
    for part in stretches:
        if not done and len(part) >= samples:
            return part[:samples]
        out = out if done else np.empty((samples, part.shape[1]))
        count = min(len(part), samples - done)
        out[done : done + count] = part[:count]
        done += count
    return out


def in_file(path: Path, stretches: Iterable[Array], samples: int) -> Array | Stored:
    """The stretches as one, in a new file `path` where they take more than LONG. Raises FileError."""
    source: Iterator[Array] = iter(stretches)
    first = next(source)
    columns = first.shape[1]
    if 8 * samples * columns <= LONG:
        return in_memory(_after(first, source), samples)
    done, part = 0, first
    try:
        with open(path, "wb") as file:
            while True:
                count = min(len(part), samples - done)
                np.ascontiguousarray(part[:count]).tofile(file)
                done += count
                if done == samples:
                    break
                part = next(source)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {error.strerror or error}") from error
    return Stored(path, samples, columns)


def _after(first: Array, rest: Iterator[Array]) -> Iterator[Array]:
    yield first
    yield from rest


def lengths_of(samples: int, piece: int = 0) -> Iterator[int]:
    """Lengths of the stretches that so many samples are run in, whole pieces of a model that runs `piece` at a time."""
    most = max(PIECE // piece, 1) * piece if piece else PIECE
    for at in range(0, samples, most):
        yield min(most, samples - at)
