"""Realisations side by side, one thread each."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Result = TypeVar("Result")


def processors() -> int:
    """Processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def realisations(run: Callable[[int], Result], total: int) -> list[Result]:
    """Results of run(0) .. run(total - 1), in order, on as many threads as there are processors.

    What has not begun is dropped when one fails or the caller is interrupted.
    """
    pool = ThreadPoolExecutor(min(total, processors()))
    try:
        return [future.result() for future in [pool.submit(run, number) for number in range(total)]]
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
