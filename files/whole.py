"""A file is filled under a temporary name and then renamed: readers see the old one or the new one, never a half."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from pathlib import Path


class FileError(OSError):
    """A file that cannot be written; the sentence names it and what stands in the way."""


def write_whole(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file of the same suffix beside `path`, then give it that name; the path.

    What fails or is interrupted leaves neither the temporary file behind nor the old one changed. The file has the
    permissions of any new file of this process (its umask). Raises FileError for a missing folder and for whatever the
    system refuses; errors of `write` that are none of the system's pass.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileError(f"{target} cannot be written: the folder {target.parent} must exist")
    temporary = target.with_name(f".{secrets.token_hex(8)}{target.suffix}")
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        write(temporary)
        os.replace(temporary, target)
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"{target} cannot be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return target


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file (UTF-8) in one step. Raises FileError."""
    return write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
