"""What `doctor` says of machines that lack something: each cause made, none of them looked up in the code."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from gearbench import doctor
from gearbench.cli import run_command_line
from gearbench.doctor import Finding
from gearbench.figures.gears import stress_scene
from gearbench.kernels import trust


def test_this_machine_can_run_what_the_tests_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(stress_scene, "can_render", lambda: False)  # its own test draws; it takes seconds
    assert run_command_line(["doctor", "--json"]) == 0
    said = {one["name"]: one for one in json.loads(capsys.readouterr().out)}
    assert {said[name]["state"] for name in ("python", "packages", "gmsh")} == {"good"}
    assert said["drawing"]["state"] == "note" and "matplotlib" in said["drawing"]["sentence"]


def test_what_is_missing_exits_2(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    findings = [Finding("a", "good", "A."), Finding("b", "note", "B is slow."), Finding("c", "missing", "No C.")]
    monkeypatch.setattr(doctor, "examine", lambda: findings)
    assert run_command_line(["doctor"]) == 2
    out = capsys.readouterr().out
    assert out.splitlines()[2] == "missing  No C." and out.endswith("Missing: c.\n")
    monkeypatch.setattr(doctor, "examine", lambda: findings[:2])
    assert run_command_line(["doctor"]) == 0


def test_old_python() -> None:
    assert doctor.python((3, 10, 13)).state == "missing"
    assert doctor.python((3, 11, 0)).state == "good"


def test_library_that_gmsh_lacks_is_named() -> None:
    words = "import sys; sys.exit('OSError: libGLU.so.1: cannot open shared object file: No such file')"
    found = doctor.mesher((sys.executable, "-c", words))
    assert found.state == "missing" and "libGLU.so.1 is absent" in found.sentence and "libglu1-mesa" in found.sentence
    killed = doctor.mesher((sys.executable, "-c", "import os; os.abort()"))
    assert killed.state == "missing" and "ended with -6" in killed.sentence


@pytest.mark.parametrize(("kilobytes", "state"), [(500_000, "missing"), (3_000_000, "note"), (8_000_000, "good")])
def test_memory(tmp_path: Path, kilobytes: int, state: str) -> None:
    table = tmp_path / "meminfo"
    table.write_text(f"MemTotal: 9 kB\nMemAvailable:   {kilobytes} kB\n", encoding="utf-8")
    assert doctor.memory(table).state == state
    assert doctor.memory(tmp_path / "none").state == "note"


def test_other_versions_are_named(tmp_path: Path) -> None:
    file = tmp_path / "constraints.txt"
    file.write_text("numpy==0.1\nnot-installed-anywhere==3\n", encoding="utf-8")
    found = doctor.pins(file)
    assert found.state == "note" and "(tested: 0.1)" in found.sentence and "anywhere" not in found.sentence
    assert doctor.pins(tmp_path / "none").state == "note"


def test_cache_that_all_can_write_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path / "own"))
    trust.trusted.cache_clear()
    assert doctor.cache().state == "good"
    (tmp_path / "own" / "machine code").write_bytes(bytes(3 * 2**20))
    assert "holds 3 MiB" in doctor.cache().sentence
    # pytest's folder lies where only its owner enters, so that nobody else could write: let it seem open to all.
    monkeypatch.setattr(trust.stat, "S_IXOTH", 0o777)
    (tmp_path / "own").chmod(0o777)
    trust.trusted.cache_clear()
    found = doctor.cache()
    assert found.state == "missing" and "writable by all" in found.sentence
    trust.trusted.cache_clear()


def test_full_or_foreign_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor.disk("disk", tmp_path).state == "good"
    usage = type("Usage", (), {"free": 2**29})
    monkeypatch.setattr(doctor.shutil, "disk_usage", lambda folder: usage)
    sentence = f"0.50 GiB are free in {tmp_path}; 1 are needed."
    assert doctor.disk("disk", tmp_path) == Finding("disk", "missing", sentence)
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert doctor.disk("disk", tmp_path).sentence == f"{tmp_path} cannot be written."


def test_programs_that_are_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert {finding.state for finding in doctor.programs()} == {"note"}
    (tmp_path / "ffmpeg").write_text("#!/bin/sh\n", encoding="utf-8")
    (tmp_path / "ffmpeg").chmod(0o755)
    assert [finding.name for finding in doctor.programs() if finding.state == "good"] == ["ffmpeg"]
