"""A file whose errors wait behaves as a file until the first one, and says it then."""

from __future__ import annotations

import errno
import io
from pathlib import Path

import pytest

from gearbench.files import DeferredFile


def test_it_is_a_file_like_any_other(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"0123456789")
    with DeferredFile(path) as file:
        file.seek(2)
        assert file.read(3) == b"234"
        file.write(b"abc")
        file.seek(-1, io.SEEK_END)
        assert file.read(5) == b"9"
        file.truncate(8)
    file.check()
    assert path.read_bytes() == b"01234abc"


def test_after_the_first_error_all_is_taken_and_the_error_kept() -> None:
    with DeferredFile("/dev/full") as file:
        assert file.write(b"x" * 5000) == 5000
        assert file.write(b"y") == 1
        file.truncate(3)
        assert file.readinto(bytearray(7)) == 7
    with pytest.raises(OSError) as caught:
        file.check()
    assert caught.value.errno == errno.ENOSPC
