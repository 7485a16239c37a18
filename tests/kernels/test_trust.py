"""Machine code is kept where nobody else can put another, and the folders that people use keep working."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from gearbench.cli import run_command_line
from gearbench.kernels.trust import CacheError, trusted


@pytest.fixture(autouse=True)
def forget() -> None:
    trusted.cache_clear()


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    """A folder that all may enter, unlike that of pytest."""
    with tempfile.TemporaryDirectory() as made:
        Path(made).chmod(0o755)
        yield Path(made)


def folder(path: Path, mode: int) -> Path:
    path.mkdir()
    path.chmod(mode)
    return path


def test_a_new_folder_is_made_for_its_owner_alone_whatever_the_umask(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        made = trusted(tmp_path / "one" / "cache")
    finally:
        os.umask(before)
    assert stat.S_IMODE(made.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o700, 0o755, 0o775, 0o2775])
def test_folders_of_ones_own_and_of_a_group_are_taken(tmp_path: Path, mode: int) -> None:
    assert trusted(folder(tmp_path / "cache", mode)) == tmp_path / "cache"


@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o702])
def test_a_folder_that_all_may_write_to_is_refused(tmp_path: Path, mode: int) -> None:
    with pytest.raises(CacheError, match=r"/cache is writable by all.*chmod o-w"):
        trusted(folder(tmp_path / "cache", mode))


def test_a_closed_folder_protects_what_is_below(tmp_path: Path) -> None:
    closed = folder(tmp_path / "home", 0o700)
    assert trusted(folder(closed / "cache", 0o777)) == closed / "cache"
    assert trusted(folder(folder(closed / "open", 0o777) / "cache", 0o777))


def test_a_link_is_judged_by_where_it_leads(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(folder(tmp_path / "open", 0o777))
    with pytest.raises(CacheError, match=r"/link is writable by all"):
        trusted(tmp_path / "link")


def test_below_a_folder_of_all_it_must_be_sticky(tmp_path: Path) -> None:
    """Without the sticky bit anybody can put another folder in the place of this one."""
    assert trusted(folder(tmp_path / "sticky", 0o1777) / "cache").is_dir()
    with pytest.raises(CacheError, match=r"lies in \S+/open, which is writable by all"):
        trusted(folder(tmp_path / "open", 0o777) / "cache")


@pytest.mark.skipif(os.geteuid() != 0, reason="needs the right to give a folder away")
def test_a_folder_of_another_user_is_refused(tmp_path: Path) -> None:
    os.chown(folder(tmp_path / "cache", 0o755), 65533, -1)
    with pytest.raises(CacheError, match="belongs to another user"):
        trusted(tmp_path / "cache")


def test_what_cannot_be_made_passes(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    assert trusted(tmp_path / "file" / "cache") == tmp_path / "file" / "cache"


def test_the_command_line_says_it_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("GEARBENCH_CACHE", str(folder(tmp_path / "cache", 0o777)))
    assert run_command_line(["static", "quick_fe", "--positions", "2", "--out", str(tmp_path / "static.nc")]) == 2
    assert capsys.readouterr().err.endswith("or set GEARBENCH_CACHE to a folder of your own\n")
