"""`campaign`: members, table and report of a study; resuming, refusing, and what may be wrong with the words."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from shared.members_here import members_here
from shared.pages import fetched

import gearbench as gb
from gearbench.bench import static
from gearbench.bench.study.member import Found, Task, compute
from gearbench.cases import case_path
from gearbench.cli import run_command_line
from gearbench.records.provenance import source_digest
from gearbench.rig import dump_case, read_case
from gearbench.shell.progress import Silent

WIDTH, TEETH = "rig.driver.face_width_mm", "rig.driven.teeth"
GRID = ["--vary", f"{WIDTH}=10:20:3", "--vary", f"{TEETH}=62,3"]
STUDY = ["campaign", "quick_lumped", *GRID, "--of", "te-mean,iso-c-gamma"]


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "study.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Members in this process and no pictures, where starting one and drawing are not what is tested."""
    members_here(monkeypatch)
    for name in ("scatter", "tornado"):
        target = f"gearbench.figures.studies.study.draw_{name}"
        monkeypatch.setattr(target, lambda *held: held[-1].write_text("<svg></svg>"))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "out"
    assert run_command_line([*STUDY, "--workers", "1", "--out", str(folder)]) == 0
    return folder


def test_members_are_what_the_commands_for_their_cases_give(done: Path) -> None:
    for row in rows(done):
        if row[TEETH] == "3":
            assert row["te_mean_um"] == "" and row["sentence"] == "rig.driven.teeth = 3 must be at least 5"
            continue
        case = read_case(case_path("quick_lumped"), [f"{WIDTH}={row[WIDTH]}"])
        assert float(row["te_mean_um"]) == 1e6 * float(static(case)["transmission_error"].mean())


def test_the_table_has_units_and_both_forms_agree(done: Path) -> None:
    table = xr.load_dataset(done / "study.nc", engine="h5netcdf", decode_cf=False)
    assert table.attrs["schema"] == "gearbench-study/1"
    assert {name: table[name].attrs["units"] for name in (WIDTH, TEETH, "te_mean_um", "iso_c_gamma_n_per_mm_um")} == {
        WIDTH: "mm", TEETH: "1", "te_mean_um": "um", "iso_c_gamma_n_per_mm_um": "N/(mm um)",
    }  # fmt: skip
    held = [float(row["te_mean_um"] or "nan") for row in rows(done)]
    np.testing.assert_array_equal(table["te_mean_um"].values, held)


def test_every_member_has_its_folder_and_provenance(done: Path) -> None:
    folders = sorted((done / "members").iterdir())
    assert [folder.name for folder in folders] == [f"{number:04d}" for number in range(6)]
    data = json.loads((folders[2] / "result.json").read_text(encoding="utf-8"))
    assert data["values"] == {WIDTH: "15.0", TEETH: "62"}
    about = data["provenance"]
    assert about["sources"] == source_digest() and about["seed"] == 0 and about["settings"]["ask"][0] == [
        "te-mean",
        "iso-c-gamma",
    ]
    case = read_case(folders[2] / "case.toml")
    assert case.rig.driver.face_width == 0.015 and case.study is None and dump_case(case) == about["case"]
    assert not (folders[1] / "case.toml").exists()  # it has no case


def test_the_page_answers_first_and_says_what_failed(done: Path) -> None:
    page = (done / "report.html").read_text(encoding="utf-8")
    order = [page.index(words) for words in ("<h1>Mean static transmission error", "<svg", "Members without a result")]
    assert order == sorted(order)
    assert "3 x rig.driven.teeth = 3 must be at least 5" in page and source_digest()[:16] in page
    assert fetched(page) == []
    assert all((done / name).read_bytes().startswith(b"\x89PNG") for name in ("scatter.png", "tornado.png"))


