"""Where the unreduced rig starts: static equilibrium of contact, supports and both meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.law import PAIRS
from gearbench.fem.contact.static import ContactError, position, solve_torque
from gearbench.fem.full.contact import met_pairs
from gearbench.fem.full.machine import Machine
from gearbench.fem.full.transient import Motion, State, outer_load, residual_of

Array = NDArray[np.float64]


def initial_state(machine: Machine, torque: float, t: float = 0.0) -> State:
    """Static equilibrium under a constant driver torque [N m], the gears turning at their nominal speeds.

    Raises ContactError.
    """
    law, r = machine.law, machine.rotations
    phase = machine.speeds[0] * t / law.driver.pitch
    dte, y = 0.0, np.zeros(2)
    for _ in range(30):
        x1, x2 = machine.axis[0] * y
        y1, y2 = machine.axis[1] * y
        dte = solve_torque(law, phase, torque, dte, machine.axis[0] * y, machine.axis[1] * y)
        theta1 = phase * law.driver.pitch + dte / law.driver.rb
        found = position(law, theta1, phase * law.driven.pitch, x1, y1, x2, y2, np.zeros(PAIRS))
        met = met_pairs(machine, found.pairs)
        new = (found.force @ met.rows)[r:] / machine.stiffness[r:]
        done = np.max(np.abs(new - y)) <= 1e-9 * np.max(np.abs(new))
        y = new
        if done:
            break
    else:
        raise ContactError(f"no static equilibrium on the supports at {torque:g} N m")
    push = tuple(on.field(gear.teeth, found.force) for on, gear in zip(met.pressed, machine.gears, strict=True))
    fields = []
    for gear, on in zip(machine.gears, push, strict=True):
        force = np.zeros((gear.mass.shape[0], gear.teeth))
        force[gear.loaded] = on
        fields.append(gear.static.solve(force))
    hub = np.zeros(machine.hubs)
    hub[0], hub[r:] = dte / law.driver.rb, y
    d = Motion(hub, *fields)
    still = Motion(*(np.zeros_like(x) for x in d))
    # A pair that carries nothing rests at the overlap that its neighbours leave it.
    moved = [
        on.moved(field[np.ix_(gear.loaded, on.sectors)])
        for on, field, gear in zip(met.pressed, fields, machine.gears, strict=True)
    ]
    pressed = met.over - moved[0] - moved[1]
    residual = np.where(found.force > 0.0, pressed, residual_of(machine, met, found.force))
    outer, on_hub = outer_load(machine, torque), found.force @ met.rows
    pushes = push[0], push[1]
    return State(t, d, still, still, outer, on_hub, pushes, found.pairs, found.force, residual, residual.copy())
