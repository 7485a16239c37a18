"""Conditions side by side: the same bytes as one after the other, none of them told before it has ended."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from gearbench.bench import BenchError
from gearbench.bench import conditions as module
from gearbench.bench.conditions import simulate_all
from gearbench.cases import case_path
from gearbench.commands.experiments.simulate import write_records
from gearbench.rig import Case, dump_case, read_case
from gearbench.shell.progress import Silent

SHORT = ["experiment.realisations=2", "experiment.samples_per_period=1024", "experiment.mesh_frequency_hz=32"]
BAND = ["experiment.multisine.band_hz=[16, 3500]", "identification.band_hz=[16, 3500]"]


def two_speeds(folder: Path) -> Case:
    text = dump_case(read_case(case_path("quick_lumped"), [*SHORT, *BAND]))
    more = "".join(f'[[condition]]\nname = "{hz}"\nmesh_frequency_hz = {hz}\n' for hz in (32, 64, 96))
    (folder / "both.toml").write_text(f"{text}\n{more}", encoding="utf-8")
    return read_case(folder / "both.toml")


def test_records_are_the_same_to_the_last_byte(tmp_path: Path) -> None:
    case = two_speeds(tmp_path)
    contents: list[list[bytes]] = []
    for workers in (1, 2, 5):
        out = tmp_path / str(workers) / "record.nc"
        out.parent.mkdir()
        progress: Any = Silent()
        paths = [out.with_name(f"record-{hz}.nc") for hz in (32, 64, 96)]
        found = write_records(case, out, None, {path: [] for path in paths}, workers, progress)
        assert [one["file"] for one in found] == [str(path) for path in paths]
        contents.append([path.read_bytes() for path in paths])
        assert sorted(out.parent.iterdir()) == sorted(paths)  # nothing is left of checkpoints
    assert contents[0] == contents[1] == contents[2]
    assert len(set(contents[0])) == 3


def test_two_are_at_work_at_a_time_and_a_third_waits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    meet, lock, now, most = threading.Barrier(2, timeout=10), threading.Lock(), 0, 0

    def simulated(case: Case, *_: Any, workers: int, **__: Any) -> xr.Dataset:
        nonlocal now, most
        with lock:
            now, most = now + 1, max(most, now + 1)
        if case.experiment.mesh_frequency != 96:
            meet.wait()
        with lock:
            now -= 1
        assert workers == 1
        return xr.Dataset()

    monkeypatch.setattr(module, "simulate", simulated)
    taken: list[int] = []
    cases = [case for _, case in two_speeds(tmp_path).experiments()]
    simulate_all(cases, lambda number, record: taken.append(number), workers=2)
    assert sorted(taken) == [0, 1, 2] and most == 2


def test_one_that_fails_ends_them_all(tmp_path: Path) -> None:
    cases = [case for _, case in two_speeds(tmp_path).experiments()]
    hasty = cases[0].experiment.model_copy(update={"sampling_rate": 8001.0})
    with pytest.raises(BenchError, match="whole number"):
        simulate_all([cases[0].model_copy(update={"experiment": hasty}), *cases[1:]], lambda n, r: None, workers=2)
