"""A file is filled under a temporary name and then renamed: readers see the old one or the new one, never a half."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path

# Host, process, number: who writes it tells whether anybody still does.
_STRAY = re.compile(r"\.gearbench-(?:([0-9a-f]{8})-([0-9a-f]+)-)?[0-9a-f]{16}(\.\w+)?")
_DAY = 86_400.0  # s


class FileError(OSError):
    """A file that cannot be written; the sentence names it and what stands in the way."""


def write_whole(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file of the same suffix beside `path`, then give it that name; the path.

    What fails or is interrupted leaves neither the temporary file behind nor the old one changed; what a killed process
    left in the folder is removed by the next writer on its machine, by any other a day later. The file has the
    permissions of any new file of this process (its umask). Raises FileError for a missing folder and for whatever the
    system refuses; errors of `write` that are none of the system's pass.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileError(f"{target} cannot be written: the folder {target.parent} must exist")
    remove_strays(target.parent, older=_DAY)
    who = f"{_host()}-{os.getpid():x}"
    temporary = target.with_name(f".gearbench-{who}-{secrets.token_hex(8)}{target.suffix}")
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        write(temporary)
        os.replace(temporary, target)
    except (FileError, InterruptedError):  # who is stopped by others: no system call is, since PEP 475
        raise
    except OSError as error:
        raise FileError(f"{target} cannot be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return target


def remove_strays(folder: str | Path, older: float = 0.0) -> None:
    """Remove the temporary files of `write_whole` whose process lives no more, or that nobody has written to for
    `older` seconds.

    Only who is alone in the folder may ask for 0: it takes the files of writers at work too.
    """
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if (found := _STRAY.fullmatch(entry.name)) is None:
                continue
            host, process, _ = found.groups()
            gone = host == _host() and not _lives(int(process, 16))
            if gone or entry.stat(follow_symlinks=False).st_mtime <= time.time() - older:
                os.unlink(entry.path)


@cache
def _host() -> str:
    """Eight digits for where a process number means something: this machine and its space of processes."""
    space = ""
    with suppress(OSError):
        space = os.readlink("/proc/self/ns/pid")
    return hashlib.sha256(f"{os.uname().nodename} {space}".encode()).hexdigest()[:8]


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True  # another user's, or no number of ours: let time tell
    return True


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file (UTF-8) in one step. Raises FileError."""
    return write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
