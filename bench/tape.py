"""What a simulation has done so far, kept on disk, so that an interrupted one goes on where it was, bit for bit.

A simulation asks for outputs stretch by stretch, and everything that it decides follows from them. So it is enough to
keep the outputs and, now and then, the state: who plays the kept outputs back and goes on from the last state makes
the same decisions and ends with the same record.
"""

from __future__ import annotations

import json
import shutil
import threading
import time
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.settling import Steady
from gearbench.bench.plan.stored import Gather, Stored, in_file
from gearbench.files import FileError, write_text, write_whole

Array = NDArray[np.float64]
State = TypeVar("State")

# Seconds between two looks at the disk: what an interruption may cost; bytes that wait for the next one.
INTERVAL = 5.0
WAITING = 2**26
# Of the time since its begin that a tape may lose where states are larger than what lies between them (every unknown of
# finite elements): a look every few seconds would fill the disk in hours.
SHARE = 0.02

_ABOUT = "about.json"
_BROKEN = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError, SyntaxError)


class End(NamedTuple):
    """What a realisation ended with: its steady state, and one period of its torque (n,) [N m] as recorded."""

    steady: Steady
    torque: Array

    @property
    def size(self) -> int:
        """Bytes that it takes in memory."""
        outputs = self.steady.outputs
        return self.torque.nbytes + (outputs.nbytes if isinstance(outputs, np.ndarray) else 0)


