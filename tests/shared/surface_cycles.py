"""Static transmission error over a mesh cycle by contact of the elements' own surfaces, beside the contact law's."""

from __future__ import annotations

import time
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig, elastic_rig
from gearbench.bench.full.run import full_gears, full_machine
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.full import record, start
from gearbench.fem.full.penalty import at_rest
from gearbench.fem.full.transient import make_integrator
from gearbench.fem.motion.scheme import make_scheme
from gearbench.rig import Case, read_case

Array = NDArray[np.float64]

# 20/20 teeth of 3 mm, 20 mm wide, centres held.
CASE = Path(__file__).parents[1] / "validation" / "calculix" / "torque_step.toml"


class Cycle(NamedTuple):
    """Transmission error [m] at phases [cycles], by surfaces and by the law, unknowns, and seconds that preparing and a
    step of either take."""

    phase: Array
    surfaces: Array
    law: Array
    unknowns: int
    prepared: float
    step: float
    law_step: float

    @property
    def off(self) -> Array:
        """Relative difference at each phase."""
        return np.asarray(self.surfaces / self.law - 1)


@cache
def rig() -> tuple[Case, ElasticRig]:
    """The case and its contact law."""
    case = read_case(CASE)
    return case, elastic_rig(case.rig, case.simulation)


@cache
def cycle(element_size: float, torque: float, positions: int) -> Cycle:
    """A mesh cycle on elements of that size [m] on the flanks, under a driver torque [N m]."""
    case, elastic = rig()
    began = time.process_time()
    gears = full_gears(case.rig, case.simulation.model_copy(update={"element_size": element_size}), lambda note: None)
    machines = [full_machine(elastic, gears, 1.0, surfaces) for surfaces in (True, False)]
    prepared = time.process_time() - began
    phase = np.arange(positions) / positions - 0.5
    radius = elastic.pair.driver.base_radius
    found = np.array([radius * at_rest(machines[0], torque, float(t)).angle for t in phase])
    law = static_cycle(elastic.law, phase, torque=[torque]).transmission_error[0]
    steps = []
    for machine in machines:
        integrator, state = make_integrator(machine, make_scheme(1e-5, 0.9)), start.initial_state(machine, torque)
        state = record.advance(integrator, state, np.full(2, torque)).state
        began = time.process_time()
        record.advance(integrator, state, np.full(5, torque))
        steps.append((time.process_time() - began) / 5)
    return Cycle(phase, found, law, machines[0].unknowns, prepared, *steps)
