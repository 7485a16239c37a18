"""`cases`: what it lists and draws."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.image import imread

from gearbench.cases import case_files
from gearbench.cli import run_command_line
from gearbench.commands.house.cases import draw_pairs


def test_pair_of_a_case_is_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["cases", "fzg_c", "--pictures", str(tmp_path / "new")]) == 0
    (path,) = (tmp_path / "new").iterdir()
    assert capsys.readouterr().out == f"{path}\n"
    picture = imread(path)
    assert picture.shape[1] > picture.shape[0] > 300 and picture[..., :3].std() > 0.05


def test_all_pairs_are_drawn_without_a_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    drawn: list[str] = []
    monkeypatch.setattr("gearbench.figures.gears.gear.draw_pair", lambda path, *_: drawn.append(path.stem))
    assert [path.stem for path in draw_pairs(list(case_files()), tmp_path)] == drawn == list(case_files())


def test_unknown_case_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run_command_line(["cases", "none", "--pictures", str(tmp_path)]) == 2
    assert "no case is called none" in capsys.readouterr().err


def test_every_case_says_what_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["cases"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(case_files())
    assert all(line.split()[0] in case_files() and line.endswith(".") for line in lines)
