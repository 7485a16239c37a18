"""Time integration of the reduced rig: from static equilibrium on, step by step, samples taken on the way."""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import largest_force
from gearbench.fem.contact.law import off_flanks
from gearbench.fem.motion.machine import Machine, angles, centres, pace
from gearbench.fem.motion.scheme import Scheme
from gearbench.fem.motion.stage import Room, Stage, make_room, make_stage
from gearbench.fem.motion.start import State
from gearbench.fem.motion.step import Tried, torques, try_step
from gearbench.kernels.borrowed import borrowed
from gearbench.kernels.compiled import INLINED, compile_like, compiled

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """What `advance` hands out; arrays (samples,)."""

    angle_driver: Array  # [rad]
    angle_driven: Array
    y_driver: Array  # [m]
    y_driven: Array
    x_driver: Array  # [m]; 0 where the centres do not move across their supports
    x_driven: Array
    housing: Array  # both its motions [m]; 0 where it has none
    rocking: Array
    torque_driver: Array  # that holds the driver at its speed [N m], where that is prescribed
    torque_driven: Array  # [N m]
    loaded: Array  # number of pairs that carry
    divided: Array  # number of steps, of those that lead here, that had to be divided
    leaving: Array  # force of the working flanks [N] of the pair that has passed the pitch point by a pitch or so
    middle: Array  # of the pair nearest the pitch point
    entering: Array  # of the pair that comes to it next
    back: Array  # of all back flanks
    strayed: Array  # 1 where teeth overlap beyond the modelled flanks, or press harder than modelled


CHANNELS = len(Samples._fields)
PARTS = 256  # into which a step is divided where contact is not found


class Run(NamedTuple):
    """Where an integration has come to, and how: time and last step [s], driver torque [N m], tooth pairs near contact;
    the step at which contact was not found (-1: none); off: whether it left the modelled flanks at a sample."""

    t: float
    lately: float
    torque: float
    pairs: int
    failed: int
    off: bool


class Stepped(NamedTuple):
    """A step: the new state, the torque on the driven gear [N m], and whether contact was found."""

    state: State
    torque_driven: float
    converged: bool


def staged(state: State) -> Stage:
    """The stage of a state, to step from."""
    stage, n = make_stage(len(state.d)), len(state.pairs)
    stage.d[:], stage.v[:], stage.a[:], stage.load[:] = state.d, state.v, state.a, state.load
    stage.pairs[:n], stage.force[:n], stage.before[:n] = state.pairs, state.force, state.before
    stage.residual[:n], stage.older[:n] = state.residual, state.older
    return stage


def state_of(stage: Stage, run: Run) -> State:
    """The state that a stage is at the end of a run."""
    n = run.pairs
    return State(
        t=run.t,
        d=stage.d.copy(),
        v=stage.v.copy(),
        a=stage.a.copy(),
        load=stage.load.copy(),
        pairs=stage.pairs[:n].copy(),
        force=stage.force[:n].copy(),
        before=stage.before[:n].copy(),
        residual=stage.residual[:n].copy(),
        older=stage.older[:n].copy(),
        lately=run.lately,
        torque=run.torque,
    )


def take_step(machine: Machine, scheme: Scheme, state: State, torque: float) -> Stepped:
    """One step under the driver torque [N m] at its end."""
    new, samples, run = advance(machine, scheme, state, np.array([torque]), 1)
    return Stepped(new, float(columns(samples).torque_driven[0]), run.failed < 0)


