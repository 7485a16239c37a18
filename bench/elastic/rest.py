"""Whether the mean torque alone takes contact off the modelled flanks: found before anything is integrated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import beside_rest
from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import Schedule
from gearbench.fem.contact.law import off_flanks
from gearbench.fem.motion.hubs import ABSENT
from gearbench.fem.motion.machine import Machine, angles, centres
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.transient import CHANNELS, columns
from gearbench.rig.lengths import length_words

Array = NDArray[np.float64]
Dte = Callable[[Array], Array]

POSITIONS = 32  # of a mesh period, in as many different ones as there are
# Departure of the mesh's answer at the mesh frequency from that at rest, up to which teeth pass through the positions
# of rest: that of a single vibration three times as fast.
SLOW = 1 / 8


class Rest(NamedTuple):
    """The mesh at rest at a mesh phase [cycles]: its DTE [m], and whether contact lies on the modelled flanks."""

    phase: float
    dte: float
    modelled: bool


def check_rest(machine: Machine, dte: Dte, torque: float, plan: Schedule) -> None:
    """Raise BenchError where gears that turn slowly are taken off the modelled flanks by the mean torque [N m]; `dte`
    of outputs, as the model's. Raises ContactError where there is no rest.

    Where they turn faster, inertia evens the DTE out: only the motion itself tells, unless no position is modelled.
    """
    slow = beside_rest(machine, torque, 0.0, 1.0 / plan.shortest_mesh_period) <= SLOW
    if not slow and any(rest.modelled for rest in _positions(machine, dte, torque, plan)):
        return
    for rest in _positions(machine, dte, torque, plan):
        where = f"experiment.torque_mean_nm = {torque:g} at rest, at mesh phase {rest.phase:.4g},"
        if not rest.modelled:
            raise BenchError(f"{where} takes contact off the modelled flanks (DTE {length_words(rest.dte)}): lower it")


def _positions(machine: Machine, dte: Dte, torque: float, plan: Schedule) -> Iterator[Rest]:
    """One position after the other of a mesh period, each in the next of those periods that differ."""
    law, at = machine.law, machine.at
    periods = min(plan.repeat_cycles, POSITIONS)
    for number in range(POSITIONS):
        cycles = number / POSITIONS + number % periods * (plan.repeat_cycles // periods)
        t = cycles / plan.mesh_frequency
        d = initial_state(machine, torque, t).d
        theta1, theta2 = angles(machine, d, t)
        outputs = np.zeros((1, CHANNELS))
        out = columns(outputs)
        out.angle_driver[0], out.angle_driven[0] = theta1, theta2
        out.y_driver[0], out.y_driven[0] = d[at.y1], d[at.y2]
        if at.x1 != ABSENT:
            out.x_driver[0], out.x_driven[0] = d[at.x1], d[at.x2]
        apart = centres(machine, d)
        modelled = not off_flanks(law, theta1, theta2, apart.x, apart.y)
        yield Rest(theta2 / law.driven.pitch, float(dte(outputs)[0]), modelled)
