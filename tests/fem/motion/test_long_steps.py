"""Steps far longer than the mesh vibrates: contact is where the gears are, not where they would fly without it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.transient import advance, columns
from gearbench.rig import Simulation, Support, Supports

TORQUE = 300.0


def test_a_slow_mesh_rests_in_long_steps(rig: Any, gear: Any) -> None:
    """Of 14 undercut teeth on a soft support, 0.4 ms each: without contact forces the gears would overlap by 0.4 mm
    within a step. They rest as statics on the supports say, and the force on the driver is its torque over the base
    radius wherever no tip edge bears."""
    side = Support(stiffness=1e8, damping=2e4)
    case = rig(gear(14), gear(20)).model_copy(update={"support": Supports(driver=side, driven=side)})
    machine = machine_for(elastic_rig(case, Simulation(element_size=0.5e-3, modes=4)), 5.0, TORQUE)
    step, count = 4e-4, 500
    start = initial_state(machine, TORQUE)
    _, samples, ran = advance(machine, make_scheme(step, 0.6), start, np.full(count, TORQUE), 1)
    out = columns(samples)
    assert ran.failed == -1 and not out.back.any()
    still = [initial_state(machine, TORQUE, step * (1 + k)).d for k in range(49, count, 50)]
    moved = out.y_driver[49::50]
    assert moved == pytest.approx([d[machine.at.y1] for d in still], rel=2e-3)
    moment = (out.leaving + out.middle + out.entering) * machine.law.driver.rb
    assert np.median(moment) == pytest.approx(TORQUE, rel=1e-4) and np.abs(moment / TORQUE - 1).max() < 0.05
