"""Files are there whole or not at all, with the permissions of any other, and what fails is said in a sentence."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from gearbench.files import FileError, write_text, write_whole


@pytest.fixture(params=[0o022, 0o077])
def umask(request: pytest.FixtureRequest) -> Iterator[int]:
    before = os.umask(request.param)
    yield int(request.param)
    os.umask(before)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_old_file_stays_until_the_new_one_is_complete(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.txt", "old")

    def write(temporary: Path) -> None:
        assert temporary.parent == tmp_path and temporary.suffix == ".txt" and temporary != path
        temporary.write_text("new")
        assert path.read_text() == "old"

    assert write_whole(path, write) == path
    assert path.read_text() == "new" and names(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_what_breaks_off_leaves_nothing_and_changes_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    path = write_text(tmp_path / "a.txt", "old")

    def write(temporary: Path) -> None:
        temporary.write_text("half")
        raise error

    with pytest.raises(error):
        write_whole(path, write)
    assert path.read_text() == "old" and names(tmp_path) == ["a.txt"]


def test_permissions_follow_the_umask(tmp_path: Path, umask: int) -> None:
    path = write_text(tmp_path / "a.txt", "text")
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~umask


def test_a_full_disk_is_one_sentence_about_the_file_itself(tmp_path: Path) -> None:
    def write(temporary: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(temporary))

    with pytest.raises(FileError, match=r"/a\.nc cannot be written: No space left on device$"):
        write_whole(tmp_path / "a.nc", write)
    assert names(tmp_path) == []


def test_a_missing_folder_and_a_folder_in_the_way_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"a\.txt cannot be written: the folder \S+/none must exist$"):
        write_text(tmp_path / "none" / "a.txt", "text")
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileError, match=r"/folder cannot be written: \w+"):
        write_text(tmp_path / "folder", "text")
    assert names(tmp_path) == ["folder"]
