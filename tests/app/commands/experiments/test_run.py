"""`run` on a small lumped case: products, summary, resuming, refusing; then identify and compare on what it left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from shared.examples import failures
from shared.pages import fetched

import gearbench as gb
from gearbench.cli import run_command_line
from gearbench.figures import plotting
from gearbench.rig import read_case

# The case of the example in the docstring of `run`.
SMALL = {
    "experiment.realisations": "4",
    "experiment.samples_per_period": "4096",
    "experiment.multisine.band_hz": "[900, 1500]",
    "identification.band_hz": "[1000, 1500]",
    "identification.harmonics": "8",
    "identification.order": "1",
    "identification.window": "8",
}
PICTURES = {
    "gears.png", "transmission_error.png", "stiffness.png", "record.png", "spectrum.png", "itf.png",
    "natural_frequency.png",
}  # fmt: skip
PICTURES |= {"uncertainty.png", "htf.png", "quality.png", "orders.png"}
DATA = {"record.nc", "static.nc", "frf.nc", "exact.nc", "frozen.nc"}


def small(**more: str) -> list[str]:
    settings = SMALL | {key.replace("__", "."): value for key, value in more.items()}
    return [part for key, value in settings.items() for part in ("--set", f"{key}={value}")]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "out_first"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(plotting._STYLE, "figure.dpi", 40)  # a tenth of the dots to draw
        assert run_command_line(["run", "quick_lumped", "--out", str(folder), *small()]) == 0
    return folder


def test_all_products_are_there_and_whole(done: Path) -> None:
    names = {path.name for path in done.iterdir()}
    assert names == PICTURES | DATA | {"case.toml", "summary.md", "summary.json", "run.json", "report.html"}
    assert all((done / name).read_bytes().startswith(b"\x89PNG") for name in PICTURES)
    assert read_case(done / "case.toml").experiment.realisations == 4
    record = xr.load_dataset(done / "record.nc", engine="h5netcdf", decode_cf=False)
    assert record.attrs["schema"] == "gearbench-record/1"
    for kind, name in (("identified", "frf.nc"), ("exact", "exact.nc"), ("frozen", "frozen.nc")):
        frf = xr.load_dataset(done / name, engine="h5netcdf", decode_cf=False)
        assert (frf.attrs["schema"], frf.attrs["kind"]) == ("gearbench-frf/1", kind)


def test_the_example_in_python_is_the_same_run(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The case that its keys make is this one, or the folder would be refused; its numbers are those."""
    monkeypatch.chdir(done.parent)
    before = (done / "run.json").read_bytes()
    assert failures(gb.run, "run") == (0, True)
    assert done.name in str(gb.run.__doc__) and (done / "run.json").read_bytes() == before


def test_summary_opens_with_the_answers_and_accounts_for_them(done: Path) -> None:
    text = (done / "summary.md").read_text(encoding="utf-8")
    numbers = json.loads((done / "summary.json").read_text(encoding="utf-8"))
    lines = text.splitlines()
    assert lines[0].startswith("Peak-to-peak TE: ") and " um" in lines[0]
    assert lines[1].startswith("TE mesh orders 1-3: ") and lines[1].count(",") == 2
    assert lines[2].startswith("First mode: ") and " Hz" in lines[2]
    for word in ("unknowns", "equations", "Expected error", "exact ITF"):
        assert word in text
    # The static TE is F / k(phase): its size follows from the stiffness.
    low, high = numbers["stiffness_n_per_um"]
    force = 200.0 / (0.062 * np.cos(np.radians(20)))
    assert numbers["te_peak_to_peak_um"] == pytest.approx(force / low - force / high, rel=1e-6)
    assert numbers["first_mode_fewest_pairs_hz"] < numbers["first_mode_most_pairs_hz"]
    # What the identification expects of itself is of the size of what it is measured to err by.
    expected, measured = numbers["identification"]["expected_error"], numbers["itf_error_against_exact"]
    assert 0.3 * measured < expected < 3 * measured
    for name in PICTURES | DATA:
        assert name in text