def test_a_second_time_nothing_is_computed(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearbench.bench.study.processes.compute_here", None)
    before = {path: path.stat().st_mtime_ns for path in done.rglob("*") if path.is_file()}
    assert run_command_line([*STUDY, "--out", str(done)]) == 0
    assert {path: path.stat().st_mtime_ns for path in done.rglob("*") if path.is_file()} == before


@pytest.mark.usefixtures("here")
def test_a_damaged_member_is_computed_again(done: Path) -> None:
    table = (done / "study.csv").read_bytes()
    one = done / "members" / "0002" / "result.json"
    whole = one.read_text(encoding="utf-8")
    one.write_text(whole.replace('"te_mean_um": 1', '"te_mean_um": 2'), encoding="utf-8")
    (done / "members" / "0004" / "result.json").write_text(whole[:40], encoding="utf-8")
    assert run_command_line([*STUDY, "--workers", "1", "--out", str(done)]) == 0
    assert (done / "study.csv").read_bytes() == table
    assert json.loads(one.read_text(encoding="utf-8"))["numbers"] == json.loads(whole)["numbers"]


def test_another_studys_folder_is_refused(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line([*STUDY, "--set", "experiment.torque_mean_nm=100", "--out", str(done)]) == 2
    assert "add --force" in capsys.readouterr().err


@pytest.mark.validation  # 15 s of processor time: three starts of everything
def test_what_is_killed_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    many = ["campaign", "quick_lumped", "--vary", f"{WIDTH}=10:20:100", "--of", "te-mean", "--workers", "1"]
    folder = tmp_path / "out"
    command = [sys.executable, "-P", "-m", "gearbench", *many, "--out", str(folder)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
    until = time.monotonic() + 120
    while len(list(folder.glob("members/*/result.json"))) < 3 and time.monotonic() < until:
        time.sleep(0.002)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    kept = {path: path.read_bytes() for path in folder.glob("members/*/result.json")}
    assert 3 <= len(kept) < 100 and not (folder / "study.csv").exists()
    assert run_command_line([*many, "--out", str(folder)]) == 0
    assert all(path.read_bytes() == held for path, held in kept.items())
    assert run_command_line([*many, "--out", str(tmp_path / "whole")]) == 0
    for name in ("study.csv", "effects.csv"):
        assert (folder / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.usefixtures("here")
def test_what_is_interrupted_goes_on_to_the_same_bytes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    class Impatient(Silent):
        def __call__(self, fraction: float, note: str = "") -> None:
            if note.startswith("3 of 6"):
                raise KeyboardInterrupt

    study = {"vary": [f"{WIDTH}=10:20:6"], "of": ["te-mean"], "sample": "grid"}
    with pytest.raises(KeyboardInterrupt):
        gb.campaign("quick_lumped", tmp_path / "out", **study, progress=Impatient())
    assert "goes on from there" in capsys.readouterr().err
    assert len(list((tmp_path / "out").glob("members/*/result.json"))) == 3
    for name in ("out", "whole"):
        gb.campaign("quick_lumped", tmp_path / name, **study)
    for name in ("study.csv", "effects.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.usefixtures("here")
def test_the_cases_own_study_is_used_and_options_stand_above_it(tmp_path: Path) -> None:
    text = dump_case(read_case(case_path("quick_lumped")))
    own = f'[study]\nvary = ["{WIDTH}=normal(20,1)"]\nof = ["te-mean"]\nsample = "lhs"\nsize = 4\ntorque_nm = 50.0\n'
    (tmp_path / "own.toml").write_text(f"{text}\n{own}", encoding="utf-8")
    study = ["campaign", str(tmp_path / "own.toml"), "--size", "6"]
    assert run_command_line([*study, "--out", str(tmp_path / "out")]) == 0
    table = xr.load_dataset(tmp_path / "out" / "study.nc", engine="h5netcdf", decode_cf=False)
    assert table.sizes["member"] == 6 and table.attrs["sample"] == "lhs"
    # Twice the load of 25 N m and the width of 20 mm: the lumped mesh is linear in both but for the fillet.
    assert float(table["te_mean_um"].mean()) == pytest.approx(8.3097 / 4, rel=0.02)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "nothing varies: give --vary"),
        (["--vary", "rig.driver.face_wdth_mm=1,2"], "did you mean face_width_mm"),
        (["--vary", f"{WIDTH}"], "must read KEY=V1,V2"),
        (["--vary", f"{WIDTH}=1:2"], "add --sample"),
        (["--vary", f"{WIDTH}=1,2", "--vary", f"{WIDTH}=3,4"], "twice"),
        (["--vary", f"{WIDTH}=1,2", "--of", "kv"], "is not a result that a study knows"),
        (["--vary", f"{WIDTH}=1:2", "--sample", "sobol", "--size", "20"], "must be a power of 2"),
        (["--vary", f"{WIDTH}=1,2", "--cluster", "here"], "tcp://HOST:PORT"),
    ],
)
def test_what_is_wrong_is_said_before_a_folder_is_made(
    arguments: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["campaign", "quick_lumped", *arguments, "--out", str(tmp_path / "out")]) == 2
    assert sentence in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("here")
def test_a_member_whose_process_died_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def dying(tasks: Iterable[Task], workers: int) -> Iterator[Found]:
        for task in tasks:
            yield compute(task) if task.number else Found(0, {}, "the process that computed this member was killed")

    study = ["campaign", "quick_lumped", "--vary", f"{WIDTH}=10,20", "--of", "te-mean", "--out", str(tmp_path / "out")]
    with monkeypatch.context() as patched:
        patched.setattr("gearbench.bench.study.processes.compute_here", dying)
        assert run_command_line(study) == 0
    assert [bool(row["sentence"]) for row in rows(tmp_path / "out")] == [True, False]
    assert run_command_line(study) == 0
    assert [bool(row["te_mean_um"]) for row in rows(tmp_path / "out")] == [True, True]


def test_a_study_in_which_everything_fails_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run_command_line(["campaign", "quick_lumped", "--vary", f"{TEETH}=2,3", "--out", str(out)]) == 2
    assert "no member has a result: rig.driven.teeth = 2" in capsys.readouterr().err
    assert len(rows(out)) == 2 and (out / "report.html").exists()
