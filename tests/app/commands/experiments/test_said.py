"""What `simulate` says of its record, and what `run` refuses before it begins."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearbench.bench.plan import memory
from gearbench.cli import run_command_line

LIGHT = {
    "experiment.realisations": "1",
    "experiment.samples_per_period": "4096",
    "experiment.torque_mean_nm": "30",
    "rig.mesh.stiffness_scale": "1.001",
}


def settings() -> list[str]:
    return [part for key, value in LIGHT.items() for part in ("--set", f"{key}={value}")]


def test_simulate_prints_the_warnings_of_its_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["simulate", "quick_lumped", "--out", str(tmp_path / "a.nc"), *settings()]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(str(tmp_path / "a.nc"))
    assert lines[1].startswith("warning: the teeth are out of contact in ")


def test_a_record_that_cannot_be_read_as_a_whole_is_refused_before_a_folder_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "memory_free", lambda: 100_000)
    out = tmp_path / "out"
    assert run_command_line(["run", "quick_lumped", "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "the record takes about 0.0262 GB, and is identified as a whole: 0.0001 GB of memory are free" in said
    assert not out.exists()
