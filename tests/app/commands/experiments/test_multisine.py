"""`multisine`: what it prints and what it refuses."""

from __future__ import annotations

import json

import pytest

import gearbench as gb
from gearbench.bench import BenchError
from gearbench.cli import run_command_line

FAST = (
    "experiment.realisations=1",
    "experiment.mesh_frequency_hz=400",
    "experiment.samples_per_period=4096",
    "experiment.multisine.band_hz=[4,3000]",
)
SETTINGS = [word for setting in FAST for word in ("--set", setting)]


def test_the_plan_is_printed_with_advice(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["multisine", "quick_lumped", "--band-hz", "900", "1800", *SETTINGS]) == 0
    out = capsys.readouterr().out
    assert "excitation: 750 lines 4 Hz apart in 4-3000 Hz, 50 N m peak" in out
    assert "mesh: 400 Hz; first mode 1239-1349 Hz" in out
    assert "would err by" in out and "and expect of itself" in out
    assert "advice: the multisine would unload the mesh" in out


def test_numbers_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["multisine", "quick_lumped", "--band-hz", "900", "1800", "--snr-db", "20", "--json", *SETTINGS]
    assert run_command_line(command) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["snr_db"] == 20.0 and found["lines"] == 750
    assert 0.5 < found["expected"] / found["actual"] < 2.0


def test_the_estimator_is_that_of_the_case(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def design(case: object, settings: gb.IdentificationSettings, **_: object) -> None:
        asked.append(settings.method)
        raise BenchError("enough")

    monkeypatch.setattr("gearbench.bench.design.design", design)
    own = ["--set", 'identification.method="mesh-feedback"']
    for more in ([], own, [*own, "--method", "lpm"]):
        assert run_command_line(["multisine", "quick_lumped", *more]) == 2
    assert asked == ["lpm", "mesh-feedback", "lpm"]


def test_a_case_without_multisine_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["multisine", "rig_62"]) == 2
    assert "no experiment.multisine: there is nothing to plan" in capsys.readouterr().err
