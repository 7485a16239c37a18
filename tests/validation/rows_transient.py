"""The reduced transient: quasi-static limit, order of integration, speed."""

from __future__ import annotations

import time
from functools import cache
from math import cos

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig, elastic_rig, machine_for
from gearbench.commands.house.checks import Check
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.transient import advance, columns
from gearbench.rig import Gear, Rig, Simulation, Support, Supports

Array = NDArray[np.float64]

GEAR = Gear(
    teeth=40, module=2e-3, profile_shift=0.1, face_width=0.02, hub_radius=0.018, thinning=50e-6, inertia=4e-3
)


@cache
def elastic(stiffness: float, damping: float) -> ElasticRig:
    """A 40/40 pair on supports of that stiffness [N/m] and damping [N s/m]."""
    support = Support(stiffness=stiffness, damping=damping)
    rig = Rig(driver=GEAR, driven=GEAR, support=Supports(driver=support, driven=support))
    return elastic_rig(rig, Simulation())


def quasi_static() -> float:
    """Largest difference of the slow transient's DTE from the static TE, over the static TE.

    Stiff supports, because the static analysis holds the centres; half a mesh period a second.
    """
    bench = elastic(1e11, 1e5)
    rate, substeps, frequency, torque = 1024.0, 8, 0.5, 60.0
    machine = machine_for(bench, frequency)
    state = initial_state(machine, torque)
    steps = int(rate / frequency)
    _, samples, run = advance(
        machine, make_scheme(1 / (rate * substeps), 0.8), state, np.full(steps * substeps, torque), substeps
    )
    assert run.failed < 0
    law = bench.law
    along = cos(bench.pair.working_pressure_angle)
    seen = columns(samples)
    dte = (
        law.driver.rb * seen.angle_driver
        - law.driven.rb * seen.angle_driven
        + along * (seen.y_driver - seen.y_driven)
    )
    chosen = np.arange(15, steps, 16)
    phases = frequency * (chosen + 1) / rate
    still = static_cycle(law, phases, torque=[torque]).transmission_error[0]
    return float(np.abs(dte[chosen] / still - 1).max())


def end_state(steps: int, duration: float = 4e-3) -> Array:
    """Unknowns after `duration` [s] under a torque that swells and ebbs, in `steps` steps; one pair in contact."""
    bench = elastic(5e7, 2e3)
    machine = machine_for(bench, 5.0)
    torque = 60.0
    scheme = make_scheme(duration / steps, 0.8)
    at = np.arange(1, steps + 1) / steps
    varying = torque * (1 + 0.2 * np.sin(np.pi * at) ** 2 * np.sin(8 * np.pi * at))
    state, _, run = advance(machine, scheme, initial_state(machine, torque), varying, 1)
    assert run.failed < 0
    return np.asarray(state.d[:3])


def integration_order() -> float:
    """Observed order of the driver's angle when the step is halved."""
    fine = end_state(16384)
    errors = [np.abs(end_state(n) - fine)[0] for n in (512, 1024, 2048)]
    return float(min(np.log2(errors[0] / errors[1]), np.log2(errors[1] / errors[2])))


def real_time() -> float:
    """Seconds of rig time per second, at 65 536 steps per second of rig time, on one core."""
    bench = elastic(6e6, 8e4)
    machine = machine_for(bench, 20.0)
    scheme = make_scheme(1 / 65536, 0.9)
    torque = np.full(65536 // 2, 2.0)
    state = initial_state(machine, 2.0)
    advance(machine, scheme, state, torque[:64], 8)
    spent = []
    for _ in range(3):
        before = time.perf_counter()
        advance(machine, scheme, state, torque, 8)
        spent.append(time.perf_counter() - before)
    return 0.5 / float(np.median(spent))


CHECKS = [
    Check("transient-quasi-static", "slow transient against static TE", 1e-3, "", quasi_static),
    Check("transient-order", "order of the time integration", 1.9, "", integration_order, least=True),
    Check(
        "transient-real-time",
        "rig time over wall time, 65 536 steps a second",
        1.0,
        "",
        real_time,
        least=True,
    ),
]
