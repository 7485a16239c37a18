"""What is refused before any work is done, so that nothing is lost and nothing is counted twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import BenchError
from gearbench.bench.plan.workers import realisations
from gearbench.bench.statics import static
from gearbench.cases import case_path
from gearbench.cli import run_command_line
from gearbench.identification import SpectraError, identify
from gearbench.records import make_record
from gearbench.rig import read_case
from gearbench.words.summary import headline


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["identify", "a.nc", "--out", "a.nc"], "one of the inputs"),
        (["identify", "a.nc", "a.nc", "--out", "f.nc"], "names 1 file(s)"),
        (["static", "quick_lumped", "--out", "notes.txt"], "must end in .nc"),
        (["static", "quick_lumped", "--out", "s.nc", "--positions", "1000000000"], "at most 65536"),
        (
            ["static", "quick_lumped", "--out", "s.nc", "--stiffness-figure", "notes.txt"],
            "--stiffness-figure notes.txt must end in .png",
        ),
        (
            ["static", "quick_lumped", "--out", "s.nc", "--figure", "k.png", "--stiffness-figure", "k.png"],
            "--stiffness-figure k.png is one of the other files",
        ),
        (["check", "quick_fe", "--set", "experiment.mesh_frequency_hz=20.3"], "20.3 mesh periods"),
        (["check", "quick_fe", "--set", "experiment.mesh_frequency_hz=4096"], "must lie below half"),
    ],
)
def test_is_refused_in_a_sentence(
    arguments: list[str], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    kept = {"a.nc": b"a record", "notes.txt": b"notes"}
    for name, content in kept.items():
        (tmp_path / name).write_bytes(content)
    assert run_command_line(arguments) == 2
    assert sentence in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == kept


def test_run_without_excitation_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    text = case_path("quick_lumped").read_text(encoding="utf-8")
    lines = text.split("[experiment.multisine]")[0] + "[simulation]" + text.split("[simulation]")[1]
    (tmp_path / "still.toml").write_text(lines, encoding="utf-8")
    (tmp_path / "gears").symlink_to(case_path("quick_lumped").parent / "gears")
    monkeypatch.chdir(tmp_path)
    assert run_command_line(["run", "still.toml", "--out", "out"]) == 2
    assert "experiment.multisine is missing" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_records_of_different_mean_torque_are_no_realisations_of_one_condition() -> None:
    values = np.random.default_rng(0).standard_normal((2, 1, 256))

    def record(torque: float) -> xr.Dataset:
        attributes = {"sampling_rate": 256.0, "samples_per_period": 256, "periods": 1, "mesh_period": 0.25}
        channels = {"force": values[0], "dte": 1e-9 * values[1]}
        return make_record(channels, {**attributes, "torque_mean": torque})

    with pytest.raises(SpectraError, match=r"torque_mean: 2 to 3 N m"):
        identify([record(2.0), record(3.0)])


def test_a_failed_realisation_tells_the_others_to_stop() -> None:
    from threading import Event

    stop = Event()

    def run(number: int) -> bool:
        if number == 0:
            raise BenchError("the first one fails")
        return stop.wait(timeout=20.0)

    with pytest.raises(BenchError, match="the first one fails"):
        realisations(run, 2, stop)
    assert stop.is_set()


def test_static_positions_have_a_limit() -> None:
    with pytest.raises(BenchError, match="at most 65536"):
        static(read_case(case_path("quick_lumped")), positions=65537)


@pytest.mark.parametrize(("identified", "confirmed"), [((434.0, 532.0), False), ((2800.0, 3050.0), True)])
def test_a_mode_far_from_the_linearised_one_is_not_called_found(
    identified: tuple[float, float], confirmed: bool
) -> None:
    numbers = {
        "te_mesh_orders_um": [1.0, 0.5, 0.2],
        "te_peak_to_peak_um": 2.0,
        "torque_mean_nm": 2.0,
        "first_mode_hz": identified,
        "first_mode_linearised_hz": (2981.0, 2987.0),
        "first_mode_fewest_pairs_hz": identified[0],
        "first_mode_most_pairs_hz": identified[1],
    }
    assert ("none that the model confirms" in headline(numbers)[2]) is not confirmed
