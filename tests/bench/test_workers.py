"""Realisations side by side: the same bytes whatever the number of workers, and no more of them than asked for."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from threading import Event

import pytest

from gearbench.bench import BenchError, simulate
from gearbench.bench.plan.workers import realisations
from gearbench.cases import case_path
from gearbench.records import write_record
from gearbench.rig import read_case

SHORT = ["experiment.realisations=5", "experiment.samples_per_period=1024", "experiment.mesh_frequency_hz=32"]
BAND = ["experiment.multisine.band_hz=[16, 3500]", "identification.band_hz=[16, 3500]"]
NOISE = "rig.sensors.noise_angle_urad=1"


def test_records_are_the_same_to_the_last_byte(tmp_path: Path) -> None:
    case = read_case(case_path("quick_lumped"), [*SHORT, *BAND, NOISE])
    contents = []
    for workers in (1, 2, 5, None):
        path = tmp_path / f"{workers}.nc"
        write_record(simulate(case, workers=workers), path)
        contents.append(path.read_bytes())
    assert len(set(contents)) == 1
    with pytest.raises(BenchError, match="workers = 0 must be at least 1"):
        simulate(case, workers=0)


@pytest.mark.parametrize("workers", [1, 3])
def test_no_more_run_at_a_time_than_are_asked_for(workers: int) -> None:
    lock, now, most = threading.Lock(), 0, 0

    def run(number: int) -> int:
        nonlocal now, most
        with lock:
            now += 1
            most = max(most, now)
        time.sleep(0.02)
        with lock:
            now -= 1
        return number

    assert realisations(run, 9, Event(), workers) == list(range(9))
    assert most == workers
