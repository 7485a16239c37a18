"""Commands from the outside: what they print, and their exit codes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import meshio
import numpy as np
import pytest
import typer
from rich.markup import render

from gearbench.cases import case_files, case_path
from gearbench.cli import application, run_command_line
from gearbench.rig import read_case
from gearbench.shell.options import expand_lists


def test_check_prints_the_data_sheet(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["check", str(case_path("paper_fe"))]) == 0
    out = capsys.readouterr().out
    rows = {line.strip().rsplit("  ", 2)[0].strip(): line.split() for line in out.splitlines() if line.strip()}
    assert rows["centre distance"][-2:] == ["124", "mm"]  # m (z1 + z2) / 2
    assert "116.522" in out  # base diameter 124 cos 20 deg
    assert "contact ratio" in out and "backlash" in out and "inertia" in out


def test_check_as_json_and_with_settings(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [
        "check",
        "paper_fe",
        "--json",
        "--set",
        "rig.driver.teeth=30",
        "--set",
        "rig.driver.inertia_kg_m2=1e-2",
    ]
    arguments += ["--set", "rig.driver.hub_radius_mm=20"]
    assert run_command_line(arguments) == 0
    data = json.loads(capsys.readouterr().out)["data"]
    assert data["centre distance"] == {"value": pytest.approx(92.0, rel=1e-12), "unit": "mm"}
    assert data["driver inertia"] == {"value": pytest.approx(0.01), "unit": "kg m^2"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "none.toml"], ["none.toml", "does not exist"]),
        (["check"], ["CASE"]),
        (["chek", "paper_fe"], ["chek"]),
        (["check", "paper_fe", "--set", "rig.driver.teeth=4"], ["rig.driver.teeth = 4", "at least 5"]),
        (["check", "paper_fe", "--set", "rig.driver.module_mm=3"], ["module_mm", "3", "2"]),
        (
            ["check", "paper_fe", "--set", "rig.driver.hub_radius_mm=60"],
            ["rig.driver.hub_radius_mm = 60", "59.3"],
        ),
        (["mesh", "paper_fe"], ["--out"]),
        (["mesh", "paper_fe", "--out", "gear.stl"], ["gear.stl", ".msh"]),
        (["mesh", "paper_fe", "--out", "gear.msh", "--gear", "third"], ["third"]),
        (["cases", "papr_fe"], ["papr_fe", "paper_fe"]),
        (["cases", "--copy", "x"], ["--copy"]),
    ],
)
def test_bad_input_is_one_sentence_and_exit_2(
    arguments: list[str],
    words: list[str],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_command_line(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    sentence = [line for line in captured.err.splitlines() if line.startswith("gearbench: ")]
    assert len(sentence) == 1
    for word in words:
        assert word in sentence[0]
    assert "Traceback" not in captured.err
    assert list(tmp_path.iterdir()) == []


def test_a_defect_is_told_from_bad_input(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def broken(path: object, overrides: object = ()) -> None:
        raise ValueError("no error of ours is a plain ValueError")

    monkeypatch.setattr("gearbench.cases.read_file", broken)
    monkeypatch.delenv("GEARBENCH_DEBUG", raising=False)
    assert run_command_line(["check", "paper_fe"]) == 1
    err = capsys.readouterr().err
    assert "defect of gearbench: ValueError" in err and "GEARBENCH_DEBUG" in err and "Traceback" not in err
    monkeypatch.setenv("GEARBENCH_DEBUG", "1")
    assert run_command_line(["check", "paper_fe"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_interruption_is_130(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(path: object, overrides: object = ()) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr("gearbench.cases.read_file", interrupted)
    assert run_command_line(["check", "paper_fe"]) == 130
    assert signal.getsignal(signal.SIGTERM) is before

    def ctrl_c(path: object, overrides: object = ()) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gearbench.cases.read_file", ctrl_c)
    assert run_command_line(["check", "paper_fe"]) == 130
    assert "interrupted" in capsys.readouterr().err


def test_exit_codes_of_the_process() -> None:
    def call(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "gearbench", *arguments], capture_output=True, text=True)

    version = call("--version")
    assert (version.returncode, version.stderr) == (0, "") and version.stdout.strip()
    bad = call("check", "paper_fe", "--set", "rig.driver.teeth=x")
    assert (bad.returncode, bad.stdout) == (2, "")
    assert bad.stderr == 'gearbench: rig.driver.teeth = "x" must be a number\n'


def test_ctrl_c_is_130_whatever_was_at_work(tmp_path: Path) -> None:
    """While a text is executed too: Python's own exit is then a death by SIGINT."""
    (tmp_path / "held.py").write_text(
        "import sys\nfrom gearbench import cli\n"
        "def stopped(*given, **named):\n    exec('raise KeyboardInterrupt')\n"
        "cli.application = lambda names=(): stopped\nsys.argv = ['gearbench', 'check', 'quick_fe']\ncli.main()\n",
        encoding="utf-8",
    )
    done = subprocess.run([sys.executable, "-m", "held"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "gearbench: interrupted\n")


def test_help_and_registration_import_nothing_heavy() -> None:
    code = (
        "import sys; from gearbench.cli import run_command_line; run_command_line(['--help']);"
        "heavy = {'numpy', 'scipy', 'gmsh', 'xarray', 'numba', 'matplotlib', 'pyvista', 'pydantic'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1] == "[]"


def help_texts(command: typer.core.TyperCommand | typer.core.TyperGroup) -> Iterator[str]:
    """Everything that --help shows of a command and those below it."""
    yield command.help or ""
    for parameter in command.params:
        yield str(getattr(parameter, "help", None) or "")
    for below in getattr(command, "commands", {}).values():
        yield from help_texts(below)


def test_help_shows_every_word_of_it() -> None:
    texts = list(help_texts(typer.main.get_command(application())))
    assert len(texts) > 50
    for text in texts:
        assert render(text).plain == text  # [um] would be a style, and vanish


def test_schema_and_reference(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["schema"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "gearbench case"
    assert run_command_line(["schema", "--reference"]) == 0
    assert tomllib.loads(capsys.readouterr().out)["name"] == "reference"


def test_cases_lists_prints_and_copies(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run_command_line(["cases"]) == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert listed == list(case_files())
    assert run_command_line(["cases", "paper_fe"]) == 0
    assert tomllib.loads(capsys.readouterr().out)["name"] == "paper_fe"
    folder = tmp_path / "mine"
    assert run_command_line(["cases", "paper_fe", "--copy", str(folder)]) == 0
    copied = Path(capsys.readouterr().out.strip())
    assert read_case(copied) == read_case(case_path("paper_fe"))
    copied.write_text(copied.read_text().replace("periods = 4", "periods = 5"))
    assert run_command_line(["cases", "paper_fe", "--copy", str(folder)]) == 2
    assert "not replaced" in capsys.readouterr().err
    assert read_case(copied).experiment.periods == 5


def test_mesh_writes_one_gear_and_both(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    coarse = ["--set", "simulation.element_size_um=800"]
    both, one = tmp_path / "both.vtu", tmp_path / "one.msh"
    assert run_command_line(["mesh", "paper_fe", "--out", str(both), "--json", *coarse]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert run_command_line(["mesh", "paper_fe", "--out", str(one), "--gear", "driven", *coarse]) == 0
    pair, single = meshio.read(both), meshio.read(one)
    assert len(pair.points) == summary["nodes"] == 2 * len(single.points)
    radii = np.hypot(*single.points[:, :2].T)
    assert radii.min() == pytest.approx(0.025, abs=1e-9) and radii.max() == pytest.approx(0.064, abs=1e-9)
    assert pair.points[:, 0].max() == pytest.approx(0.124 + 0.064, abs=1e-5)


CRACK = "rig.driven.crack={tooth=3, length_mm=0.8, direction_deg=60}"


def test_mesh_shows_a_crack(tmp_path: Path) -> None:
    path = tmp_path / "gear.vtu"
    settings = ["--set", "simulation.element_size_um=800", "--set", CRACK]
    assert run_command_line(["mesh", "paper_fe", "--out", str(path), "--gear", "driven", *settings]) == 0
    places, count = np.unique(np.round(meshio.read(path).points, 11), axis=0, return_counts=True)
    slit = places[count > 1]
    assert 0.72e-3 < np.linalg.norm(np.ptp(slit, axis=0)) < 0.8e-3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--out", "pair.inp"], ["rig.driven.crack"]),
        (["--out", "pair.dxf"], ["rig.driven.crack", "pair.dxf"]),
        (["--out", "gear.step", "--gear", "driven"], ["rig.driven.crack", "gear.step"]),
        (["--out", "pair.vtu", "--element", "quadrilateral"], ["rig.driven.crack", "--element"]),
        (["--out", "pair.vtu", "--set", 'simulation.element="quadrilateral"'], ["rig.driven.crack", "simulation.ele"]),
    ],
)
def test_mesh_refuses_a_crack_that_it_cannot_show(
    options: list[str], words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_command_line(["mesh", "paper_fe", "--set", CRACK, *options]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words) and said.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "spelt"),
    [
        (
            ["static", "c", "--torque-nm", "1", "-2", "3e1"],
            ["static", "c", "--torque-nm", "1", "--torque-nm", "-2", "--torque-nm", "3e1"],
        ),
        (["static", "--torque-nm", "1", "c", "2"], ["static", "--torque-nm", "1", "c", "2"]),
        (["--torque-nm", "1", "--out", "5"], ["--torque-nm", "1", "--out", "5"]),
    ],
)
def test_lists_of_numbers_are_spelt_out(given: list[str], spelt: list[str]) -> None:
    assert expand_lists(given, ["--torque-nm"]) == spelt
