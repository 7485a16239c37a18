"""The gap of a study's members to a measured record: known curves, and a stiffness that is found again."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from shared.members_here import members_here

import gearbench as gb
from gearbench.bench import BenchError
from gearbench.bench.study.against import gap, reference_of
from gearbench.bench.study.member import Task, task_data, task_from
from gearbench.bench.study.quantities import Ask
from gearbench.shell.failure import InputError

FAST = (
    "experiment.realisations=1",
    "experiment.samples_per_period=1024",
    "experiment.sampling_rate_hz=5120",
    "experiment.mesh_frequency_hz=20",
    "experiment.multisine.band_hz=[20,2000]",
    "identification.band_hz=[20,2000]",
)


def record(amplitude: float, shift: float = 0.0, origin: str = "geometry", period: float = 0.05) -> xr.Dataset:
    """DTE 7 um + amplitude cos(2 pi (phase - shift)) over four mesh periods, and noise-free."""
    phase = np.arange(4 * 512) / 512
    values = 7e-6 + 1e-6 * amplitude * np.cos(2 * pi * (phase - shift))
    time = phase * period
    about = {"mesh_period": period, "mesh_phase_origin": origin}
    held = {name: (("realisation", "time"), row[None]) for name, row in (("dte", values), ("mesh_phase", phase))}
    return xr.Dataset(held, coords={"time": time}, attrs=about)


def test_the_gap_of_two_cosines_is_known() -> None:
    apart, percent = gap(record(5.0), reference_of(record(2.0)))
    assert apart == pytest.approx(3 / sqrt(2), rel=1e-3) and percent == pytest.approx(150.0, rel=1e-3)
    # a quarter period apart: the difference of cosine and sine of one size
    apart, percent = gap(record(2.0, shift=0.25), reference_of(record(2.0)))
    assert apart == pytest.approx(2.0, rel=1e-3) and percent == pytest.approx(100 * sqrt(2), rel=1e-3)


def test_an_arbitrary_phase_is_brought_onto_the_measured_one() -> None:
    apart, _ = gap(record(2.0, shift=0.25), reference_of(record(2.0, origin="arbitrary")))
    assert apart < 0.01


def test_another_speed_and_a_flat_record_are_refused() -> None:
    with pytest.raises(BenchError, match=r"set experiment\.mesh_frequency_hz = 20"):
        gap(record(2.0, period=0.06), reference_of(record(2.0)))
    with pytest.raises(BenchError, match="does not vary"):
        reference_of(record(0.0))


def test_a_worker_elsewhere_gets_the_whole_reference() -> None:
    import json

    task = Task(3, "text", Ask(("gap",), against=reference_of(record(2.0))))
    assert task_from(json.loads(json.dumps(task_data(task)))) == task


def test_a_study_finds_the_stiffness_of_the_measured_rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    members_here(monkeypatch)
    law = ("simulation.mesh_stiffness=rectangular", "simulation.stiffness_single_n_per_m=2e8")
    truth = [*FAST, *law, "simulation.stiffness_double_n_per_m=3.4e8"]
    measured = gb.simulate(gb.read_case("quick_lumped", truth))
    vary = ["simulation.stiffness_double_n_per_m=2.6e8,3.0e8,3.4e8,3.8e8"]
    start = [*FAST, *law, "simulation.stiffness_double_n_per_m=3e8"]
    table = gb.campaign(
        "quick_lumped", tmp_path / "out", vary, of=["gap", "dte-rms"], against=measured, settings=start, workers=1
    )
    gaps = table["gap_percent"].values
    assert gaps.argmin() == 2 and gaps[2] < 1e-6 and np.all(np.delete(gaps, 2) > 5.0)


def test_gap_and_record_belong_together(tmp_path: Path) -> None:
    vary = ["rig.driver.face_width_mm=10,20"]
    with pytest.raises(InputError, match="--against RECORD"):
        gb.campaign("quick_lumped", tmp_path / "out", vary, of=["gap"])
    with pytest.raises(InputError, match="--of gap"):
        gb.campaign("quick_lumped", tmp_path / "out", vary, of=["dte-rms"], against=record(1.0))
