"""`sweep`: its file, its pictures, its refusals."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest
from shared.pages import fetched
from shared.rectangular import NONLINEAR

from gearbench.cli import run_command_line
from gearbench.records import read_dataset

SETTINGS = (*NONLINEAR, "rig.damping.mesh_ratio=0.1")


def test_the_command_writes_numbers_and_pictures(tmp_path: Path) -> None:
    out, picture, orders = tmp_path / "sweep.nc", tmp_path / "sweep.png", tmp_path / "orders.png"
    settings = [word for setting in SETTINGS for word in ("--set", setting)]
    span = ["--from-rpm", "300", "--to-rpm", "900", "--points", "3"]
    command = ["sweep", "rig_62", "--out", str(out), "--figure", str(picture), "--waterfall", str(orders)]
    assert run_command_line([*command, *span, *settings]) == 0
    found = read_dataset(out)
    assert found.sizes["speed"] == 3 and found.attrs["schema"] == "gearbench-sweep/1"
    assert found["speed"].values * 30 / pi == pytest.approx([300.0, 600.0, 900.0])
    assert picture.stat().st_size > 10_000 and orders.stat().st_size > 10_000
    page = out.with_suffix(".html").read_text(encoding="utf-8")
    assert fetched(page) == [] and page.count('<figure class="live"') == 2
    at = int(found["dte_rms"].values.max(axis=0).argmax())
    assert f"largest DTE {1e6 * found['dte_rms'].values.max():.3g} um rms at {(300, 600, 900)[at]} rpm" in page


def test_speeds_that_do_not_rise_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    command = ["sweep", "rig_62", "--out", str(tmp_path / "a.nc"), "--from-rpm", "900", "--to-rpm", "300"]
    assert run_command_line(command) == 2
    assert "--from-rpm 900 must be greater than 0 and less than --to-rpm 300" in capsys.readouterr().err
