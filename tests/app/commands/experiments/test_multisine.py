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


def test_the_identification_is_that_of_the_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """quick_lumped prescribes 40, 2, 8; order and window are the local method's, and another method chooses its own."""
    asked = []

    def design(case: object, settings: gb.IdentificationSettings, **_: object) -> None:
        asked.append((settings.method, settings.harmonics, settings.order, settings.window))
        raise BenchError("enough")

    monkeypatch.setattr("gearbench.bench.design.design", design)
    own = ["--set", 'identification.method="mesh-feedback"']
    free = ["--set", "identification.harmonics=0", "--set", "identification.window=5"]
    for more in ([], free, own, [*own, "--method", "lpm"], ["--method", "mesh-feedback"]):
        assert run_command_line(["multisine", "quick_lumped", *more]) == 2
    assert asked == [
        ("lpm", 40, 2, 8),
        ("lpm", None, 2, 5),
        ("mesh-feedback", 40, None, None),
        ("lpm", None, None, None),
        ("mesh-feedback", None, None, None),
    ]


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ((3, 1, 40), ["not enough, 14 unknowns", "the width of its windows", "over 324 Hz beside"]),
        ((40, 2, 8), ["not possible", "harmonics = 40 puts sidebands of 1500 Hz", "at most 16 fit"]),
    ],
)
def test_whether_prescribed_numbers_are_enough(
    numbers: tuple[int, int, int], said: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    keys = zip(("harmonics", "order", "window"), numbers, strict=True)
    given = [word for key, value in keys for word in ("--set", f"identification.{key}={value}")]
    command = ["multisine", "quick_lumped", "--band-hz", "1100", "1500", *SETTINGS]
    assert run_command_line([*command, "--set", "experiment.realisations=2", *given]) == 0
    out = capsys.readouterr().out
    (line,) = [line for line in out.splitlines() if line.startswith("prescribed")]
    for words in said:
        assert words in line


def test_prescribed_numbers_that_are_enough(capsys: pytest.CaptureFixture[str]) -> None:
    """40 realisations of 20 Hz mesh, as shipped."""
    assert run_command_line(["multisine", "quick_lumped", "--band-hz", "1100", "1500"]) == 0
    assert "prescribed L = 40, R = 2, n = 8: enough, 243 unknowns from" in capsys.readouterr().out


def test_a_case_without_multisine_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["multisine", "rig_62"]) == 2
    assert "no experiment.multisine: there is nothing to plan" in capsys.readouterr().err
