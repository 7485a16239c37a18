"""Wall times that have a reach, on one core of this machine; medians of repeated runs."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.linear.run import tables_for
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.schedule import schedule
from gearbench.cases import case_path
from gearbench.commands.house.checks import Check
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.store import stored_gear
from gearbench.geometry import pair
from gearbench.lumped import lumped_model
from gearbench.lumped.linear.runge_kutta import integrate
from gearbench.rig import read_case

LUMPED_STEPS = 100 * 4 * 2**17 * 4


def median_time(job: Callable[[], object], repeats: int = 3) -> float:
    """Median wall time of a job [s]."""
    spent = []
    for _ in range(repeats):
        before = time.perf_counter()
        job()
        spent.append(time.perf_counter() - before)
    return float(np.median(spent))


@contextmanager
def empty_cache() -> Iterator[None]:
    """A cache folder of its own."""
    before = os.environ.get("GEARBENCH_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["GEARBENCH_CACHE"] = folder
        try:
            yield
        finally:
            if before is None:
                del os.environ["GEARBENCH_CACHE"]
            else:
                os.environ["GEARBENCH_CACHE"] = before


def condensation() -> float:
    """Mesh and condensation of both gears of paper_fe, nothing cached."""
    case = read_case(case_path("paper_fe"))

    def both() -> None:
        for gear in (case.rig.driver, case.rig.driven):
            with empty_cache():
                stored_gear(gear, case.rig.material)

    return median_time(both)


def from_cache() -> float:
    """The same from the cache."""
    case = read_case(case_path("paper_fe"))

    def both() -> None:
        for gear in (case.rig.driver, case.rig.driven):
            stored_gear(gear, case.rig.material)

    with empty_cache():
        both()
        return median_time(both)


def mesh_cycle() -> float:
    """64 static positions after condensation."""
    case = read_case(case_path("paper_fe"))
    law = elastic_rig(case.rig, case.simulation).law
    phases = np.arange(64) / 64
    static_cycle(law, phases[:1], torque=[100.0])
    return median_time(lambda: static_cycle(law, phases, torque=[100.0]))


def harris_map() -> float:
    """64 static positions at each of 12 loads, after condensation."""
    case = read_case(case_path("paper_fe"))
    law = elastic_rig(case.rig, case.simulation).law
    phases, loads = np.arange(64) / 64, np.linspace(10.0, 400.0, 12).tolist()
    static_cycle(law, phases[:1], torque=[100.0])
    return median_time(lambda: static_cycle(law, phases, torque=loads))


def lumped_steps() -> float:
    """210 million Runge-Kutta steps of paper_lumped, scaled up from a tenth of them."""
    case = read_case(case_path("paper_lumped"))
    plan = schedule(case.experiment, case.rig)
    meshing = pair(case.rig)
    model = lumped_model(case.rig, meshing, case.simulation)
    tables = tables_for(model, plan, 4)
    torque = torque_realisation(case.experiment, 0, case.rig).sample(8 * plan.samples_per_period)
    force = torque / meshing.driver.base_radius
    start = model.equilibrium(float(force.mean()))
    integrate(tables, force, start, samples=1, substeps=4)
    blocks = 10 * case.experiment.periods

    def job() -> None:
        state = start
        for _ in range(blocks):
            state, _ = integrate(tables, force, state, samples=plan.samples_per_period, substeps=4)

    return median_time(job, 1) * LUMPED_STEPS / (blocks * plan.samples_per_period * 4)


CHECKS = [
    Check("time-condensation", "mesh and condensation of both gears at default", 4.0, "s", condensation),
    Check("time-cache", "the same from the cache", 0.2, "s", from_cache),
    Check("time-static-cycle", "static mesh cycle of 64 positions", 0.3, "s", mesh_cycle),
    Check("time-harris-map", "static map of 64 positions x 12 loads", 3.0, "s", harris_map),
    Check("time-lumped", "210 million Runge-Kutta steps", 40.0, "s", lumped_steps),
]
