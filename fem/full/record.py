"""What a run of the unreduced rig hands out, sample by sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import largest_force
from gearbench.fem.contact.law import off_flanks
from gearbench.fem.full.machine import angles
from gearbench.fem.full.transient import Integrator, State, take_step

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """Channels of a run; arrays (samples,)."""

    angle_driver: Array  # [rad]
    angle_driven: Array
    y_driver: Array  # [m]
    y_driven: Array
    torque_driven: Array  # [N m]
    loaded: Array  # number of pairs that carry
    leaving: Array  # force of the working flanks [N] of the pair that has passed the pitch point by a pitch or so
    middle: Array  # of the pair nearest the pitch point
    entering: Array  # of the pair that comes to it next
    back: Array  # of all back flanks
    strayed: Array  # 1 where teeth overlap beyond the modelled flanks, or press harder than modelled


CHANNELS = len(Samples._fields)


class Run(NamedTuple):
    """The state at the end, samples (n, CHANNELS); whether contact was not found, which ends a run, and whether it left
    the modelled flanks at a sample."""

    state: State
    samples: Array
    lost: bool
    off: bool


def columns(samples: Array) -> Samples:
    """The columns of samples (..., CHANNELS) by their names."""
    return Samples(*np.moveaxis(samples, -1, 0))


def advance(integrator: Integrator, state: State, torque: Array, substeps: int = 1) -> Run:
    """Integrate over len(torque) steps, `torque` [N m] being the driver torque at the end of each; a sample is taken
    after every `substeps` steps."""
    machine = integrator.machine
    r = machine.rotations
    samples = np.zeros((len(torque) // substeps, CHANNELS))
    out, most = columns(samples), largest_force(machine.law.curves.driver)
    for i, value in enumerate(torque):
        step = take_step(integrator, state, float(value))
        state = step.state
        if not step.converged:
            return Run(state, samples, True, bool(out.strayed.any()))
        if (i + 1) % substeps:
            continue
        k, hub, at = i // substeps, state.d.hub, angles(machine, state.d.hub, state.t)
        out.angle_driver[k], out.angle_driven[k] = at
        out.y_driver[k], out.y_driven[k] = hub[r], hub[r + 1]
        out.torque_driven[k] = step.torque_driven
        out.loaded[k] = len(np.unique(state.pairs[["side", "tooth"]][state.force > 0.0]))
        apart = state.pairs["tooth"] - np.floor(at.driven / machine.law.driven.pitch + 0.5)
        working = state.pairs["side"] == 0
        for name, chosen in (("leaving", apart < 0), ("middle", apart == 0), ("entering", apart > 0)):
            getattr(out, name)[k] = state.force[working & chosen].sum()
        out.back[k] = state.force[~working].sum()
        dx, dy = machine.axis * (hub[r + 1] - hub[r])
        off = off_flanks(machine.law, at.driver, at.driven, machine.law.centre + dx, dy)
        out.strayed[k] = off or state.force.max(initial=0.0) > most
    return Run(state, samples, False, bool(out.strayed.any()))
