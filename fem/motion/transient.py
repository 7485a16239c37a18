"""Time integration of the reduced rig: generalised-alpha for the linear part, implicit contact with a damped residual.

Chung and Hulbert (1993), eqs. 9-17. The flanks carry no mass: their residual flexibility obeys
u + beta u' = R(F), integrated by the second-order backward difference, so contact does not chatter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import lone_approach
from gearbench.fem.contact.law import (
    PAIRS,
    Meetings,
    contact_in,
    coupling,
    find_pairs,
    off_flanks,
    overlaps,
    share_load,
)
from gearbench.fem.contact.static import MARGIN, ContactError, position, solve_torque
from gearbench.fem.motion.machine import (
    Machine,
    angles,
    contact_rows,
    hub_coupling,
    modal_flexibility,
    reaction,
    support_axes,
)
from gearbench.kernels.compiled import compiled
from gearbench.kernels.small import arrow_factor, arrow_solve, arrow_times, plus, times

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """What `advance` hands out; arrays (samples,)."""

    angle_driver: Array  # [rad]
    angle_driven: Array
    y_driver: Array  # [m]
    y_driven: Array
    torque_driven: Array  # [N m]
    loaded: Array  # number of pairs that carry


CHANNELS = len(Samples._fields)


class Scheme(NamedTuple):
    """Generalised-alpha parameters and step [s]."""

    step: float
    alpha_m: float
    alpha_f: float
    gamma: float
    beta: float


class State(NamedTuple):
    """State of the integration at time `t` [s].

    d, v, a, load (d,): unknowns, rates, accelerations and generalised forces; pairs (n,): tooth pairs near contact;
    force [N], residual and older residual [m] (n,) of each.
    """

    t: float
    d: Array
    v: Array
    a: Array
    load: Array
    pairs: Meetings
    force: Array
    residual: Array
    older: Array


class Prediction(NamedTuple):
    """A step without new accelerations, arrays (d,): displacements and rates, the forces that the new accelerations
    must balance, contact's new ones left out, and the diagonal of the effective mass that they act on."""

    d: Array
    v: Array
    rest: Array
    diagonal: Array


class History(NamedTuple):
    """Of pairs (n,): forces [N] and residuals [m] at the last step, and the residual [m] that they carry over."""

    force: Array
    residual: Array
    memory: Array


class Met(NamedTuple):
    """Tooth pairs near contact: contact rows (n, d), overlaps (n,) [m] that rigid motion and modes leave, and residual
    coupling (n, n) [m/N] of the flanks."""

    pairs: Meetings
    rows: Array
    over: Array
    cross: Array


class Stepped(NamedTuple):
    """A step: the new state, the torque on the driven gear [N m], and whether contact was found."""

    state: State
    torque_driven: float
    converged: bool


def make_scheme(step: float, spectral_radius: float) -> Scheme:
    """Second-order generalised-alpha scheme with that spectral radius at infinite frequency."""
    rho = spectral_radius
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    return Scheme(step, alpha_m, alpha_f, 0.5 - alpha_m + alpha_f, 0.25 * (1 - alpha_m + alpha_f) ** 2)


def frequency_error(frequency: float, scheme: Scheme) -> float:
    """Relative error of an undamped oscillator's frequency [Hz] under the scheme."""
    w = 2 * np.pi * frequency
    h = scheme.step
    am, af, g, b = scheme.alpha_m, scheme.alpha_f, scheme.gamma, scheme.beta
    # Unknowns d, v, a of the step; the equation of motion is taken between the old and the new state.
    left = np.array([[1, 0, -b * h * h], [0, 1, -g * h], [(1 - af) * w * w, 0, 1 - am]])
    right = np.array([[1, h, (0.5 - b) * h * h], [0, 1, (1 - g) * h], [-af * w * w, 0, -am]])
    roots = np.linalg.eigvals(np.linalg.solve(left, right))
    root = max(roots, key=lambda r: (abs(r.imag), abs(r)))
    return abs(abs(np.angle(root)) / (w * h) - 1)


