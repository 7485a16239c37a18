"""Where an integration begins: static equilibrium of the reduced rig."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.coupling import coupling
from gearbench.fem.contact.law import PAIRS, Meetings
from gearbench.fem.contact.static import ContactError, position, solve_torque
from gearbench.fem.motion.hubs import ABSENT, Unknowns, hubs_at_rest, spring_force
from gearbench.fem.motion.imposed import common_excess, hardened, stiffness_factor
from gearbench.fem.motion.machine import Machine, contact_rows, modal_flexibility
from gearbench.rig.lengths import length_words

Array = NDArray[np.float64]


class State(NamedTuple):
    """State of the integration at time `t` [s].

    d, v, a, load (d,): unknowns, rates, accelerations and generalised forces; pairs (n,): tooth pairs near contact; of
    each (n,): force, its value a step before [N], residual and its value a step before [m]; lately [s]: that step, 0 at
    rest; torque [N m]: the driver's.
    """

    t: float
    d: Array
    v: Array
    a: Array
    load: Array
    pairs: Meetings
    force: Array
    before: Array
    residual: Array
    older: Array
    lately: float
    torque: float


class Pressed(NamedTuple):
    """The mesh at rest: what the driver's rotation adds to the DTE [m], that of the law alone, pairs, their forces [N]
    and what the law's flexibility yields to them besides their own curves [m]."""

    turned: float
    dte: float
    pairs: Meetings
    force: Array
    yielded: Array


def _pressed(machine: Machine, phase: float, torque: float, guess: float, hub: Array, t: float) -> Pressed:
    """The mesh at rest under a driver torque [N m] at a mesh phase [cycles] of the driven gear."""
    law, at = machine.law, machine.at
    along = hub[[at.y1, at.y2]]
    across = hub[[at.x1, at.x2]] if at.x1 != ABSENT else np.zeros(2)
    x, y = machine.axis_x * along + machine.axis_y * across, machine.axis_y * along - machine.axis_x * across
    factor = stiffness_factor(machine.correction, phase, t)
    factor = hardened(machine.correction, factor, torque / law.driver.rb)
    # A factor on the mesh force is a law under so much smaller a load; an excess turns the driver back.
    dte = solve_torque(law, phase, torque / factor, guess, x, y)
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    found = position(law, theta1, phase * law.driven.pitch, x[0], y[0], x[1], y[1], np.zeros(PAIRS))
    yielded = coupling(law, found.pairs) @ found.force
    excess = common_excess(machine.correction, phase).value
    return Pressed(dte - excess, dte, found.pairs, factor * found.force, yielded)


def initial_state(machine: Machine, torque: float, t: float = 0.0) -> State:
    """Static equilibrium without friction and ripple under a constant driver torque [N m], the gears turning at their
    nominal speeds. Raises ContactError."""
    law, at = machine.law, machine.at
    hub, dte = np.zeros(machine.hubs), 0.0
    phase = machine.speed2 * t / law.driven.pitch
    for _ in range(50):
        try:
            mesh = _pressed(machine, phase, torque, dte, hub, t)
        except ContactError as error:
            raise yielding(_moved(at, hub), torque, error) from None
        dte = mesh.dte
        rows = contact_rows(machine, mesh.pairs)
        push = rows.T @ mesh.force
        new = hubs_at_rest(machine.hub_stiffness, machine.springs, at, machine.held, push[: machine.hubs])
        there = _mesh_phase(machine, phase, mesh.turned, push, torque, t)
        settled = np.abs(new - hub).max() <= 1e-9 * np.abs(new).max() and abs(there - phase) <= 1e-10
        hub, phase = new, there
        if settled:
            break
    else:
        raise ContactError(f"no static equilibrium on the supports at {torque:g} N m")
    d = np.concatenate([hub, push[machine.hubs :] / machine.squares])
    _turn(machine, d, phase, mesh.turned, torque, push, t)
    load = push.copy()
    if machine.driven_at != ABSENT:
        load[machine.driven_at] += torque
    if machine.loaded_at != ABSENT:
        load[machine.loaded_at] -= push[at.driven]
    load[: machine.hubs] -= spring_force(machine.springs, d)
    modal = modal_flexibility(machine, rows) @ mesh.force
    residual = np.where(mesh.force > 0.0, -mesh.pairs["gap"], mesh.yielded) - modal
    still, force, again = np.zeros(len(d)), mesh.force, residual.copy()
    return State(t, d, still, still, load, mesh.pairs, force, force, residual, again, lately=0.0, torque=torque)


def _moved(at: Unknowns, hub: Array) -> float:
    """Largest motion [m] of a gear's centre."""
    centres = [at.y1, at.y2] + ([at.x1, at.x2] if at.x1 != ABSENT else [])
    return float(np.abs(hub[centres]).max())


def yielding(moved: float, torque: float, error: ContactError) -> ContactError:
    """The error of a mesh at rest of which a gear's centre has moved so far [m] on its support."""
    if moved == 0.0:
        return error
    return ContactError(
        f"experiment.torque_mean_nm = {torque:g} moves a gear's centre by {length_words(moved)} on its support"
        " (rig.support), where the flanks find no rest: lower it, or raise the support's stiffness_n_per_m"
    )


def _mesh_phase(machine: Machine, phase: float, turned: float, push: Array, torque: float, t: float) -> float:
    """Mesh phase [cycles] at which the mesh stands: where an end's speed is prescribed, shafts twist from there."""
    law = machine.law
    if machine.driven_at == ABSENT:
        twist = torque / machine.drive_shaft[0] if machine.drive_shaft[0] else 0.0
        return (machine.speed1 * t - twist - turned / law.driver.rb) / law.driver.pitch
    if machine.loaded_at == ABSENT and machine.load_shaft[0]:
        return (machine.speed2 * t + float(push[machine.at.driven]) / machine.load_shaft[0]) / law.driven.pitch
    return phase


def _turn(
    machine: Machine, d: Array, phase: float, turned: float, torque: float, push: Array, t: float
) -> None:
    """Write the rotations at rest into d."""
    law, at = machine.law, machine.at
    off = phase - machine.speed2 * t / law.driven.pitch
    d[at.driver] = 0.0 if machine.held[at.driver] else off * law.driver.pitch + turned / law.driver.rb
    if at.driven != ABSENT:
        d[at.driven] = off * law.driven.pitch
    stiffness = -machine.hub_stiffness
    if at.drive_end != ABSENT:
        d[at.drive_end] = d[at.driver] + torque / stiffness[at.driver, at.drive_end]
    if at.load_end != ABSENT:
        d[at.load_end] = d[at.driven] - push[at.driven] / stiffness[at.driven, at.load_end]