class Shelf:
    """A folder of what one simulation has done; `identity` is all that decides its course.

    The folder appears with the first thing to keep, after `interval` seconds or when `waiting` bytes wait for the disk;
    that of another simulation is emptied, and files of another origin are refused with FileError. A disk that takes no
    more costs the checkpoints, not the simulation, unless the folder is `needed`: then it raises FileError. Mutable and
    shared by threads: it is a recorder.
    """

    def __init__(
        self, folder: Path, identity: str, interval: float = INTERVAL, waiting: int = WAITING, needed: bool = False
    ) -> None:
        self.folder, self.interval, self.waiting, self.needed = folder, interval, waiting, needed
        self._identity = identity
        self._lock = threading.Lock()
        self._ended: dict[int, End] = {}
        self._flushed = time.monotonic()
        self._full = False
        if folder.exists() and (owner := _owner(folder)) != identity:
            if owner is None and (not folder.is_dir() or any(folder.iterdir())):
                raise FileError(f"{folder} is of another origin: it must not exist, or hold what a simulation kept")
            self.clear()

    def clear(self) -> None:
        """Remove the folder: the simulation has ended and its record is safe."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def tape(self, name: str, start: Any) -> Tape:
        """The tape of that name; `start` is a state like those that it keeps."""
        return Tape(self, name, start)

    def gather(self, number: int) -> Gather:
        """Where the outputs of realisation `number` come together: in a file of the folder, where they are long."""

        def gathered(stretches: Iterable[Array], samples: int) -> Array | Stored:
            self._make()
            return in_file(self._outputs(number), stretches, samples)

        return gathered

    def ended(self, number: int) -> End | None:
        """What realisation `number` ended with, in this simulation or an earlier one."""
        with self._lock:
            if number in self._ended:
                return self._ended[number]
        with suppress(*_BROKEN), np.load(self._end(number), allow_pickle=False) as kept:
            scatter = kept["scatter"] if "scatter" in kept.files else None
            residual, periods, first = float(kept["residual"]), int(kept["settling_periods"]), int(kept["first"])
            outputs = self._stored(number, kept["shape"]) if "shape" in kept.files else kept["outputs"]
            return End(Steady(outputs, residual, periods, first, scatter), kept["torque"])
        return None

    def _stored(self, number: int, shape: NDArray[np.int64]) -> Stored:
        """Outputs in their own file. Raises ValueError where that is not whole."""
        path, samples, columns = self._outputs(number), int(shape[0]), int(shape[1])
        if path.stat().st_size != 8 * samples * columns:
            raise ValueError(f"{path} is damaged")
        return Stored(path, samples, columns)

    def end(self, number: int, end: End) -> None:
        """Keep what a realisation ended with, on disk before long; its tapes are needed no more."""
        with self._lock:
            self._ended[number] = end
            due = time.monotonic() - self._flushed >= self.interval
            due = due or sum(one.size for one in self._ended.values()) >= self.waiting
        if due:
            self.flush()

    def flush(self) -> None:
        """Write the ends that are not on disk yet."""
        with self._lock:
            ended = dict(self._ended)
            self._flushed = time.monotonic()
        for number, (steady, torque) in ended.items():
            arrays = {name: value for name, value in vars(steady).items() if value is not None}
            if isinstance(steady.outputs, Stored):
                del arrays["outputs"]
                arrays["shape"] = np.array([steady.outputs.samples, steady.outputs.columns])
            self.write(self._end(number).name, {**arrays, "torque": torque})
            for path in self.folder.glob(f"tape-{number}-*.npz"):
                path.unlink(missing_ok=True)
            with self._lock:
                self._ended.pop(number, None)

    def write(self, name: str, arrays: Mapping[str, Any]) -> None:
        """One file of arrays in the folder."""
        with self._lock:
            if self._full:
                return
            try:
                self._made()
                write_whole(self.folder / name, lambda path: np.savez(path, **arrays))
            except OSError:
                if self.needed:
                    raise
                self._full = True

    def _make(self) -> None:
        with self._lock:
            self._made()

    def _made(self) -> None:
        if not self.folder.exists():
            try:
                self.folder.mkdir()
            except OSError as error:
                raise FileError(f"{self.folder} cannot be made: {error.strerror or error}") from error
            write_text(self.folder / _ABOUT, json.dumps({"identity": self._identity}) + "\n")

    def _end(self, number: int) -> Path:
        return self.folder / f"end-{number}.npz"

    def _outputs(self, number: int) -> Path:
        return self.folder / f"outputs-{number}.bin"


def discard(folder: Path) -> None:
    """Remove the folder of a simulation that has ended; one that no simulation has made stays as it is."""
    if _owner(folder) is not None:
        shutil.rmtree(folder, ignore_errors=True)


def _owner(folder: Path) -> str | None:
    """The identity of the simulation that has made a folder."""
    with suppress(OSError, ValueError):
        about = json.loads((folder / _ABOUT).read_text(encoding="utf-8"))
        return str(about["identity"]) if isinstance(about, dict) and "identity" in about else None
    return None


class Tape:
    """One course of states and outputs: what was kept is played back by `take`, what follows is kept by `put`.

    Mutable: it is a recorder. One thread uses it. `state` is that at the end of what was taken or put.
    """

    def __init__(self, shelf: Shelf, name: str, start: Any) -> None:
        self.state = start
        self._shelf, self._name, self._start = shelf, name, start
        self._segments = 0
        self._played: Array | None = None
        self._pending: list[Array] = []
        self._size = 0
        self._begun = self._flushed = time.monotonic()

    def take(self, count: int) -> Array | None:
        """The next `count` samples (count, n) that were kept; None where there are no more."""
        if self._played is None or not len(self._played):
            self._played = self._load()
        if self._played is None:
            return None
        taken, self._played = self._played[:count], self._played[count:]
        return taken

    def put(self, state: Any, outputs: Array) -> None:
        """Keep outputs (samples, n) and the state at their end, on disk before long."""
        self._pending.append(outputs)
        self._size += outputs.nbytes
        self.state = state
        if self._due(time.monotonic()) or self._size >= self._shelf.waiting:
            self.flush()

    def _due(self, now: float) -> bool:
        waited = now - self._flushed
        if waited < self._shelf.interval:
            return False
        heavy = sum(leaf.nbytes for leaf in leaves(self.state)) > self._size
        return not heavy or waited >= SHARE * (now - self._begun)

    def flush(self) -> None:
        """Write what is not on disk yet."""
        if not self._pending:
            return
        arrays = {f"state{i}": leaf for i, leaf in enumerate(leaves(self.state))}
        self._shelf.write(self._file(self._segments), {"outputs": np.concatenate(self._pending), **arrays})
        self._segments += 1
        self._pending, self._size = [], 0
        self._flushed = time.monotonic()

    def _load(self) -> Array | None:
        """Outputs of the next segment. A damaged one ends the tape: it and all that follow are removed."""
        path = self._shelf.folder / self._file(self._segments)
        with suppress(*_BROKEN), np.load(path, allow_pickle=False) as kept:
            outputs = kept["outputs"]
            state = restored(self._start, iter([kept[f"state{i}"] for i in range(len(kept.files) - 1)]))
            if len(outputs):
                self._segments += 1
                self.state = state
                return outputs
        number = self._segments
        while (path := self._shelf.folder / self._file(number)).exists():
            path.unlink()
            number += 1
        return None

    def _file(self, segment: int) -> str:
        return f"tape-{self._name}-{segment}.npz"


def leaves(state: Any) -> list[NDArray[Any]]:
    """The arrays and numbers of a state: an array, a number, or a NamedTuple of such."""
    if isinstance(state, tuple):
        return [leaf for part in state for leaf in leaves(part)]
    return [np.asarray(state)]


def restored(like: State, values: Iterator[NDArray[Any]]) -> State:
    """A state of the same kind as `like`, from what `leaves` gave. Raises ValueError if it does not fit."""
    if isinstance(like, tuple):
        parts = [restored(part, values) for part in like]
        make: Any = getattr(type(like), "_make", type(like))
        return make(parts)
    leaf = next(values, None)
    if leaf is None:
        raise ValueError("too few values for the state")
    if isinstance(like, np.ndarray):
        return leaf.view(like.dtype)  # type: ignore[return-value]
    return type(like)(leaf.item())  # type: ignore[call-arg]
