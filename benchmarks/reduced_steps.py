"""How fast the reduced rig of paper_fe runs: rig time over processor time, and where the time goes; one core.

    OMP_NUM_THREADS=1 python benchmarks/reduced_steps.py

Parts are timed alone, in loops of their own, at a position of the run: search of tooth pairs; modes (prediction,
effective mass, one solution); output of a sample, once in eight steps. Contact is the rest.

Below, a step of the reduced model beside one of the full model and an increment of CalculiX (`*DYNAMIC`, contact by
surfaces) on one pair, a step of torque from rest (`tests/validation/calculix/torque_step.py`), all in steps of 20 us.
CalculiX runs on the mesh of the full model, whose local answer to contact is found analytically, and on one that
resolves the width of contact, which CalculiX needs. It takes minutes, and wants ccx on the path.
"""

from __future__ import annotations

import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.bench.full.run import full_gears, full_machine
from gearbench.cases import case_path
from gearbench.fem.contact.law import MEETING, PAIRS, Law, Meetings, meet, off_flanks
from gearbench.fem.contact.static import MARGIN
from gearbench.fem.full import record
from gearbench.fem.full import start as full_start
from gearbench.fem.full.transient import make_integrator
from gearbench.fem.motion.machine import Machine
from gearbench.fem.motion.scheme import Scheme, make_scheme
from gearbench.fem.motion.stage import Room, Stage, make_room
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.step import accelerate, factorise, predict
from gearbench.fem.motion.transient import advance, staged
from gearbench.geometry.mesh.assembly import full_mesh
from gearbench.geometry.mesh.values import GearMesh
from gearbench.kernels.borrowed import borrowed
from gearbench.kernels.compiled import compiled
from gearbench.rig import read_case

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from shared.torque_steps import FOLDER, REST, TORQUE, elastic
from validation.calculix import torque_step

STEPS = 65536
SUBSTEPS = 8
INCREMENT = 2e-5  # [s]: a 36th of the course that CalculiX was run over
INCREMENTS = 2  # that CalculiX solves beside the first
REDUCED_STEPS = 4000
FULL_STEPS = 20
ROUNDS = 3


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
    return min(timed(job) for _ in range(repeats))


def timed(job: Callable[[], Any]) -> float:
    """Processor time [s] of a job."""
    began = time.process_time()
    job()
    return time.process_time() - began


class Peer(NamedTuple):
    """A program beside the others: its name, and a step taken: processor time [s], and what it solves for."""

    name: str
    step: Callable[[], tuple[float, str]]


def reduced_peer() -> Peer:
    """The reduced model after a step of torque."""
    machine, scheme = machine_for(elastic(), 0.0), make_scheme(INCREMENT, 0.9)
    start, torque = initial_state(machine, REST), np.full(REDUCED_STEPS, TORQUE)
    advance(machine, scheme, start, torque, 1)  # compiles
    job = partial(advance, machine, scheme, start, torque, 1)
    return Peer("reduced", lambda: (timed(job) / REDUCED_STEPS, f"{len(machine.mass)} unknowns"))


def full_peer() -> Peer:
    """Likewise the full model."""
    case = read_case(FOLDER / "torque_step.toml")
    machine = full_machine(elastic(), full_gears(case.rig, case.simulation, lambda note: None), 0.0)
    integrator, start = make_integrator(machine, make_scheme(INCREMENT, 0.9)), full_start.initial_state(machine, REST)
    job = partial(record.advance, integrator, start, np.full(FULL_STEPS, TORQUE))
    return Peer("full", lambda: (timed(job) / FULL_STEPS, f"{machine.unknowns} unknowns"))


def meshes_of_full() -> tuple[GearMesh, GearMesh]:
    """The meshes of the full model's gears, whole."""
    case = read_case(FOLDER / "torque_step.toml")
    one, two = full_gears(case.rig, case.simulation, lambda note: None)
    return full_mesh(one.sector), full_mesh(two.sector)


def calculix_peer(name: str, meshes: tuple[GearMesh, GearMesh] | None) -> Peer:
    """CalculiX, on these meshes of the gears or on its own: what more increments cost than the first alone, so that
    reading the model and setting up do not count."""

    def step() -> tuple[float, str]:
        (first, nodes), (more, _) = run_of_calculix(meshes, 1), run_of_calculix(meshes, 1 + INCREMENTS)
        return (more - first) / INCREMENTS, f"{nodes} nodes"

    return Peer(name, step)


def run_of_calculix(meshes: tuple[GearMesh, GearMesh] | None, increments: int) -> tuple[float, int]:
    """Processor time [s] of the whole process, and nodes."""
    settings = {"across": 3.0, "size": 1.0, "penalty": 1.0, "steps": increments, "alpha": -0.05}
    case = read_case(FOLDER / "torque_step.toml")
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run = torque_step.run(Path(folder), case, settings, meshes, increments * INCREMENT)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, int(run["nodes"])


def side_by_side() -> None:
    """Print the medians of a step of each program on the same pair, all of them taking turns."""
    peers, missing = [reduced_peer(), full_peer()], shutil.which("ccx") is None
    if not missing:
        peers += [calculix_peer("CalculiX", meshes_of_full()), calculix_peer("CalculiX, own mesh", None)]
    rounds = [[peer.step() for peer in peers] for _ in range(ROUNDS)]
    turns = [[seconds for seconds, _ in steps] for steps in zip(*rounds, strict=True)]
    medians = [median(times) for times in turns]
    print(f"a step of {1e6 * INCREMENT:.0f} us, 20 and 20 teeth, processor time, medians of {ROUNDS} in turn:")
    for peer, middle, times, (_, size) in zip(peers, medians, turns, rounds[0], strict=True):
        print(
            f"  {peer.name:18} {1e3 * middle:11.4f} ms ({1e3 * min(times):.4f} to {1e3 * max(times):.4f}), {size};"
            f" {middle / medians[0]:.3g} times reduced, {middle / medians[1]:.3g} times full"
        )
    if missing:
        print("  CalculiX not run: it is not installed (no ccx on the path)")


def main() -> None:
    """Print the real-time factor and the shares, then the other programs beside it."""
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
    side_by_side()


if __name__ == "__main__":
    main()
