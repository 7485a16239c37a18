"""Weak scaling of `campaign`: as many members a worker on one and on two processes, in turn; medians.

Members are static mesh cycles of `paper_fe` whose gears are condensed already, each with another tip relief: what a
study of micro-geometry does all day. Printed are members a second and the efficiency, time of one worker over that of
two.
"""

from __future__ import annotations

import os
import statistics
import time

from gearbench.bench.study.member import Task, compute
from gearbench.bench.study.processes import compute_here
from gearbench.bench.study.quantities import Ask
from gearbench.cases import read_case
from gearbench.rig import dump_case

EACH, ROUNDS = 12, 3
ASK = Ask(("te-peak-to-peak", "te-orders"), 100.0)


def tasks(count: int) -> list[Task]:
    start = "rig.driver.tip_relief_start_diameter_mm=126"
    relief = [f"rig.driver.tip_relief_um={5 + 0.25 * number}" for number in range(count)]
    return [Task(number, dump_case(read_case("paper_fe", [start, one])), ASK) for number, one in enumerate(relief)]


def seconds(workers: int) -> tuple[float, float]:
    """From the first result to the last, and how long the first took: starting, importing, reading kernels."""
    # One member more a worker: the first ones only say that all is ready.
    began = time.perf_counter()
    times = []
    for one in compute_here(tasks(workers * (EACH + 1)), workers):
        assert not one.sentence, one.sentence
        times.append(time.perf_counter() - began)
    return times[-1] - times[workers - 1], times[workers - 1]


def main() -> None:
    compute(tasks(1)[0])  # condensed and compiled
    before = time.perf_counter()
    for task in tasks(20):
        assert task.case
    print(f"a case read and written: {1e3 * (time.perf_counter() - before) / 20:.0f} ms")
    found: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    for _ in range(ROUNDS):
        for workers in found:
            found[workers].append(seconds(workers))
            spent, start = found[workers][-1]
            load = os.getloadavg()[0]
            print(f"{workers} worker(s): {spent:.1f} s, start {start:.1f} s, load {load:.0f}", flush=True)
    one, two = (statistics.median(run for run, _ in found[workers]) for workers in (1, 2))
    print(f"members a second: {EACH / one:.2f} with one worker, {2 * EACH / two:.2f} with two")
    print(f"efficiency of two: {one / two:.2f} (members of {one / EACH:.2f} s)")


if __name__ == "__main__":
    main()
