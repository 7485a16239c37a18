"""Where the unreduced rig starts: static equilibrium of contact, supports and both meshes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.law import PAIRS
from gearbench.fem.contact.static import ContactError, position, solve_torque
from gearbench.fem.full.contact import Met, met_pairs
from gearbench.fem.full.machine import Machine
from gearbench.fem.full.penalty import at_rest
from gearbench.fem.full.transient import Motion, State, outer_load, residual_of
from gearbench.fem.motion.start import yielding

Array = NDArray[np.float64]


class Rest(NamedTuple):
    """Static equilibrium: the driver's rotation beyond its nominal one [rad], support motions (2,) [m], where pairs
    meet and their forces (n,) [N]."""

    angle: float
    y: Array
    met: Met
    force: Array


def initial_state(machine: Machine, torque: float, t: float = 0.0) -> State:
    """Static equilibrium under a constant driver torque [N m], the gears turning at their nominal speeds.

    Raises ContactError.
    """
    angle, y, met, on_pairs = (_surfaces_at_rest if machine.surfaces else _law_at_rest)(machine, torque, t)
    r = machine.rotations
    push = tuple(on.field(gear.teeth, on_pairs) for on, gear in zip(met.pressed, machine.gears, strict=True))
    fields = []
    for gear, on in zip(machine.gears, push, strict=True):
        force = np.zeros((gear.mass.shape[0], gear.teeth))
        force[gear.loaded] = on
        fields.append(gear.static.solve(force))
    hub = np.zeros(machine.hubs)
    hub[0], hub[r:] = angle, y
    d = Motion(hub, *fields)
    still = Motion(*(np.zeros_like(x) for x in d))
    residual = np.zeros(len(on_pairs)) if machine.surfaces else _residual(machine, met, on_pairs, fields)
    outer, on_hub = outer_load(machine, torque), on_pairs @ met.rows
    return State(t, d, still, still, outer, on_hub, (push[0], push[1]), met.pairs, on_pairs, residual, residual.copy())


def _surfaces_at_rest(machine: Machine, torque: float, t: float) -> Rest:
    found = at_rest(machine, torque, t)
    return Rest(found.angle, found.y, found.touching.met, found.force)


def _law_at_rest(machine: Machine, torque: float, t: float) -> Rest:
    law, r = machine.law, machine.rotations
    phase = machine.speeds[0] * t / law.driver.pitch
    dte, y = 0.0, np.zeros(2)
    for _ in range(30):
        x1, x2 = machine.axis[0] * y
        y1, y2 = machine.axis[1] * y
        try:
            dte = solve_torque(law, phase, torque, dte, machine.axis[0] * y, machine.axis[1] * y)
        except ContactError as error:
            raise yielding(float(np.abs(y).max()), torque, error) from None
        theta1 = phase * law.driver.pitch + dte / law.driver.rb
        found = position(law, theta1, phase * law.driven.pitch, x1, y1, x2, y2, np.zeros(PAIRS))
        met = met_pairs(machine, found.pairs)
        new = (found.force @ met.rows)[r:] / machine.stiffness[r:]
        done = np.max(np.abs(new - y)) <= 1e-9 * np.max(np.abs(new))
        y = new
        if done:
            return Rest(dte / law.driver.rb, y, met, found.force)
    raise ContactError(f"no static equilibrium on the supports at {torque:g} N m")


def _residual(machine: Machine, met: Met, force: Array, fields: list[Array]) -> Array:
    """Residual approach (n,) [m] of the pairs: one that carries nothing rests at the overlap that its neighbours leave
    it."""
    moved = [
        on.moved(field[np.ix_(gear.loaded, on.sectors)])
        for on, field, gear in zip(met.pressed, fields, machine.gears, strict=True)
    ]
    return np.where(force > 0.0, met.over - moved[0] - moved[1], residual_of(machine, met, force))
