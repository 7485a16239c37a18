"""Files are there whole or not at all, with the permissions of any other, and what fails is said in a sentence."""

from __future__ import annotations

import errno
import multiprocessing
import os
import stat
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from gearbench.files import FileError, remove_strays, write_text, write_whole


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


def test_what_a_killed_writer_left_goes_a_day_later(tmp_path: Path) -> None:
    """Names and ages: ours and old goes; ours at work stays; the user's own stays, however old."""
    old = time.time() - 2 * 86_400
    stray, at_work, own = (
        tmp_path / f".gearbench-{'0' * 16}.nc",
        tmp_path / f".gearbench-{'1' * 16}.nc",
        tmp_path / ".gearbench-notes.txt",
    )
    for path in (stray, at_work, own):
        path.write_text("half")
    for path in (stray, own):
        os.utime(path, (old, old))
    write_text(tmp_path / "a.txt", "text")
    assert names(tmp_path) == sorted(["a.txt", at_work.name, own.name])
    remove_strays(tmp_path)
    assert names(tmp_path) == sorted(["a.txt", own.name])


def test_the_names_of_temporary_files_are_those_that_are_removed(tmp_path: Path) -> None:
    def killed(temporary: Path) -> None:
        remove_strays(tmp_path)
        assert not temporary.exists()
        temporary.write_text("again")

    for name in ("a.nc", "no_suffix", "b.tar.gz"):
        write_whole(tmp_path / name, killed)
        (tmp_path / name).unlink()


def test_what_a_killed_writer_left_goes_with_the_next_write(tmp_path: Path) -> None:
    def killed(temporary: Path) -> None:
        temporary.write_text("half")
        os._exit(9)

    process = multiprocessing.get_context("fork").Process(target=write_whole, args=(tmp_path / "a.txt", killed))
    process.start()
    process.join()
    (left,) = names(tmp_path)
    assert process.exitcode == 9 and left.startswith(".gearbench-")
    # One of the same number on another machine may still be at work.
    elsewhere = left.replace(left.split("-")[1], "00000000")
    (tmp_path / elsewhere).write_text("half")
    write_text(tmp_path / "a.txt", "text")
    assert names(tmp_path) == sorted(["a.txt", elsewhere])
