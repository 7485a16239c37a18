"""Output folders: taken, resumed, refused; files are whole or absent."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearbench.files import fingerprint
from gearbench.shell.failure import InputError
from gearbench.shell.output import claimed


def test_resumes_the_same_and_refuses_another(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "out"
    with claimed(folder, "run", "a") as output:
        assert not output.has("record.nc")
        output.write_text("record.nc", "first")
    with claimed(folder, "run", "a") as output:
        assert output.has("record.nc")
    for command, identity in (("run", "b"), ("compare", "a")):
        with pytest.raises(InputError, match="another case"), claimed(folder, command, identity):
            pass
    assert (folder / "record.nc").read_text() == "first"


def test_force_removes_what_the_former_run_wrote_and_nothing_else(tmp_path: Path) -> None:
    with claimed(tmp_path, "run", "a") as output:
        output.write_text("record.nc", "first")
        output.write_text("summary.md", "first")
    (tmp_path / "notes.txt").write_text("the user's own")
    with claimed(tmp_path, "run", "b", force=True) as output:
        assert not output.has("record.nc")
        output.write_text("record.nc", "second")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["notes.txt", "record.nc", "run.json"]


def test_a_folder_of_the_users_own_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(InputError, match="another origin"), claimed(tmp_path, "run", "a"):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(InputError, match="is a file"), claimed(tmp_path / "thesis.tex", "run", "a"):
        pass


def test_a_mark_cannot_point_outside_the_folder(tmp_path: Path) -> None:
    precious = tmp_path / "precious.txt"
    precious.write_text("keep")
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "run.json").write_text('{"command": "run", "identity": "x", "files": {"../precious.txt": ""}}')
    with claimed(folder, "run", "a", force=True):
        pass
    assert precious.read_text() == "keep"


def test_two_runs_at_once_are_refused(tmp_path: Path) -> None:
    refused = pytest.raises(InputError, match="another run")
    with claimed(tmp_path, "run", "a"), refused, claimed(tmp_path, "run", "a"):
        pass
    with claimed(tmp_path, "run", "a"):
        pass


def test_a_broken_write_leaves_the_old_file(tmp_path: Path) -> None:
    with claimed(tmp_path, "run", "a") as output:
        output.write_text("summary.md", "old")

        def fail(path: Path) -> None:
            path.write_text("half")
            raise RuntimeError("disk")

        with pytest.raises(RuntimeError):
            output.write("summary.md", fail)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["run.json", "summary.md"]
        assert (tmp_path / "summary.md").read_text() == "old"


def test_fingerprints_keep_their_parts_apart() -> None:
    assert fingerprint("ab", "c") != fingerprint("a", "bc")
    assert fingerprint("ab", "c") == fingerprint("ab", "c")


def test_a_product_that_is_not_as_it_was_written_is_made_again(tmp_path: Path) -> None:
    """Truncated, emptied, another of the same size, or never noted: none of them is a product."""
    with claimed(tmp_path, "run", "a") as output:
        for name in ("cut.png", "empty.nc", "other.nc", "whole.nc"):
            output.write_text(name, "content")
    (tmp_path / "cut.png").write_text("cont")
    (tmp_path / "empty.nc").write_text("")
    (tmp_path / "other.nc").write_text("CONTENT")
    (tmp_path / "foreign.nc").write_text("content")
    with claimed(tmp_path, "run", "a") as output:
        names = ("cut.png", "empty.nc", "other.nc", "foreign.nc", "absent.nc", "whole.nc")
        assert [name for name in names if output.has(name)] == ["whole.nc"]


def test_a_run_killed_in_its_first_write_does_not_block_the_folder(tmp_path: Path) -> None:
    (tmp_path / f".gearbench-{'a' * 16}.json").write_text("{")
    with claimed(tmp_path, "run", "a"):
        assert [path.name for path in tmp_path.iterdir()] == ["run.json"]


@pytest.mark.parametrize(
    "mark", ["", "[]", '{"command": "run", "identity": "a", "files": ["record.nc"]}', '{"files": 3}']
)
def test_a_damaged_mark_takes_nothing_for_done(tmp_path: Path, mark: str) -> None:
    (tmp_path / "run.json").write_text(mark)
    (tmp_path / "record.nc").write_text("old")
    with claimed(tmp_path, "run", "a", force=True) as output:
        assert not output.has("record.nc")
        output.write_text("record.nc", "new")
        assert output.has("record.nc")


def test_an_interruption_says_what_it_leaves(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), claimed(tmp_path / "out", "run", "a"):
        raise KeyboardInterrupt
    assert capsys.readouterr().err == ""  # nothing to go on from
    with pytest.raises(KeyboardInterrupt), claimed(tmp_path / "out", "run", "a") as output:
        output.write_text("record.nc", "first")
        raise KeyboardInterrupt
    kept = f"gearbench: what is done is kept in {tmp_path / 'out'}: the same command goes on from there\n"
    assert capsys.readouterr().err == kept
