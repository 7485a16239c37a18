"""Experiments of a case side by side: each on threads of its own, the records the same whatever their number."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from gearbench.bench.experiment import simulate, simulate_to
from gearbench.bench.plan.schedule import ProgressReport
from gearbench.bench.plan.workers import processors, realisations
from gearbench.rig import Case

Result = TypeVar("Result")


def simulate_all(
    cases: Sequence[Case],
    take: Callable[[int, xr.Dataset], None],
    model: str | None = None,
    progress: ProgressReport | None = None,
    *,
    checkpoints: Sequence[Path | None] | None = None,
    workers: int | None = None,
) -> None:
    """Simulate cases, which are experiments of one case, on at most `workers` threads (absent: as many as there are
    processors), and hand each record to `take(number, record)` when it has ended: one at a time, in any order.

    `checkpoints`: a folder for each, as in `simulate`. Raises what `simulate` raises.
    """

    def one(number: int, report: ProgressReport, workers: int) -> xr.Dataset:
        folder = checkpoints[number] if checkpoints is not None else None
        return simulate(cases[number], model, report, checkpoints=folder, workers=workers)

    _together(len(cases), one, take, progress, workers)


def simulate_all_to(
    cases: Sequence[Case],
    paths: Sequence[Path],
    take: Callable[[int, dict[str, Any]], None],
    model: str | None = None,
    progress: ProgressReport | None = None,
    *,
    checkpoints: Sequence[Path],
    workers: int | None = None,
) -> None:
    """Likewise, each record straight into its file; `take` is handed what `simulate_to` says of it."""

    def one(number: int, report: ProgressReport, workers: int) -> dict[str, Any]:
        folder = checkpoints[number]
        return simulate_to(cases[number], paths[number], model, report, checkpoints=folder, workers=workers)

    _together(len(cases), one, take, progress, workers)


def _together(
    total: int,
    one: Callable[[int, ProgressReport, int], Result],
    take: Callable[[int, Result], None],
    progress: ProgressReport | None,
    workers: int | None,
) -> None:
    """one(number, report, workers) of each experiment, side by side, each result taken when it has ended."""
    report = progress or (lambda fraction, note: None)
    most = processors() if workers is None else workers
    at_once = max(min(total, most), 1)
    # What conditions leave of the threads is for the realisations of each.
    inner = most if at_once == 1 else max(most // at_once, 1)
    done = np.zeros(total)
    lock, stop = threading.Lock(), threading.Event()

    def run(number: int) -> None:
        def tell(fraction: float, note: str) -> None:
            if stop.is_set():
                raise InterruptedError("another condition has failed, or the run was interrupted")
            with lock:
                done[number] = fraction
                told = f"condition {number + 1} of {total}, {note}" if total > 1 else note
                report(float(done.mean()), told)

        found = one(number, tell, inner)
        with lock:
            take(number, found)

    if at_once == 1:
        for number in range(total):  # here, where an interruption arrives at once
            run(number)
    else:
        realisations(run, total, stop, at_once)
