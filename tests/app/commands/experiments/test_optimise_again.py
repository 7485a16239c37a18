"""`optimise` on processes, interrupted and taken up again: the same answer to the last bit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gearbench as gb
from gearbench.bench.study import points
from gearbench.bench.study.points import points_text, read_points
from gearbench.cli import run_command_line
from gearbench.shell.failure import InputError

WIDTHS = ["rig.driver.face_width_mm=10:20"]


def answer(out: Path) -> dict[str, object]:
    data: dict[str, object] = json.loads((out / "optimum.json").read_text(encoding="utf-8"))
    return data


@pytest.mark.validation  # two searches, and processes that take seconds to begin
def test_processes_give_the_same_numbers(tmp_path: Path) -> None:
    alone, together = (
        gb.optimise("quick_lumped", WIDTHS, "te-mean", [100.0, 200.0], workers=count, out=tmp_path / str(count))
        for count in (1, 2)
    )
    assert np.array_equal(alone.valley.points, together.valley.points)
    assert np.array_equal(alone.valley.values, together.valley.values)
    assert answer(tmp_path / "1") == answer(tmp_path / "2")


def test_an_interrupted_search_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ten points, then Ctrl-C; the second search solves only the others."""
    out, whole = tmp_path / "out", tmp_path / "whole"
    true = points.at_loads
    calls: list[int] = []

    def counted(*arguments: object) -> object:
        calls.append(1)
        if len(calls) == 11:
            raise KeyboardInterrupt
        return true(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(points, "at_loads", counted)
    asked = ["optimise", "quick_lumped", "--vary", *WIDTHS, "--for", "te-mean", "--workers", "1", "--out"]
    assert run_command_line([*asked, str(out)]) == 130
    assert "the same command goes on" in capsys.readouterr().err
    held = read_points((out / "points.json").read_text(encoding="utf-8"))
    assert len(held) == 10
    before = len(calls)
    assert run_command_line([*asked, str(out)]) == 0
    rest = len(calls) - before
    calls[:] = [1] * 11
    assert run_command_line([*asked, str(whole)]) == 0
    assert rest == len(calls) - 11 - 10
    assert (out / "valley.csv").read_text() == (whole / "valley.csv").read_text()
    assert answer(out) == answer(whole)
    with pytest.raises(InputError, match="another case, other options"):
        gb.optimise("quick_lumped", WIDTHS, "te-peak-to-peak", out=out)


def test_points_are_kept_to_the_last_bit() -> None:
    known = {(0.1, 1 / 3): np.array([np.pi, np.nan]), (2.0, -1e-9): np.array([1e300, 5e-324])}
    again = read_points(points_text(known))
    assert list(again) == list(known)
    assert all(np.array_equal(again[one], known[one], equal_nan=True) for one in known)
    for text in ("", "[1]", '[[["a"],[1]]]'):
        with pytest.raises(ValueError):
            read_points(text)
