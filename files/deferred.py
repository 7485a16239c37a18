"""A file whose errors wait: for libraries that do not survive a failed write."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any


class DeferredFile(io.RawIOBase):
    """An existing file, opened for reading and writing, that takes everything and keeps the first error for later.

    HDF5 crashes the process when it cannot write what it still holds (full disk). Given this file it never hears of it:
    after the first error what is written is dropped, and `check` raises that error. Costs no memory.
    """

    def __init__(self, path: str | Path) -> None:
        self.error: OSError | None = None
        self._file = open(path, "r+b", buffering=0)  # noqa: SIM115 (closed with this object)

    def readable(self) -> bool:
        """Yes."""
        return True

    def writable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """Yes."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """As of any file."""
        return self._file.seek(offset, whence)

    def readinto(self, buffer: Any) -> int:
        """As of any file; zeros for what could not be written."""
        done = self._file.readinto(buffer) or 0
        if self.error is not None and done < len(buffer):
            buffer[done:] = bytes(len(buffer) - done)
            done = len(buffer)
        return done

    def write(self, data: Any) -> int:
        """Write all of `data`, or drop it after an error."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while self.error is None and len(rest):
                rest = rest[self._file.write(rest) or 0 :]
        except OSError as error:
            self.error = error
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the size, or leave it after an error."""
        wanted = self._file.tell() if size is None else size
        try:
            if self.error is None:
                self._file.truncate(wanted)
        except OSError as error:
            self.error = error
        return wanted

    def close(self) -> None:
        """Close the file; its errors wait too."""
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or error
        super().close()

    def check(self) -> None:
        """Raise the first error (OSError), if there was one."""
        if self.error is not None:
            raise self.error
