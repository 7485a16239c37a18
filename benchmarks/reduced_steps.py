"""How fast the reduced rig of paper_fe runs: rig time over processor time, and where the time goes; one core.

    python benchmarks/reduced_steps.py [--skip-calculix]

Parts are timed alone, in loops of their own, at a position of the run: search of tooth pairs; modes (prediction,
effective mass, one solution); output of a sample, once in eight steps. Contact is the rest.

Then a step in time of one pair by the reduced model, the full model and CalculiX (an increment of *DYNAMIC with
contact, minutes; left out where there is no `ccx`), in the same run: the small pair whose vibration after a step of
torque is compared in tests/validation/calculix. The meshes are those that each needs; their unknowns are printed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.bench.full.run import full_gears, full_machine
from gearbench.cases import case_path
from gearbench.fem.contact.law import MEETING, PAIRS, Law, Meetings, meet, off_flanks
from gearbench.fem.contact.static import MARGIN
from gearbench.fem.full import record, start
from gearbench.fem.full.transient import make_integrator
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
CALCULIX = Path(__file__).resolve().parents[1] / "tests" / "validation" / "calculix"
INCREMENTS = 36  # of CalculiX's run, of which one is timed: 20 us


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


def peers(calculix: bool) -> None:
    """Print what a step in time takes by each model, and by CalculiX."""
    case = read_case(CALCULIX / "torque_step.toml")
    torque, step = case.experiment.torque_mean, 0.72e-3 / INCREMENTS
    elastic, scheme = elastic_rig(case.rig, case.simulation), make_scheme(step, 0.9)
    machine = machine_for(elastic, 1.0)
    begin, many = initial_state(machine, torque), np.full(4096, torque)
    reduced = spent(lambda: advance(machine, scheme, begin, many, SUBSTEPS)) / len(many)
    unknowns = f"{len(machine.mass)} unknowns"
    print(f"a step of the reduced model: {1e6 * reduced:.1f} us ({unknowns})")
    unreduced = full_machine(elastic, full_gears(case.rig, case.simulation, lambda note: None), 1.0)
    integrator, few = make_integrator(unreduced, scheme), np.full(10, torque)
    at = start.initial_state(unreduced, torque)
    full = spent(lambda: record.advance(integrator, at, few), 3) / len(few)
    print(f"of the full model: {1e3 * full:.1f} ms ({unreduced.unknowns} unknowns), {full / reduced:.0f} times as long")
    if not calculix or shutil.which("ccx") is None:
        print("CalculiX left out: no `ccx` on the path or not wanted")
        return
    sys.path.insert(0, str(CALCULIX))
    import torque_step

    torque_step.DURATION = step
    settings = {"across": 3.0, "size": 1.0, "penalty": 1.0, "steps": 1, "alpha": -0.05}
    with tempfile.TemporaryDirectory() as folder:
        began = os.times()
        found = torque_step.run(Path(folder), case, settings)
        ended = os.times()
    theirs = ended.children_user + ended.children_system - began.children_user - began.children_system
    print(
        f"an increment of CalculiX, its reading and writing included: {theirs:.0f} s ({found['nodes']} nodes of a plane"
        f" mesh), {theirs / reduced:.1e} times as long as the reduced step, {theirs / full:.0f} times as the full one"
    )


def main() -> None:
    """Print the real-time factor, the shares and the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--skip-calculix", action="store_true", help="leave CalculiX's increment out")
    options = parser.parse_args()
    shares()
    peers(not options.skip_calculix)


def shares() -> None:
    """Print the real-time factor of paper_fe and where its time goes."""
    case = read_case(case_path("paper_fe"))
    machine = machine_for(elastic_rig(case.rig, case.simulation), 2.0)
    scheme, begin, torque = make_scheme(1 / STEPS, 0.9), initial_state(machine, 2.0), np.full(STEPS, 2.0)
    total = spent(lambda: advance(machine, scheme, begin, torque, SUBSTEPS))
    parts = {
        "search": spent(lambda: search(machine.law, np.zeros(PAIRS, MEETING), STEPS)),
        "modes": spent(lambda: modes(machine, scheme, staged(begin), staged(begin), make_room(machine), STEPS)),
        "output": spent(lambda: output(machine.law, STEPS // SUBSTEPS)),
    }
    parts["contact"] = total - sum(parts.values())
    print(f"{STEPS} steps, 1 s of rig time: {total:.3f} s of processor time, {1 / total:.1f} times real time")
    for name, seconds in parts.items():
        print(f"  {name:8} {1e6 * seconds / STEPS:6.2f} us a step {seconds / total:6.0%}")


if __name__ == "__main__":
    main()
