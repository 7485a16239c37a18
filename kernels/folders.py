"""Where what takes long to make is kept on disk."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from pathlib import Path

from gearbench.kernels.trust import trusted

KEPT = 4  # states of a compiled function whose machine code stays on disk


def cache_folder() -> Path:
    """GEARBENCH_CACHE, or `gearbench` in the user's cache folder. Raises CacheError where others can write to it."""
    if own := os.environ.get("GEARBENCH_CACHE"):
        return trusted(Path(own))
    return trusted(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gearbench")


def code_folder(name: str, identity: str) -> Path:
    """The folder for the machine code of one state of a function, marked as used now; made where absent.

    A new state takes the place of the one that has not been used for longest, KEPT of each function remaining. A
    process that still uses that one has loaded its code, or compiles it again. Raises OSError where it cannot be made.
    """
    folder = cache_folder() / "compiled" / name / identity[:16]
    if folder.is_dir():
        with suppress(OSError):
            os.utime(folder)
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    with suppress(OSError):  # another process may be removing the same ones
        states = sorted(folder.parent.iterdir(), key=lambda state: state.stat().st_mtime, reverse=True)
        for old in states[KEPT:]:
            shutil.rmtree(old, ignore_errors=True)
    return folder
