"""Experiments of a case side by side: each on threads of its own, the records the same whatever their number."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from gearbench.bench.experiment import simulate
from gearbench.bench.plan.schedule import ProgressReport
from gearbench.bench.plan.workers import processors, realisations
from gearbench.rig import Case


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
    report = progress or (lambda fraction, note: None)
    most = processors() if workers is None else workers
    at_once = max(min(len(cases), most), 1)
    # What conditions leave of the threads is for the realisations of each.
    inner = most if at_once == 1 else max(most // at_once, 1)
    done = np.zeros(len(cases))
    lock, stop = threading.Lock(), threading.Event()

    def run(number: int) -> None:
        def tell(fraction: float, note: str) -> None:
            if stop.is_set():
                raise InterruptedError("another condition has failed, or the run was interrupted")
            with lock:
                done[number] = fraction
                told = f"condition {number + 1} of {len(cases)}, {note}" if len(cases) > 1 else note
                report(float(done.mean()), told)

        folder = checkpoints[number] if checkpoints is not None else None
        record = simulate(cases[number], model, tell, checkpoints=folder, workers=inner)
        with lock:
            take(number, record)

    if at_once == 1:
        for number in range(len(cases)):  # here, where an interruption arrives at once
            run(number)
    else:
        realisations(run, len(cases), stop, at_once)
