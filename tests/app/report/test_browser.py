"""Reports in a browser: every figure is drawn, nothing goes wrong, nothing is asked for, nothing reaches too far."""

from __future__ import annotations

from base64 import b64decode
from pathlib import Path

import pytest
from shared.pages import CHROMIUM, WIDTHS, browsed
from shared.small_run import SMALL_RUN

from gearbench.cases import read_case
from gearbench.cli import run_command_line
from gearbench.report.animation import animation_page

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


@needs_browser
def test_a_page_that_goes_wrong_is_seen_and_a_player_is_not_one(tmp_path: Path) -> None:
    page = tmp_path / "bad.html"
    policy = '<meta http-equiv="Content-Security-Policy" content="default-src \'unsafe-inline\'">'
    wide = '<div style="width:2000px">wide</div><img src="https://example.org/a.png"><script>missing()</script>'
    page.write_text(f"<html><head>{policy}</head><body>{wide}</body></html>", encoding="utf-8")
    player = tmp_path / "player.html"
    dot = ("image/gif", b64decode("R0lGODlhAQABAAAAACH5BAEKAAEALAAAAAABAAEAAAICTAEAOw=="))
    player.write_text(animation_page(read_case("quick_lumped"), "Moving", ["One."], [dot, dot], 8.0), encoding="utf-8")
    heard = browsed([page, player], tmp_path)
    for width in WIDTHS:
        assert heard[f"player {width}"]["wrong"] == [] and heard[f"player {width}"]["beyond"] <= 0
        told = heard[f"bad {width}"]
        assert told["beyond"] >= 2000 - width
        assert any("missing" in words for words in told["wrong"])
        assert any("example.org" in words for words in told["wrong"])


@needs_browser
@pytest.mark.validation
def test_all_reports_are_drawn_at_both_widths(tmp_path: Path) -> None:
    run, other, compared = tmp_path / "run", tmp_path / "other", tmp_path / "compared"
    assert run_command_line(["run", *SMALL_RUN, "--out", str(run)]) == 0
    assert run_command_line(["run", *SMALL_RUN, "--out", str(other), "--set", "experiment.torque_mean_nm=300"]) == 0
    assert run_command_line(["compare", str(run), str(other), "--out", str(compared)]) == 0
    static, sweep = tmp_path / "static.nc", tmp_path / "sweep.nc"
    arguments = ["static", "quick_fe", "--torque-nm", "50", "100", "200", "--positions", "8", "--out", str(static)]
    assert run_command_line(arguments) == 0
    arguments = ["sweep", "rig_62", "--points", "4", "--from-rpm", "1000", "--to-rpm", "4000", "--out", str(sweep)]
    assert run_command_line(arguments) == 0
    study = tmp_path / "study"
    arguments = ["campaign", "quick_lumped", "--vary", "rig.driver.face_width_mm=10:20:3", "--out", str(study)]
    arguments += ["--vary", "rig.driver.hub_radius_mm=30,40", "--of", "te-mean,te-orders", "--workers", "1"]
    assert run_command_line(arguments) == 0
    names = {"run": run / "report.html", "compared": compared / "report.html", "study": study / "report.html"}
    pages = []
    for name, path in names.items():
        pages.append(path.rename(tmp_path / f"{name}.html"))
    pages += [static.with_suffix(".html"), sweep.with_suffix(".html")]
    heard = browsed(pages, tmp_path)
    assert len(heard) == len(pages) * len(WIDTHS)
    for name, told in heard.items():
        assert told["wrong"] == [] and told["beyond"] <= 0, (name, told)
        assert told["drawn"] == told["figures"] > 1 and told["plots"] >= told["figures"], (name, told)