def test_same_case_resumes_and_another_is_refused(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = {name: (done / name).stat().st_mtime_ns for name in DATA | PICTURES}
    (done / "static.nc").unlink()
    assert run_command_line(["run", "quick_lumped", "--out", str(done), *small(), "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["case"] == "quick_lumped"
    assert "record.nc" not in captured.err and "static.nc: done" in captured.err
    kept = {name: (done / name).stat().st_mtime_ns for name in DATA | PICTURES}
    assert {name for name in kept if kept[name] != before[name]} == {"static.nc"}
    other = small(experiment__seed="2")
    assert run_command_line(["run", "quick_lumped", "--out", str(done), *other]) == 2
    assert "another case" in capsys.readouterr().err
    assert {name: (done / name).stat().st_mtime_ns for name in DATA | PICTURES} == kept


def test_the_report_holds_the_answers_and_is_made_again_from_the_products(done: Path) -> None:
    page = (done / "report.html").read_text(encoding="utf-8")
    numbers = json.loads((done / "summary.json").read_text(encoding="utf-8"))
    assert fetched(page) == []
    answer = page[page.index("<h1>") : page.index("<figure")]
    low, high = numbers["first_mode_hz"]
    for words in (f"{numbers['te_peak_to_peak_um']:.4g} um", f"{low:.0f}-{high:.0f} Hz", "expected to err by"):
        assert words in answer
    assert page.count('<figure class="live"') == 6 and page.count("<img ") == 7
    for name, digest in json.loads((done / "run.json").read_text(encoding="utf-8"))["files"].items():
        assert name.startswith(("report", "summary")) or digest[:16] in page, name
    before = {name: (done / name).stat().st_mtime_ns for name in DATA | PICTURES}
    (done / "report.html").write_text(page[:5000], encoding="utf-8")  # as a full disk would leave it
    assert run_command_line(["run", "quick_lumped", "--out", str(done), *small()]) == 0
    assert (done / "report.html").read_text(encoding="utf-8") == page
    assert {name: (done / name).stat().st_mtime_ns for name in DATA | PICTURES} == before


def test_identify_gives_what_the_run_gave(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "frf.nc"
    arguments = ["identify", str(done / "record.nc"), "--out", str(out), "--band-hz", "1000", "1500", "--json"]
    arguments += ["--harmonics", "8", "--order", "1", "--window", "8"]
    assert run_command_line(arguments) == 0
    assert json.loads(capsys.readouterr().out)["unknowns"] == 34  # (2 x 8 + 1) branches x 2 coefficients
    one, two = (xr.load_dataset(path, engine="h5netcdf", decode_cf=False) for path in (out, done / "frf.nc"))
    assert np.array_equal(one["itf_re"], two["itf_re"])


def test_identify_refuses_in_one_sentence(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record, out = str(done / "record.nc"), str(tmp_path / "frf.nc")
    broken = tmp_path / "broken.nc"
    broken.write_bytes((done / "record.nc").read_bytes()[:5000])
    for arguments, word in (
        (["identify", str(broken), "--out", out], "truncated"),
        (["identify", str(tmp_path / "none.nc"), "--out", out], "does not exist"),
        (["identify", record, "--out", out, "--harmonics", "40", "--order", "1", "--window", "4"], "under-determined"),
        (["identify", record, "--out", out, "--band-hz", "4", "3500"], "excited band"),
        (["identify", str(done / "static.nc"), "--out", out], "schema"),
    ):
        assert run_command_line(arguments) == 2
        sentences = [line for line in capsys.readouterr().err.splitlines() if line.startswith("gearbench: ")]
        assert len(sentences) == 1 and word in sentences[0], sentences
    assert not Path(out).exists()


@pytest.mark.validation
def test_compare_with_a_stiffer_rig(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other, out = tmp_path / "heavy", tmp_path / "compared"
    heavy = small(experiment__torque_mean_nm="300")
    assert run_command_line(["run", "quick_lumped", "--out", str(other), *heavy]) == 0
    capsys.readouterr()
    assert run_command_line(["compare", str(done), str(other), "--out", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    rows = {row["quantity"]: row for row in summary["rows"]}
    assert rows["static TE, peak to peak"]["percent"] == pytest.approx(50.0)  # the lumped pair is linear
    assert rows["first mode, lowest"]["percent"] == pytest.approx(0.0, abs=1.0)
    assert any("mean torque differs: 200 and 300 N m" in note for note in summary["notes"])
    made = {path.name for path in out.iterdir()}
    pictures = {"dte.png", "itf.png", "natural_frequency.png", "static_te.png", "stiffness.png"}
    assert made == pictures | {"compare.csv", "report.html", "run.json"}


def test_conditions_get_a_record_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = tmp_path / "case.toml"
    assert run_command_line(["cases", "quick_lumped", "--copy", str(tmp_path)]) == 0
    capsys.readouterr()
    text = (tmp_path / "quick_lumped.toml").read_text(encoding="utf-8")
    case.write_text(text + '\n[[condition]]\nname = "low"\ntorque_mean_nm = 100\n[[condition]]\nname = "high"\n')
    arguments = ["simulate", str(case), "--out", str(tmp_path / "record.nc"), "--json", *small()]
    assert run_command_line(arguments) == 0
    summaries = json.loads(capsys.readouterr().out)
    assert [Path(one["file"]).name for one in summaries] == ["record-low.nc", "record-high.nc"]
    means = [
        float(xr.load_dataset(one["file"], engine="h5netcdf", decode_cf=False)["torque_driver"].mean())
        for one in summaries
    ]
    assert means == pytest.approx([100.0, 200.0], rel=1e-3)
    assert not (tmp_path / "record.nc").exists()


def test_an_impossible_pair_leaves_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run_command_line(["run", "quick_lumped", "--out", str(out), "--set", "rig.driver.hub_radius_mm=70"]) == 2
    assert "rig.driver.hub_radius_mm = 70" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.validation
def test_termination_leaves_whole_files_and_exit_130(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "gearbench", "run", "quick_lumped", "--out", str(out)]
    process = subprocess.Popen([*command, "--set", "experiment.realisations=4000"], stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not (out / "static.nc").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.0)
    os.kill(process.pid, signal.SIGTERM)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    whole = {"case.toml", "gears.png", "static.nc", "run.json"}
    assert {path.name for path in out.iterdir()} <= whole | {"record.nc.part"}  # what a second run takes up
