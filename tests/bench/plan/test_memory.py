"""A simulation that takes more memory than there is: refused before it is integrated; what it takes is about what the
allocator counts."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest

from gearbench.bench import BenchError, simulate
from gearbench.bench.plan import memory
from gearbench.bench.plan.memory import memory_free, memory_needed
from gearbench.cases import case_path
from gearbench.rig import Case, read_case

LONG = ("experiment.samples_per_period=65536", "experiment.periods=2", "experiment.mesh_frequency_hz=20")


def quick(realisations: int, *settings: str) -> Case:
    return read_case(case_path("quick_lumped"), [*LONG, f"experiment.realisations={realisations}", *settings])


@pytest.mark.parametrize(
    ("realisations", "settings"), [(4, ()), (2, ("rig.mesh.stiffness_scale=1.0001",))]
)
def test_it_is_about_what_the_allocator_counts(
    monkeypatch: pytest.MonkeyPatch, realisations: int, settings: tuple[str, ...]
) -> None:
    told: list[int] = []

    def needed(*given: int) -> int:
        told.append(memory_needed(*given))
        return told[-1]

    monkeypatch.setattr(memory, "memory_needed", needed)
    case = quick(realisations, "experiment.samples_per_period=32768", *settings)
    simulate(quick(1, "experiment.samples_per_period=16384", *settings))  # compiled
    tracemalloc.start()
    simulate(case, workers=1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.5 < told[-1] / peak < 2.0


def test_too_long_a_record_is_refused_before_it_is_integrated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "memory_free", lambda: 10_000_000)
    words = r"4 realisations of 65536 samples in \d+ steps each take about 0\.0\d+ GB of memory, and 0\.01 GB are"
    with pytest.raises(BenchError, match=words + r" free: lower .*, or run fewer than 2 at a time \(--workers\)"):
        simulate(quick(4), workers=2, progress=lambda fraction, note: None if fraction == 0.0 else pytest.fail(note))
    monkeypatch.setattr(memory, "memory_free", lambda: None)
    simulate(quick(1, "experiment.samples_per_period=16384"))


def test_free_memory_is_what_the_system_tells(tmp_path: Path) -> None:
    table = tmp_path / "meminfo"
    table.write_text("MemTotal: 8000 kB\nMemAvailable:   2048 kB\n")
    assert memory_free(table) == 2048 * 1024
    assert memory_free(tmp_path / "none") is None
    free = memory_free()
    assert free is None or free > 1_000_000
