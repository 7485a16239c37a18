"""`optimise`: the number, the valley, the textbook value; against a brute-force scan with finite elements."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import gearbench as gb
from gearbench.bench import static
from gearbench.cases import case_path
from gearbench.cli import run_command_line
from gearbench.rig import read_case


def test_the_answer_is_on_the_screen_and_in_the_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The lumped mesh is stiffer the wider it is: the least transmission error lies at the bound."""
    out = tmp_path / "out"
    asked = ["--vary", "rig.driver.face_width_mm=10:20", "--for", "te-mean", "--at-nm", "100,200", "--over", "mean"]
    assert run_command_line(["optimise", "quick_lumped", *asked, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "mean over the loads, at 100, 200 N m: least" in said and "lies at the bound 20" in said
    data = json.loads((out / "optimum.json").read_text(encoding="utf-8"))
    case = read_case(out / "best.toml")
    assert case.rig.driver.face_width == pytest.approx(0.020)
    te = 1e6 * static(case, torque=[100.0, 200.0])["transmission_error"].mean("phase").values
    assert data["value"] == pytest.approx(te.mean()) and data["at_torques"] == pytest.approx(te)
    with (out / "valley.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert min(float(row["te_mean_um_mean"]) for row in rows) == data["value"]
    assert (out / "valley.png").read_bytes().startswith(b"\x89PNG") and len(rows) == data["points"]


def test_a_range_without_results_has_no_optimum(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Relief wants a diameter where it starts: without one, only the point without relief has a result."""
    asked = ["--vary", "rig.driver.tip_relief_um=0:40", "--at-nm", "100", "--out", str(tmp_path / "out")]
    assert run_command_line(["optimise", "quick_fe", *asked]) == 2
    said = capsys.readouterr().err
    assert "one point of" in said and "tip_relief_start_diameter_mm is missing" in said


def test_textbook_relief_is_the_deflection_of_one_pair() -> None:
    """By hand: 100 N m on r_b = 58.26 mm over 20 mm gives F/b = 85.8 N/mm; ISO's c' of 62/62 teeth is 13.7 there."""
    from gearbench.bench.study.design import factor_of
    from gearbench.lumped.stiffness.iso6336 import flexibility
    from gearbench.optimisation import textbook_relief

    case = read_case(case_path("paper_fe"))
    (relief,) = textbook_relief(case, [factor_of("rig.driver.tip_relief_um=0:40")], [100.0])
    force = 100.0 / (0.062 * np.cos(np.radians(20)))
    # C_M = 0.8, C_B = 1 + 0.5 (1.2 - 1.25), the fourth root of F_t / b over 100 N/mm.
    single = 0.8 * 0.975 / flexibility((62, 62), (0.0, 0.0)) * (force * np.cos(np.radians(20)) / 20 / 100) ** 0.25
    assert relief == pytest.approx(force / 20 / single, rel=1e-9)
    assert textbook_relief(case, [factor_of("rig.driver.face_width_mm=10:20")], [100.0]) == ()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "nothing may move"),
        (["--vary", "rig.driver.teeth=20:30"], "whole number, which optimise does not move"),
        (["--vary", "rig.driver.face_width_mm=1,2"], "must read KEY=LOW:HIGH"),
        (["--vary", "rig.driver.face_width_mm=10:20", "--at-nm", "50,x"], "'x' must be a torque"),
        (["--vary", "rig.driver.face_width_mm=10:20", "--at-nm", "-5"], "greater than 0"),
        (["--vary", "rig.driver.face_width_mm=10:20", "--for", "te-orders"], "name one of te_order_1_um"),
        (["--vary", "rig.driver.tip_relif_um=10:20"], "did you mean tip_relief_um"),
        (["--vary", "rig.driver.hub_radius_mm=70:80", "--for", "te-mean"], "no point of the first look"),
    ],
)
def test_what_is_wrong_is_said(
    arguments: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["optimise", "quick_lumped", *arguments, "--out", str(tmp_path / "out")]) == 2
    assert sentence in capsys.readouterr().err


@pytest.mark.validation  # a hundred static cycles of finite elements
def test_tip_relief_against_a_brute_force_scan() -> None:
    """Worst of two loads over the tip relief of both gears: nowhere on a scan four times as fine is less."""
    start = [f"rig.{side}.tip_relief_start_diameter_mm=126" for side in ("driver", "driven")]
    both = "rig.driver.tip_relief_um+rig.driven.tip_relief_um"
    found = gb.optimise("paper_fe", [f"{both}=0:16"], torques=[50.0, 100.0], settings=start)
    scan = []
    for relief in np.linspace(0.0, 16.0, 65):
        settings = [*start, *(f"rig.{side}.tip_relief_um={relief}" for side in ("driver", "driven"))]
        te = static(gb.read_case("paper_fe", settings), torque=[50.0, 100.0])["transmission_error"]
        scan.append(1e6 * float((te.max("phase") - te.min("phase")).max()))
    assert found.value <= min(scan) + 1e-3
    assert found.best[0] == pytest.approx(np.linspace(0.0, 16.0, 65)[int(np.argmin(scan))], abs=0.26)
    low, high = found.flat[0]
    within = np.linspace(0.0, 16.0, 65)[np.array(scan) <= 1.1 * min(scan)]
    assert (low, high) == pytest.approx((within[0], within[-1]), abs=0.3)
