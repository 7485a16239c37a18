"""Realisations side by side, one thread each."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from threading import Event, Lock
from typing import TypeVar

# The mesher knows one model at a time: what is simulated side by side is made ready one after the other.
READY = Lock()

Item = TypeVar("Item")
Result = TypeVar("Result")


def processors() -> int:
    """Processors that this process may run on; GEARBENCH_PROCESSORS says so where others run beside it."""
    here = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    told = os.environ.get("GEARBENCH_PROCESSORS", "")
    return min(int(told), here) if told.isdecimal() and int(told) else here


def side_by_side(run: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Results of run(item) of all items, in order, on as many threads as there are processors."""
    if not items:
        return []
    with ThreadPoolExecutor(min(len(items), processors())) as pool:
        return list(pool.map(run, items))


def realisations(
    run: Callable[[int], Result], total: int, stop: Event, workers: int | None = None
) -> list[Result]:
    """Results of run(0) .. run(total - 1), in order, on that many threads (absent: as there are processors).

    When one fails or the caller is interrupted, what has not begun is dropped and `stop` is set: `run` looks at it
    now and then, or the end of what has begun would have to be waited for.
    """
    pool = ThreadPoolExecutor(min(total, workers or processors()))
    try:
        futures = [pool.submit(run, number) for number in range(total)]
        wait(futures, return_when=FIRST_EXCEPTION)  # whichever fails first, in order or not
        for future in futures:
            if future.done() and (error := future.exception()) is not None:
                raise error
        return [future.result() for future in futures]
    except BaseException:
        stop.set()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
