"""Files that appear under their name only when they are complete."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from gearbench.geometry.error import GeometryError


def written_whole(path: str | Path, write: Callable[[Path], None]) -> Path:
    """Let `write` fill a temporary file of the same suffix beside `path`, then give it that name.

    Raises GeometryError for a missing folder.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise GeometryError(f"out = {target} cannot be written: the folder {target.parent} must exist")
    handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
    os.close(handle)
    try:
        write(Path(name))
        os.chmod(name, 0o666 & ~_umask())
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise
    return target


def _umask() -> int:
    """The process's file mode mask; mkstemp ignores it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
