"""How much memory a simulation takes, and whether there is that much: for a record in memory, and for one that goes
into its file piece by piece. Likewise the disk."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import NamedTuple

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.stored import LONG, PIECE

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


def check_held(samples: int, realisations: int) -> None:
    """Raise BenchError where a record takes more memory than there is, which is read from its file as a whole."""
    needed, free = memory_needed(samples, 0, 0, realisations, 1), memory_free()
    if free is None or needed <= free:
        return
    raise BenchError(
        f"the record takes about {needed / 1e9:.3g} GB, and is identified as a whole: {free / 1e9:.3g} GB of memory are"
        " free; lower experiment.samples_per_period, experiment.periods or experiment.realisations, or let `simulate`"
        " write it piece by piece"
    )


class Work(NamedTuple):
    """What one realisation takes on its way into a file: `kept` samples are simulated, of which blocks of `block` are
    compared (0: none are), under a torque that repeats after `period` samples, in `substeps` steps each; `whole`: the
    samples of the record where sensors need all of them at once, else 0."""

    kept: int
    block: int
    period: int
    substeps: int
    whole: int


def work_needed(work: Work, at_once: int) -> int:
    """Bytes, within a factor of two, that realisations take that go into a file piece by piece, `at_once` at a time: of
    each two blocks and what is made of them, what waits for the disk, and the torque at every step; and a stretch of
    the record."""
    stretch = min(max(work.block, PIECE), work.kept)
    waiting = min(work.kept * OUTPUTS * NUMBER, LONG)
    each = NUMBER * (stretch * 3 * OUTPUTS + work.period * 2 * work.substeps) + 2 * waiting
    return at_once * each + NUMBER * 3 * CHANNELS * max(min(work.kept, PIECE), work.whole)


def check_work(work: Work, at_once: int) -> None:
    """Raise BenchError where that is more memory than there is."""
    needed, free = work_needed(work, at_once), memory_free()
    if free is None or needed <= free:
        return
    keys = "experiment.samples_per_period"
    keys += " or experiment.periods" if work.whole or work.block > work.period else ""
    sensors = ", leave out rig.sensors.filter_hz and delays, which need the whole record at once" if work.whole else ""
    raise BenchError(
        f"a realisation of {work.kept} samples in {work.substeps} steps each"
        + (f", {work.period} of them in an excitation period," if work.period > 1 else "")
        + f" takes about {needed / at_once / 1e9:.3g} GB of memory while it runs"
        + (f", {at_once} at a time {needed / 1e9:.3g} GB," if at_once > 1 else "")
        + f" and {free / 1e9:.3g} GB are free: lower {keys}{sensors}"
        + (f", or run fewer than {at_once} at a time (--workers)" if at_once > 1 else "")
    )


def check_disk(samples: int, realisations: int, kept: int, path: Path) -> None:
    """Raise BenchError where the disk of `path` has no room for the record and for `kept` samples of every realisation
    that wait beside it."""
    record = NUMBER * samples * realisations * CHANNELS
    needed = record + NUMBER * kept * realisations * OUTPUTS
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError:
        return  # the writer says what stands in the way
    if needed <= free:
        return
    raise BenchError(
        f"{path} takes about {record / 1e9:.3g} GB, and with what it is made of {needed / 1e9:.3g} GB, of which"
        f" {free / 1e9:.3g} GB are free on that disk: lower experiment.samples_per_period, experiment.periods or"
        " experiment.realisations"
    )