def initial_state(machine: Machine, torque: float, t: float = 0.0) -> State:
    """Static equilibrium under a constant driver torque [N m], the gears turning at their nominal speeds."""
    law, r = machine.law, machine.rotations
    size = len(machine.mass)
    d = np.zeros(size)
    k1, k2 = machine.stiffness[r : r + 2]
    phase = machine.speed1 * t / law.driver.pitch
    dte, y = 0.0, np.zeros(2)
    for _ in range(30):
        dte = solve_torque(law, phase, torque, dte, machine.axis_x * y, machine.axis_y * y)
        theta1 = phase * law.driver.pitch + dte / law.driver.rb
        found = position(
            law,
            theta1,
            phase * law.driven.pitch,
            machine.axis_x * y[0],
            machine.axis_y * y[0],
            machine.axis_x * y[1],
            machine.axis_y * y[1],
            np.zeros(PAIRS),
        )
        rows = contact_rows(machine, found.pairs)
        push = rows.T @ found.force
        new = np.array([push[r] / k1, push[r + 1] / k2])
        done = np.max(np.abs(new - y)) <= 1e-9 * np.max(np.abs(new))
        y = new
        if done:
            break
    else:
        raise ContactError(f"no static equilibrium on the supports at {torque:g} N m")
    d[0] = dte / law.driver.rb
    d[r : r + 2] = y
    modes = slice(r + 2, size)
    d[modes] = push[modes] / machine.stiffness[modes]
    load = push.copy()
    load[0] += torque
    if r == 2:
        load[1] -= torque * law.driven.rb / law.driver.rb
    modal = modal_flexibility(rows, machine.stiffness, r + 2)
    overlap = -found.pairs["gap"] - modal @ found.force
    pushed = (coupling(law, found.pairs) - modal) @ found.force
    residual = np.where(found.force > 0.0, overlap, pushed)
    zero = np.zeros(size)
    return State(t, d, zero, zero.copy(), load, found.pairs, found.force, residual, residual.copy())


@compiled
def predict(
    mass: Array, damping: Array, stiffness: Array, corner: Array, scheme: Scheme, state: State, outer: Array
) -> Prediction:
    """What the next step would bring without new accelerations."""
    h, am, af, gamma, beta = scheme.step, scheme.alpha_m, scheme.alpha_f, scheme.gamma, scheme.beta
    late = 1.0 - af
    size = len(mass)
    d, v, rest, diagonal = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    inertia = arrow_times(mass, corner, state.a)
    for i in range(size):
        d[i] = state.d[i] + h * state.v[i] + h * h * (0.5 - beta) * state.a[i]
        v[i] = state.v[i] + h * (1.0 - gamma) * state.a[i]
        rest[i] = late * outer[i] + af * state.load[i] - am * inertia[i]
        rest[i] -= damping[i] * (late * v[i] + af * state.v[i]) + stiffness[i] * (late * d[i] + af * state.d[i])
        diagonal[i] = (1.0 - am) * mass[i] + late * h * (gamma * damping[i] + beta * h * stiffness[i])
    return Prediction(d, v, rest, diagonal)


@compiled
def history(state: State, cross: Array, pairs: Meetings, kappa: float) -> History:
    """What the last step left of the pairs.

    The backward difference of u + beta u' = R is (1 + 3 kappa) u = R + kappa (4 u_1 - u_2), kappa = beta/2h. Pairs
    that are new come with the residual that their neighbours' forces hold them at.
    """
    n = len(cross)
    force, known = np.zeros(n), np.zeros(n, np.bool_)
    residual, memory = np.zeros(n), np.empty(n)
    for p in range(n):
        for q in range(len(state.pairs)):
            if state.pairs[q].side == pairs[p].side and state.pairs[q].tooth == pairs[p].tooth:
                force[p], residual[p], known[p] = state.force[q], state.residual[q], True
                memory[p] = kappa * (4.0 * state.residual[q] - state.older[q])
    for p in range(n):
        if not known[p]:
            for q in range(n):
                residual[p] += cross[p, q] * force[q]
            memory[p] = 3.0 * kappa * residual[p]
        memory[p] /= 1.0 + 3.0 * kappa
    return History(force, residual, memory)


@compiled
def meet(machine: Machine, d: Array, t: float) -> Met:
    """Tooth pairs at the unknowns d."""
    first = machine.rotations + 2
    theta1, theta2 = angles(machine, d, t)
    y = d[first - 1] - d[first - 2]
    dx, dy = machine.law.centre + machine.axis_x * y, machine.axis_y * y
    pairs = find_pairs(machine.law, theta1, theta2, dx, dy, MARGIN)
    n = len(pairs)
    rows = contact_rows(machine, pairs)
    cross, modal = coupling(machine.law, pairs), modal_flexibility(rows, machine.stiffness, first)
    over = overlaps(pairs)
    for p in range(n):
        for k in range(first, len(d)):
            over[p] -= rows[p, k] * d[k]
        for q in range(n):
            cross[p, q] -= modal[p, q]
    return Met(pairs, rows, over, cross)


