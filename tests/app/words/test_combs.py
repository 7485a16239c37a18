"""What `check` says about combs, and `simulate` on a case with conditions."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gearbench.cli import run_command_line
from gearbench.records import read_record

INHERENT = (
    "3rd driven-shaft sideband of the operating response falls on the 2nd driver-shaft sideband of the operating"
    " response, whatever the residue"
)


def check(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert run_command_line(["check", "gap_demo", *arguments]) == 0
    return capsys.readouterr().out


def test_check_prints_residue_and_overlaps(capsys: pytest.CaptureFixture[str]) -> None:
    text = check(capsys)
    assert "comb (base, light, fast, held-out): 60 lines to the mesh frequency, residue 13" in text
    assert INHERENT in text
    assert "3rd driver-shaft sideband of the operating response falls on the" in text
    bad = check(capsys, "--set", "experiment.multisine.residue=20")
    assert "even distortion falls on the linear response" in bad


def test_conditions_with_different_combs_are_reported_apart(capsys: pytest.CaptureFixture[str]) -> None:
    text = check(capsys, "--set", "condition.2.samples_per_period=20480", "--set", "experiment.realisations=2")
    assert "comb (base, light, held-out): 60 lines to the mesh frequency, residue 13" in text
    assert "comb (fast): 120 lines to the mesh frequency, residue 17" in text
    assert "further realisations take the residues (overlaps) 25 (" in text


def test_check_json_holds_all_overlaps(capsys: pytest.CaptureFixture[str]) -> None:
    (comb,) = json.loads(check(capsys, "--json"))["combs"]
    assert (comb["modulus"], comb["residues"], len(comb["conditions"])) == (60, [13], 4)
    assert {"sentence": INHERENT, "lines": [6], "inherent": True}.items() <= next(
        one for one in comb["overlaps"] if one["inherent"]
    ).items()


def test_nothing_is_said_without_a_comb(capsys: pytest.CaptureFixture[str]) -> None:
    assert "comb" not in check(capsys, "--set", "experiment.multisine.grid=odd")
    assert run_command_line(["check", "quick_lumped", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["combs"] == []


def test_every_condition_is_refused_before_the_first_is_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "record.nc")
    late = ["--set", "condition.3.samples_per_period=8192", "--set", "condition.3.periods=5"]
    for command in (["check", "gap_demo"], ["simulate", "gap_demo", "--out", out], ["run", "gap_demo"]):
        folder = ["--out", str(tmp_path / "results")] if command[0] == "run" else []
        assert run_command_line([*command, *folder, *late]) == 2
        assert "set samples_per_period = 12288 or a multiple" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_simulate_writes_one_record_for_each_condition(tmp_path: Path) -> None:
    out = tmp_path / "record.nc"
    case = ["simulate", "quick_lumped", "--out", str(out), "--set", "experiment.realisations=1"]
    conditions = "condition=[{name = 'low', torque_mean_nm = 100.0}, {name = 'high', torque_mean_nm = 300.0}]"
    assert run_command_line([*case, "--set", conditions]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["record-high.nc", "record-low.nc"]
    low, high = (float(read_record(tmp_path / f"record-{name}.nc")["torque_driver"].mean()) for name in ("low", "high"))
    assert (low, high) == (pytest.approx(100.0), pytest.approx(300.0))