def advance(machine: Machine, scheme: Scheme, state: State, torque: Array, substeps: int) -> tuple[State, Array, Run]:
    """Integrate over len(torque) steps, `torque` being the driver torque at the end of each.

    Returns the state at the end, samples (len(torque)/substeps, CHANNELS) taken after every `substeps` steps, named by
    `columns`, and how the run went. Where contact is not found in a step, that step is halved, and its halves again,
    down to one part of PARTS, the torque in between being interpolated.
    """
    # Every column in one piece, however many rows: other strides would be compiled anew.
    samples = np.zeros((CHANNELS, len(torque) // substeps)).T
    stages = staged(state), make_stage(len(state.d))
    begin = Run(state.t, state.lately, state.torque, len(state.pairs), -1, False)
    run = integrate(machine, scheme, *stages, begin, torque, substeps, columns(samples), make_room(machine))
    return state_of(stages[0], run), samples, run


def compile_for(machine: Machine, scheme: Scheme) -> None:
    """Compile what `advance` calls for machines like this one, without a step."""
    unknowns, samples = len(machine.mass), np.zeros((CHANNELS, 1)).T
    stages, begin = (make_stage(unknowns), make_stage(unknowns)), Run(0.0, 0.0, 0.0, 0, -1, False)
    called = machine, scheme, *stages, begin, np.zeros(1), 1, columns(samples), make_room(machine)
    compile_like(integrate, called)


def columns(samples: Array) -> Samples:
    """The columns of samples (..., CHANNELS) by their names."""
    return Samples(*np.moveaxis(samples, -1, 0))


@compiled(**INLINED)
def take_over(new: Stage, old: Stage, n: int) -> None:
    """Write a new stage with n pairs over the old one."""
    for i in range(len(new.d)):
        old.d[i] = new.d[i]
    for i in range(len(new.d)):
        old.v[i] = new.v[i]
    for i in range(len(new.d)):
        old.a[i] = new.a[i]
    for i in range(len(new.d)):
        old.load[i] = new.load[i]
    for p in range(n):
        old.pairs[p] = new.pairs[p]
        old.force[p], old.before[p], old.residual[p], old.older[p] = (
            new.force[p], new.before[p], new.residual[p], new.older[p],
        )  # fmt: skip


@compiled(**INLINED)
def sample(machine: Machine, now: Stage, run: Run, room: Room, k: int, out: Samples) -> bool:
    """Fill row k of `out`; whether contact is off the modelled flanks, or its forces beyond the modelled loads."""
    at = machine.at
    theta1, theta2 = angles(machine, now.d, run.t)
    out.angle_driver[k], out.angle_driven[k] = theta1, theta2
    out.y_driver[k], out.y_driven[k] = now.d[at.y1], now.d[at.y2]
    if at.x1 >= 0:
        out.x_driver[k], out.x_driven[k] = now.d[at.x1], now.d[at.x2]
    if at.housing >= 0:
        out.housing[k] = now.d[at.housing]
    if at.rocking >= 0:
        out.rocking[k] = now.d[at.rocking]
    held = torques(machine, now, run.pairs, run.torque, pace(machine, run.t), room)
    out.torque_driver[k], out.torque_driven[k] = held.driver, held.driven
    nearest = floor(theta2 / machine.law.driven.pitch + 0.5)
    most, hardest = largest_force(machine.law.curves.driver), 0.0
    for p in range(run.pairs):
        force = now.force[p]
        hardest = max(hardest, force)
        out.loaded[k] += force > 0.0
        if now.pairs[p].side == 1:
            out.back[k] += force
        elif now.pairs[p].tooth < nearest:
            out.leaving[k] += force
        elif now.pairs[p].tooth > nearest:
            out.entering[k] += force
        else:
            out.middle[k] += force
    apart = centres(machine, now.d)
    off = hardest > most or off_flanks(machine.law, theta1, theta2, apart.x, apart.y)
    out.strayed[k] = off
    return off


@compiled(**INLINED)
def part_of(scheme: Scheme, part: float) -> Scheme:
    """The scheme with so small a part of its step."""
    return Scheme(part * scheme.step, scheme.alpha_m, scheme.alpha_f, scheme.gamma, scheme.beta)


@compiled
def integrate(
    machine: Machine, scheme: Scheme, now: Stage, new: Stage, begin: Run, torque: Array, substeps: int, out: Samples,
    room: Room,
) -> Run:  # fmt: skip
    """Fill `out` as `advance` says; `now` is the stage at the beginning and becomes that at the end."""
    machine, now, new, room, out = borrowed(machine), borrowed(now), borrowed(new), borrowed(room), borrowed(out)
    t, lately, before, pairs, divided, off = begin.t, begin.lately, begin.torque, begin.pairs, 0, False
    for i in range(len(torque)):
        tried = Tried(False, 0)
        # Parts of the step: what is done of it, and what is tried next.
        done, part, whole = 0, PARTS, True
        while done < PARTS:
            share = part / PARTS
            at = torque[i] if part == PARTS else before + (torque[i] - before) * ((done + part) / PARTS)
            tried = try_step(machine, part_of(scheme, share), now, pairs, new, t, lately, at, room)
            if tried.found:
                pairs, t, lately = tried.pairs, t + share * scheme.step, share * scheme.step
                take_over(new, now, pairs)
                done += part
                if part < PARTS and done % (2 * part) == 0:
                    part *= 2
            elif part > 1:
                part //= 2
                divided += whole
                whole = False
            else:
                return Run(t, lately, before, pairs, i, off)
        before = torque[i]
        if (i + 1) % substeps == 0:
            run, k = Run(t, lately, before, pairs, -1, off), (i + 1) // substeps - 1
            out.divided[k], divided = divided, 0
            off = sample(machine, now, run, room, k, out) or off
    return Run(t, lately, before, pairs, -1, off)
