"""Reports beside results: what they say of `static` and `compare`, where they lie, and how `open` finds them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shared.pages import fetched

from gearbench.cli import run_command_line
from gearbench.records import read_dataset
from gearbench.report.where import find_report

LOADS = ("50", "100", "150")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two static results of the lumped pair with their reports."""
    made = tmp_path_factory.mktemp("static")
    for name, module in (("a", "2"), ("b", "2.5")):
        keys = [f"rig.{gear}.module_mm={module}" for gear in ("driver", "driven")]
        keys.append(f"rig.centre_distance_mm={62 * float(module):g}")
        settings = [part for key in keys for part in ("--set", key)]
        arguments = ["static", "quick_lumped", "--out", str(made / f"{name}.nc"), "--positions", "16", *settings]
        assert run_command_line([*arguments, "--torque-nm", *LOADS]) == 0
    return made


def test_the_page_of_static_says_what_its_file_holds(folder: Path) -> None:
    page, held = (folder / "a.html").read_text(encoding="utf-8"), read_dataset(folder / "a.nc")
    assert fetched(page) == []
    swing = 1e6 * np.ptp(held["transmission_error"].values[2])
    answer = page[page.index("<h1>") : page.index("<figure")]
    assert f"TE {swing:.3g} um peak to peak at 150 N m" in answer
    assert f"{1e6 * held['transmission_error'].values[2].mean():.4g} um in the mean" in answer
    rows = page[page.index("Every load") :]
    for load in range(3):
        assert f"{1e-6 * held['stiffness_tangent'].values[load].max():.5g}</td>" in rows
    for words in ("Harris map", "Weber-Banaschek", "What the lumped model leaves out", "SHA-256", "module_mm = 2.0"):
        assert words in page


def test_a_page_of_somebody_else_is_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    theirs = tmp_path / "static.html"
    theirs.write_text("<p>my thesis</p>", encoding="utf-8")
    arguments = ["static", "quick_lumped", "--out", str(tmp_path / "static.nc"), "--positions", "4"]
    assert run_command_line(arguments) == 2
    assert "--no-report" in capsys.readouterr().err and not (tmp_path / "static.nc").exists()
    assert run_command_line([*arguments, "--no-report"]) == 0
    assert theirs.read_text(encoding="utf-8") == "<p>my thesis</p>" and (tmp_path / "static.nc").exists()


def test_the_page_of_a_comparison(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "compared"
    assert run_command_line(["compare", str(folder / "a.nc"), str(folder / "b.nc"), "--out", str(out)]) == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert fetched(page) == [] and page.count('<figure class="live"') == 2
    one, two = (1e6 * np.ptp(read_dataset(folder / f"{name}.nc")["transmission_error"].values[0]) for name in "ab")
    assert f"{one:.4g} um in a, {two:.4g} in b, {100 * (two - one) / one:+.1f} %" in page
    assert find_report(out) == out / "report.html"


def test_open_shows_the_page_in_the_browser(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    note, browser = tmp_path / "shown", tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > "{note}"\n', encoding="utf-8")
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    assert run_command_line(["open", str(folder / "a.nc")]) == 0
    assert note.read_text(encoding="utf-8").strip() == (folder / "a.html").as_uri()
    assert "no browser" not in capsys.readouterr().err


def test_open_without_a_browser_says_where_the_page_is(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert run_command_line(["open", str(folder / "b.html")]) == 0
    told = capsys.readouterr()
    assert told.out.strip() == str((folder / "b.html").resolve())
    assert "no browser can be opened here" in told.err


def test_open_refuses_what_has_no_report(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.html"
    other.write_text("<p>mine</p>", encoding="utf-8")
    for what, words in (
        (tmp_path, "holds no report"),
        (folder, "holds 2 reports"),
        (other, "no report of gearbench"),
        (tmp_path / "none", "does not exist"),
    ):
        assert run_command_line(["open", str(what)]) == 2
        assert words in capsys.readouterr().err
