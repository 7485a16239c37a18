"""What `check --diagnosis` prints, writes and draws of a plan."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gearbench.cases import case_files
from gearbench.cli import run_command_line
from gearbench.diagnosis.planning import plan as job
from gearbench.diagnosis.planning.added import larger_plans
from gearbench.diagnosis.planning.plan import Plan
from gearbench.diagnosis.planning.row import LONGER, Cost, Row
from gearbench.diagnosis.planning.worth import said_of, sentence_of_more
from gearbench.rig import read_case
from gearbench.words.plan import plan_data, plan_lines


def row(effect: str, on: tuple[str, ...] = (), **other: object) -> Row:
    values = {
        "effect": effect, "name": " ".join((effect, *on)), "place": "mesh", "on": on, "parameter": "coefficient",
        "unit": "1", "found": 0.02, "std": 0.001, "good": 0.004, "largest": 0.6, "apart": 0.02, "best": 0.019,
        "over_good": 5.0, "over_best": 1.05,
    }  # fmt: skip
    return Row(**(values | other))  # type: ignore[arg-type]


ROWS = (
    row("backlash", found=None, over_good=None, best=None, over_best=None, parameter="more", unit="um"),
    row(
        "friction",
        costs={
            "record fast": Cost(None, 3.0),
            "y_driver": Cost(1.0, 2.5),
            "y_driven": Cost(1.0, 1.0),
            LONGER: Cost(0.5, 0.6),
        },
    ),
    row("encoder-runout", ("driver",), rivals=("eccentricity",), apart=None, parameter="driver.encoder_runout"),
)
PLAN = Plan("rig", 0.1, ("base", "fast"), ("light",), "held-out", ROWS, (), ("Add a record.",))


def test_every_effect_has_a_line() -> None:
    first, head, *lines = plan_lines(PLAN)
    assert "base, fast (flanks part in light), judged on held-out; 10 %" in first and "found from" in head
    assert lines[0].endswith("not found") and "backlash" in lines[0]
    assert "0.0200" in lines[1] and "0.00400" in lines[1]
    assert "run-out of an encoder (driver)" in lines[2] and "not told from run-out of a gear" in lines[2]
    assert lines[3] == "advice: Add a record."


def test_sentences_say_what_each_part_carries() -> None:
    said = said_of(ROWS, (("eccentricity", "encoder-runout"),), ("light",), "held-out")
    assert any("cannot tell run-out of a gear and run-out of an encoder apart" in one for one in said)
    assert any("Flanks part in light but not in held-out" in one for one in said)
    assert any("Without record fast" in one and "friction between the flanks (not at all)" in one for one in said)
    assert any("displacement of the driver" in one and "2.5 times" in one for one in said)
    assert any("Leaving out the displacement of the driven gear would cost nothing" in one for one in said)
    assert any(LONGER in one for one in said)
    assert any("stay together in every record" in one for one in said_of(ROWS, (), (), "held-out"))


def test_the_command_prints_writes_and_draws(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(job, "plan_of", lambda case, report: PLAN)
    picture = tmp_path / "plan.png"
    assert run_command_line(["check", "gap_demo", "--diagnosis", "--figure", str(picture)]) == 0
    assert "advice: Add a record." in capsys.readouterr().out
    assert picture.stat().st_size > 1000
    assert run_command_line(["check", "gap_demo", "--diagnosis", "--json"]) == 0
    tree = json.loads(capsys.readouterr().out)
    assert tree == json.loads(json.dumps(plan_data(PLAN))) and tree["rows"][1]["costs"]["record fast"]["size"] is None


def test_a_picture_alone_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run_command_line(["check", "gap_demo", "--figure", str(tmp_path / "plan.png")]) == 2
    assert "--diagnosis" in capsys.readouterr().err


def test_what_one_more_record_brings_is_said() -> None:
    said = sentence_of_more("at half", {"friction": float("inf"), "a crack": 1.1}, [("friction", "tooth-crack")])
    assert said == (
        "A further record at half would find smaller sizes of friction (at all) and tell friction between the flanks"
        " from a cracked tooth."
    )
    assert sentence_of_more("at half", {"a crack": 1.1}, []) == ""


def test_a_larger_plan_has_one_more_record_of_whole_hunting_periods() -> None:
    case = read_case(case_files()["gap_demo"])
    plans = larger_plans(case)
    for larger in plans.values():
        names = [one.name for one in larger.conditions]
        assert names[0] == case.conditions[0].name and names[2:] == [one.name for one in case.conditions[1:]]
        added = larger.conditions[1].experiment
        assert added.samples_per_period and added.mesh_frequency
        cycles = added.samples_per_period * added.mesh_frequency / added.sampling_rate
        assert cycles == pytest.approx(60.0, rel=1e-12)
    torques = [larger.conditions[1].experiment.torque_mean for larger in plans.values()]
    assert torques == [50.0, 100.0]
    assert larger_plans(case.model_copy(update={"experiment": case.experiment.model_copy(update={"multisine": None}),
                                                "conditions": ()})) == {}  # fmt: skip
