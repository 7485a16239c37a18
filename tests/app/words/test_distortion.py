"""Table and picture of distortion, by command and in a run."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from shared.small_run import SMALL_RUN

from gearbench.cli import run_command_line
from gearbench.figures.responses import distortion as figures_distortion
from gearbench.identification import distortion
from gearbench.identification.excitation.multisine import random_phase_multisine
from gearbench.records import make_record, write_record
from gearbench.words.distortion import distortion_lines, distortion_numbers

SAMPLES, MESH = 2048, 64


def record(bend: float, periods: int = 2) -> xr.Dataset:
    """A force through y = 1e-8 (u + bend u^2) with a little noise at 1024 Hz, 32 mesh periods."""
    rng = np.random.default_rng(0)
    draw = [
        random_phase_multisine(
            SAMPLES, 1024.0, (2.0, 200.0), rms=100.0, grid="coset", modulus=SAMPLES // MESH, rng=rng, crest=2.5
        )
        for _ in range(3)
    ]
    force = np.tile(np.stack([one.sample(SAMPLES) for one in draw]), (1, periods))
    dte = 1e-8 * (force + bend * force**2 / 100.0) + 1e-9 * rng.standard_normal(force.shape)
    given = {"sampling_rate": 1024.0, "samples_per_period": SAMPLES, "periods": periods, "mesh_period": MESH / 1024.0}
    return make_record({"dte": dte, "force": force}, {**given, "mesh_phase": 0.0})


@pytest.mark.parametrize(
    ("bend", "words"),
    [
        (0.0, "No distortion stands out of the noise"),
        (0.05, r"Distortion is 0\.0"),
        (0.3, "Distortion is 2\\d% of the response: .* for this excitation only"),
    ],
)
def test_the_verdict_follows_the_share(bend: float, words: str) -> None:
    *table, _, verdict = distortion_lines(distortion_numbers(distortion([record(bend)])))
    assert re.match(words, verdict)
    even = next(line for line in table if line.startswith("| even distortion"))
    assert even.endswith("| yes |" if bend else "| no |")


def test_identify_prints_the_table_of_a_coset_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "record.nc", tmp_path / "frf.nc"
    write_record(record(0.05, periods=1), path)
    lpm = ["--harmonics", "1", "--order", "1", "--window", "40"]
    more = ["--pictures", str(tmp_path / "pictures"), "--export", str(tmp_path / "frf.mat")]
    assert run_command_line(["identify", str(path), "--out", str(out), *lpm, *more]) == 0
    assert (tmp_path / "frf.mat").stat().st_size > 10_000
    drawn = {one.name for one in (tmp_path / "pictures").iterdir() if one.stat().st_size > 10_000}
    assert drawn >= {"itf.png", "htf.png", "quality.png", "orders.png", "distortion.png"}
    assert "| even distortion | " in capsys.readouterr().out
    assert run_command_line(["identify", str(path), "--out", str(out), *lpm, "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)["distortion"]
    for more, words in ((["--export", "frf.xls"], "must end in .uff"), (["--pictures", str(path)], "must be a folder")):
        assert run_command_line(["identify", str(path), "--out", str(out), *more]) == 2
        assert words in capsys.readouterr().err
    assert numbers["noise_um"] is None and 0.02 < numbers["share"] < 0.06


@pytest.mark.validation
def test_a_run_on_a_coset_has_table_and_picture(tmp_path: Path) -> None:
    sets = ["experiment.multisine.grid=coset", "experiment.mesh_frequency_hz=32", "identification.window=30"]
    coset = [part for one in sets for part in ("--set", one)]
    assert run_command_line(["run", *SMALL_RUN, *coset, "--out", str(tmp_path / "out")]) == 0
    assert "| even distortion | " in (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "distortion.png").stat().st_size > 10_000


def test_the_picture_shows_each_part_and_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Figure] = []
    monkeypatch.setattr(figures_distortion, "save", lambda figure, path: figures.append(figure))
    split = distortion([record(0.05)], band=(0.0, 400.0))
    figures_distortion.draw_distortion(Path("distortion.png"), split)
    (axes,) = figures[0].axes
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert [label.split(",")[0] for label in labels] == [
        "excited lines: linear response", "operating response", "even distortion", "odd distortion", "noise"
    ]  # fmt: skip
    drawn = sum(len(dots.get_offsets()) for dots in axes.collections)
    assert drawn == int((split["line_rms"] > 1e-7 * split["line_rms"].max()).sum())
