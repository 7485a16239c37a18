"""Where a command keeps what a simulation has done so far: a folder beside the record that it will write."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gearbench.shell.failure import say


@contextmanager
def checkpoints_of(record: Path, within: bool = False) -> Iterator[Path]:
    """The folder RECORD.part; it is removed when the record is written, and an interruption says that it is there,
    unless it is `within` a folder of which that is said anyway."""
    folder = record.with_name(f"{record.name}.part")
    try:
        yield folder
    except KeyboardInterrupt:
        if folder.exists() and not within:
            say(f"what is done is kept in {folder}: the same command goes on from there")
        raise
    from gearbench.bench.tape import discard  # numpy, which a command that only refuses need not load

    discard(folder)
