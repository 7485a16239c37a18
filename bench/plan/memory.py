"""How much memory a simulation takes, and whether there is that much: a record is made in memory and written whole."""

from __future__ import annotations

import re
from pathlib import Path

from gearbench.bench.errors import BenchError

CHANNELS = 10  # of a record with all that most rigs have
OUTPUTS = 14  # that a model hands out, kept twice while blocks become one array
NUMBER = 8  # bytes


def memory_needed(samples: int, kept: int, substeps: int, realisations: int, at_once: int) -> int:
    """Bytes, within a factor of two, that a record of so many samples takes, of which `kept` are simulated (others
    repeat them), `at_once` realisations at a time: the channels of all, and of those that run, outputs and torque at
    every step, with what makes it."""
    return NUMBER * (samples * realisations * CHANNELS + kept * at_once * (2 * OUTPUTS + 2 * substeps))


def memory_free(table: Path = Path("/proc/meminfo")) -> int | None:
    """Bytes that are free for a process; None where the system does not tell."""
    try:
        found = re.search(r"MemAvailable:\s+(\d+) kB", table.read_text(encoding="utf-8"))
    except OSError:
        return None
    return 1024 * int(found[1]) if found else None


def check_memory(samples: int, kept: int, substeps: int, realisations: int, at_once: int) -> None:
    """Raise BenchError where a simulation takes more memory than there is."""
    needed, free = memory_needed(samples, kept, substeps, realisations, at_once), memory_free()
    if free is None or needed <= free:
        return
    raise BenchError(
        f"{realisations} realisation{'s' * (realisations > 1)} of {samples} samples in {substeps} steps each take"
        f" about {needed / 1e9:.3g} GB of memory, and {free / 1e9:.3g} GB are free: lower"
        " experiment.samples_per_period, experiment.periods or experiment.realisations"
        + (f", or run fewer than {at_once} at a time (--workers)" if at_once > 1 else "")
    )
