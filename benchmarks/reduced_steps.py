"""How fast the reduced rig of paper_fe runs: rig time over processor time, and where the time goes; one core.

    python benchmarks/reduced_steps.py

Parts are timed alone, in loops of their own, at a position of the run: search of tooth pairs; modes (prediction,
effective mass, one solution); output of a sample, once in eight steps. Contact is the rest.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.cases import case_path
from gearbench.fem.contact.law import MEETING, PAIRS, Law, Meetings, meet, off_flanks
from gearbench.fem.contact.static import MARGIN
from gearbench.fem.motion.machine import Machine
from gearbench.fem.motion.scheme import Scheme, make_scheme
from gearbench.fem.motion.stage import Room, Stage, make_room
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.step import accelerate, factorise, predict
from gearbench.fem.motion.transient import advance, staged
from gearbench.kernels.borrowed import borrowed
from gearbench.kernels.compiled import compiled
from gearbench.rig import read_case

STEPS = 65536
SUBSTEPS = 8


@compiled
def search(law: Law, found: Meetings, steps: int) -> int:
    """Search of the tooth pairs, driver turning."""
    law, found, total = borrowed(law), borrowed(found), 0
    for i in range(steps):
        total += meet(law, 2e-5 + 1e-7 * i, 1e-7 * i, law.centre, 0.0, MARGIN, found)
    return total


@compiled
def modes(machine: Machine, scheme: Scheme, old: Stage, new: Stage, room: Room, steps: int) -> None:
    """Prediction, effective mass and a solution."""
    machine, old, new, room = borrowed(machine), borrowed(old), borrowed(new), borrowed(room)
    for _ in range(steps):
        predict(machine, scheme, old, room)
        factorise(machine, scheme, room)
        accelerate(room, room.rest, new.a)


@compiled
def output(law: Law, samples: int) -> int:
    """What an output costs: whether contact is on the modelled flanks."""
    law, total = borrowed(law), 0
    for i in range(samples):
        total += off_flanks(law, 2e-5 + 1e-7 * i, 1e-7 * i, law.centre, 0.0)
    return total


def spent(job: Callable[[], Any], repeats: int = 5) -> float:
    """Least processor time [s] of a job, which is run once before."""
    job()
    times = []
    for _ in range(repeats):
        began = time.process_time()
        job()
        times.append(time.process_time() - began)
    return min(times)


def main() -> None:
    """Print the real-time factor and the shares."""
    case = read_case(case_path("paper_fe"))
    machine = machine_for(elastic_rig(case.rig, case.simulation), 2.0)
    scheme, start, torque = make_scheme(1 / STEPS, 0.9), initial_state(machine, 2.0), np.full(STEPS, 2.0)
    total = spent(lambda: advance(machine, scheme, start, torque, SUBSTEPS))
    parts = {
        "search": spent(lambda: search(machine.law, np.zeros(PAIRS, MEETING), STEPS)),
        "modes": spent(lambda: modes(machine, scheme, staged(start), staged(start), make_room(machine), STEPS)),
        "output": spent(lambda: output(machine.law, STEPS // SUBSTEPS)),
    }
    parts["contact"] = total - sum(parts.values())
    print(f"{STEPS} steps, 1 s of rig time: {total:.3f} s of processor time, {1 / total:.1f} times real time")
    for name, seconds in parts.items():
        print(f"  {name:8} {1e6 * seconds / STEPS:6.2f} us a step {seconds / total:6.0%}")


if __name__ == "__main__":
    main()