@compiled
def take_step(machine: Machine, scheme: Scheme, state: State, torque: float) -> Stepped:
    """One step under the driver torque [N m] at its end."""
    h, late, r = scheme.step, 1.0 - scheme.alpha_f, machine.rotations
    square = scheme.beta * h * h
    t = state.t + h
    outer = np.zeros(len(state.d))
    outer[0] = torque
    if r == 2:
        outer[1] = -torque * machine.law.driven.rb / machine.law.driver.rb
    axis1, axis2 = support_axes(machine, *angles(machine, state.d, state.t))
    corner = hub_coupling(machine.hub1, machine.hub2, r, axis1, axis2)
    ahead = predict(machine.mass, machine.damping, machine.stiffness, corner, scheme, state, outer)
    factor = arrow_factor(ahead.diagonal, corner, 1.0 - scheme.alpha_m)
    a = arrow_solve(factor, ahead.diagonal, corner, 1.0 - scheme.alpha_m, ahead.rest)

    met = meet(machine, plus(ahead.d, square, a), t)
    n = len(met.pairs)
    kappa = machine.beta / (2.0 * h)
    gain = 1.0 / (1.0 + 3.0 * kappa)
    past = history(state, met.cross, met.pairs, kappa)
    flexibility = np.empty((n, n))
    moved = [a] * n
    for p in range(n):
        met.over[p] -= past.memory[p]
        moved[p] = arrow_solve(factor, ahead.diagonal, corner, 1.0 - scheme.alpha_m, met.rows[p])
        shift = times(met.rows, moved[p])
        for q in range(n):
            flexibility[p, q] = gain * met.cross[p, q] + square * late * shift[q]
    shared = share_load(machine.law.curves, met.pairs, met.over, flexibility, gain, past.force)
    force = shared.force

    load = outer
    fresh = times(met.cross, force)
    for p in range(n):
        load = plus(load, force[p], met.rows[p])
        a = plus(a, late * force[p], moved[p])
        if force[p] > 0.0:
            approach, _ = lone_approach(machine.law.curves, contact_in(met.pairs, p), force[p])
            fresh[p] += approach
        fresh[p] = past.memory[p] + gain * fresh[p]
    d, v = plus(ahead.d, square, a), plus(ahead.v, h * scheme.gamma, a)
    new = State(t, d, v, a, load, met.pairs, force, fresh, past.residual)
    moment = -outer[1] if r == 2 else reaction(machine.hub2, met.pairs, force, a)
    return Stepped(new, moment, shared.converged)


def advance(
    machine: Machine, scheme: Scheme, state: State, torque: Array, substeps: int
) -> tuple[State, Array, int]:
    """Integrate over len(torque) steps, `torque` being the driver torque at the end of each.

    Returns the state at the end, samples (len(torque)/substeps, CHANNELS) taken after every `substeps` steps, named by
    `columns`, and the step at which contact was not found (-1: none; -2 - n: at step n it left the modelled flanks).
    """
    samples = np.zeros((len(torque) // substeps, CHANNELS))
    state, failed = run(machine, scheme, state, torque, substeps, columns(samples))
    return state, samples, failed


def columns(samples: Array) -> Samples:
    """The columns of samples (..., CHANNELS) by their names."""
    return Samples(*np.moveaxis(samples, -1, 0))


@compiled
def run(
    machine: Machine, scheme: Scheme, state: State, torque: Array, substeps: int, out: Samples
) -> tuple[State, int]:
    """Fill `out` as `advance` says; returns the state at the end and where contact failed."""
    r = machine.rotations
    for i in range(len(torque)):
        step = take_step(machine, scheme, state, torque[i])
        state = step.state
        if not step.converged:
            return state, i
        if (i + 1) % substeps == 0:
            k = (i + 1) // substeps - 1
            theta1, theta2 = angles(machine, state.d, state.t)
            out.angle_driver[k], out.angle_driven[k] = theta1, theta2
            out.y_driver[k], out.y_driven[k] = state.d[r], state.d[r + 1]
            out.torque_driven[k] = step.torque_driven
            apart = state.d[r + 1] - state.d[r]
            dx, dy = machine.law.centre + machine.axis_x * apart, machine.axis_y * apart
            if off_flanks(machine.law, theta1, theta2, dx, dy):
                return state, -2 - i
            for p in range(len(state.pairs)):
                out.loaded[k] += state.force[p] > 0.0
    return state, -1
