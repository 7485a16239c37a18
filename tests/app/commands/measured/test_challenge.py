"""`challenge make` and `challenge score` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shared.truth_plants import STIFFNESS, short_case

from gearbench.challenge.making import cases as making
from gearbench.cli import run_command_line
from gearbench.commands.measured.challenge import read
from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.verdict import Effect, Parameter, Probabilities, Verdict
from gearbench.diagnosis.verdict_file import write_verdict
from gearbench.rig import dump_case

FRICTION = Verdict(
    verdict="effects",
    probability=Probabilities(effect=0.9, none=0.05, unknown=0.05),
    effects=(
        Effect(name="friction", probability=0.9, parameters={"coefficient": Parameter(value=0.05, std=0.01, unit="1")}),
    ),
    place="mesh",
)
NONE = Verdict(verdict="none", probability=Probabilities(effect=0.1, none=0.8, unknown=0.1), place="none")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("challenge")
    (folder / "rig.toml").write_text(dump_case(short_case()), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "nominal_stiffness", lambda nominal: STIFFNESS)
        assert run_command_line(make(folder, "cases", "answers.json")) == 0
    return folder


def make(folder: Path, out: str, answers: str, *more: str) -> list[str]:
    mix = ["--mix", "controls=1,per-effect=0,foreign=0,pairs=1"]
    rig = ["--rig", str(folder / "rig.toml"), "--out", str(folder / out), "--answers", str(folder / answers)]
    return ["challenge", "make", *mix, *rig, "--seed", "5", *more]


def score(folder: Path, *more: str) -> int:
    return run_command_line(
        ["challenge", "score", str(folder / "cases"), "--answers", str(folder / "answers.json"), *more]
    )


def test_verdicts_that_are_there_are_scored(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answers = json.loads((made / "answers.json").read_text(encoding="utf-8"))
    for name, answer in answers.items():
        write_verdict(NONE if answer["kind"] == "none" else FRICTION, made / "cases" / name / "verdict.json")
    capsys.readouterr()
    assert score(made, "--json") == 0
    table = json.loads(capsys.readouterr().out)
    assert table["cases"] == {"effect": 1, "none": 1, "foreign": 0}
    assert table["none"]["right"]["count"] == 1
    assert {name: o["result"] for name, o in table["outcomes"].items()} == {
        name: "right" if answer["kind"] == "none" else "part" if "friction" in answer["effects"] else "wrong"
        for name, answer in answers.items()
    }
    assert score(made) == 0
    assert "1 of 1, 100 %" in capsys.readouterr().out


def test_a_bad_verdict_is_one_sentence(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = sorted(path.name for path in (made / "cases").iterdir())[0]
    path = made / "cases" / name / "verdict.json"
    path.write_text('{"schema": "other"}', encoding="utf-8")
    with pytest.raises(DiagnosisError, match="schema"):
        read(path)
    assert score(made) == 2
    assert capsys.readouterr().err.strip().count("\n") <= 1


@pytest.mark.parametrize(
    ("out", "answers", "more", "words"),
    [
        ("a", "a/answers.json", (), "lies inside --out"),
        ("a", "b.json", ("--family", "tset"), "families are"),
        ("a", "b.json", ("--mix", "controls=x"), "whole number"),
    ],
)
def test_bad_input_exits_with_two(
    made: Path, out: str, answers: str, more: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(make(made, out, answers, *more)) == 2
    assert words in capsys.readouterr().err
    assert not (made / out).exists()
