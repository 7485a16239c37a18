"""`convert` as it is typed: exit codes, the table of the guess, files written or not, and what takes the record."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from measured_files import OCTAVE, dataset_58, write_uff

import gearbench as gb
from gearbench.cli import run_command_line

MAT, MAP = str(OCTAVE / "octave_v7.mat"), str(OCTAVE / "map.toml")
RIG = [
    "--rig",
    "quick_lumped",
    "--set",
    "experiment.sampling_rate_hz=2048",
    "--set",
    "experiment.samples_per_period=1024",
]
RIG += ["--set", "experiment.multisine.band_hz=[1,900]", "--set", "identification.band_hz=[1,900]"]
Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def said(capsys: Capture) -> str:
    """The one sentence of a refusal."""
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("gearbench: ")]
    assert len(lines) == 1
    return lines[0]


def test_show_lists_columns(capsys: Capture) -> None:
    assert run_command_line(["convert", MAT, "--show"]) == 0
    out = capsys.readouterr().out
    assert "octave_v7.mat: MAT, 7 column(s)" in out
    assert any(line.split()[:3] == ["theta1", "-", "1024"] and "angle_driver" in line for line in out.splitlines())
    assert run_command_line(["convert", MAT, "--show", "--json"]) == 0
    assert {one["name"] for one in json.loads(capsys.readouterr().out)} == {
        "t",
        "M1",
        "M2",
        "theta1",
        "theta2",
        "y1",
        "y2",
    }


def test_map_to_record_to_every_command(capsys: Capture, tmp_path: Path) -> None:
    assert run_command_line(["convert", MAT, "m.nc", "--map", MAP]) == 0
    assert "1 realisation(s) of 1 period(s) of 1024 samples at 2048 Hz, mesh 20 Hz" in capsys.readouterr().out
    arguments = ["--harmonics", "2", "--order", "1", "--window", "8", "--band-hz", "200", "400"]
    assert run_command_line(["identify", "m.nc", "--out", "frf.nc", *arguments]) == 0
    assert run_command_line(["compare", "m.nc", "m.nc", "--out", "out_c"]) == 0
    assert (tmp_path / "out_c" / "dte.png").stat().st_size > 1000


def test_a_guess_with_assumptions_is_shown_and_needs_yes(capsys: Capture, tmp_path: Path) -> None:
    assert run_command_line(["convert", MAT, "m.nc", *RIG]) == 2
    err = capsys.readouterr().err
    assert "assumed: M1 is taken as torque_driver" in err and "confirm it with --yes" in err
    assert not (tmp_path / "m.nc").exists()
    assert run_command_line(["convert", MAT, "m.nc", *RIG, "--yes"]) == 0
    found, given = gb.read_record("m.nc"), gb.convert(MAT, MAP)
    for name in given.data_vars:
        np.testing.assert_array_equal(found[name], given[name])


def test_yes_does_not_make_up_what_is_missing(capsys: Capture, tmp_path: Path) -> None:
    assert run_command_line(["convert", MAT, "m.nc", "--yes"]) == 2
    sentence = said(capsys)
    assert "lacks samples_per_period" in sentence and "base_radius_driver_mm" in sentence
    assert not (tmp_path / "m.nc").exists()


def test_a_guess_without_doubt_is_used_at_once() -> None:
    table = np.loadtxt(OCTAVE / "measurement.csv", delimiter=",", skiprows=1)
    head = "time [s],driver torque [Nm],driven torque [Nm],driver angle [rad],driven angle [rad]"
    np.savetxt("m.csv", table[:, :5], delimiter=",", header=head, comments="", fmt="%.17g")
    assert run_command_line(["convert", "m.csv", "m.nc", *RIG]) == 0
    np.testing.assert_array_equal(gb.read_record("m.nc")["angle_driver"].values[0], table[:, 3])


def test_written_map_is_completed_and_given(capsys: Capture, tmp_path: Path) -> None:
    assert run_command_line(["convert", MAT, "--write-map", "map.toml"]) == 0
    text = (tmp_path / "map.toml").read_text()
    assert "# missing: teeth_driver" in text and 'column = "theta1"' in text
    assert run_command_line(["convert", MAT, "m.nc", "--map", "map.toml"]) == 2
    assert run_command_line(["convert", MAT, "m.nc", "--map", "map.toml", *RIG]) == 0


def test_runs_as_records(tmp_path: Path) -> None:
    table = np.loadtxt(OCTAVE / "measurement.csv", delimiter=",", skiprows=1)
    columns = [
        ("M1", "N m", 1),
        ("M2", "N m", 2),
        ("theta1", "rad", 3),
        ("theta2", "rad", 4),
        ("y1", "m", 5),
        ("y2", "m", 6),
    ]
    sets = [dataset_58(name, table[:, n] + (run if n == 1 else 0), unit, rate=2048.0) for run in range(2)
            for name, unit, n in columns]  # fmt: skip
    write_uff(tmp_path / "m.uff", *sets)
    (tmp_path / "map.toml").write_text((OCTAVE / "map.toml").read_text().replace('time = "t"\n', ""))
    assert run_command_line(["convert", "m.uff", "m.nc", "--map", "map.toml", "--runs", "records"]) == 0
    first, second = gb.read_record("m-1.nc"), gb.read_record("m-2.nc")
    np.testing.assert_allclose(second["torque_driver"] - first["torque_driver"], 1.0)
    assert first.attrs["sampling_rate"] == 2048.0  # the file prints 1 / 2048 with six digits
    assert "prints its sampling rate with few digits" in first.attrs["warnings"]
    assert not (tmp_path / "m.nc").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([MAT], "OUT is missing"),
        ([MAT, "m.mat"], "must end in .nc"),
        (["none.mat", "m.nc"], "none.mat does not exist"),
        ([MAT, "m.nc", "--map", "none.toml"], "none.toml does not exist"),
        ([MAT, "m.nc", "--map", MAP, "--rig", "gap_demo", "--condition", "cold"], "condition 'cold' is none of"),
        ([MAT, "m.nc", "--condition", "cold"], "give --rig CASE too"),
        ([MAT, "--write-map", "map.txt"], "must end in .toml"),
        ([".", "m.nc"], "is no ordinary file"),
        ([str(OCTAVE / "octave_text.mat"), "m.nc"], "save it with -v7"),
    ],
)
def test_refusals_exit_2_and_write_nothing(arguments: list[str], words: str, capsys: Capture, tmp_path: Path) -> None:
    assert run_command_line(["convert", *arguments]) == 2
    assert words in said(capsys)
    assert list(tmp_path.iterdir()) == []
