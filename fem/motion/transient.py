"""Time integration of the reduced rig: generalised-alpha for the linear part, implicit contact with a damped residual.

Chung and Hulbert (1993), eqs. 9-17. The flanks carry no mass: their residual flexibility obeys
u + beta u' = R(F), integrated by the second-order backward difference, so contact does not chatter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import lone_approach
from gearbench.fem.contact.law import PAIRS, contact_in, coupling, find_pairs, off_flanks, overlaps, share_load
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

CHANNELS = 6  # angle_driver, angle_driven, y_driver, y_driven, torque_driven, number of pairs


class Scheme(NamedTuple):
    """Generalised-alpha parameters and step [s]."""

    step: float
    alpha_m: float
    alpha_f: float
    gamma: float
    beta: float


class State(NamedTuple):
    """State of the integration at time `t` [s].

    d, v, a, load (d,): unknowns, rates, accelerations and generalised forces; sides, teeth (PAIRS,): tooth pairs near
    contact; force [N], residual and older residual [m] of each; pairs: their number.
    """

    t: float
    d: Array
    v: Array
    a: Array
    load: Array
    sides: NDArray[np.int64]
    teeth: NDArray[np.int64]
    force: Array
    residual: Array
    older: Array
    pairs: int


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
        result = position(
            law,
            theta1,
            phase * law.driven.pitch,
            machine.axis_x * y[0],
            machine.axis_y * y[0],
            machine.axis_x * y[1],
            machine.axis_y * y[1],
            np.zeros(PAIRS),
        )
        n, sides, teeth, found, force = result[:5]
        rows = contact_rows(machine, sides, teeth, found, n)
        push = rows.T @ force[:n]
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
    pad = np.zeros(PAIRS)
    residual = pad.copy()
    modal = modal_flexibility(rows, machine.stiffness, r + 2)
    overlap = -found[:n, 0] - modal @ force[:n]
    pushed = (coupling(law, sides, teeth, found, n) - modal) @ force[:n]
    residual[:n] = np.where(force[:n] > 0.0, overlap, pushed)
    padded = pad.copy()
    padded[:n] = force[:n]
    zero = np.zeros(size)
    return State(t, d, zero, zero.copy(), load, sides, teeth, padded, residual, residual.copy(), n)


@compiled
def predict(mass: Array, damping: Array, stiffness: Array, corner: Array, scheme: Scheme, state: State, outer: Array):
    """What the next step would bring without new accelerations: displacements and rates, and the forces that the new
    accelerations must balance (contact's new ones left out); with the diagonal of their effective mass. All (d,)."""
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
    return d, v, rest, diagonal


@compiled
def history(state: State, cross: Array, sides, teeth, kappa: float):
    """Forces and residuals of the listed pairs at the last step, and the residual that they carry over.

    The backward difference of u + beta u' = R is (1 + 3 kappa) u = R + kappa (4 u_1 - u_2), kappa = beta/2h. Pairs
    that are new come with the residual that their neighbours' forces hold them at.
    """
    n = len(cross)
    force, known = np.zeros(n), np.zeros(n, np.bool_)
    residual, memory = np.zeros(n), np.empty(n)
    for p in range(n):
        for q in range(state.pairs):
            if state.sides[q] == sides[p] and state.teeth[q] == teeth[p]:
                force[p], residual[p], known[p] = state.force[q], state.residual[q], True
                memory[p] = kappa * (4.0 * state.residual[q] - state.older[q])
    for p in range(n):
        if not known[p]:
            for q in range(n):
                residual[p] += cross[p, q] * force[q]
            memory[p] = 3.0 * kappa * residual[p]
        memory[p] /= 1.0 + 3.0 * kappa
    return force, residual, memory


@compiled
def padded(values: Array) -> Array:
    """The values, followed by zeros up to PAIRS."""
    out = np.zeros(PAIRS)
    for p in range(len(values)):
        out[p] = values[p]
    return out


@compiled
def meet(machine: Machine, d: Array, t: float):
    """Tooth pairs at the unknowns d: sides, teeth, contacts, number, contact rows, overlaps that rigid motion and
    modes leave (n,) and residual coupling (n, n) of the flanks."""
    first = machine.rotations + 2
    theta1, theta2 = angles(machine, d, t)
    y = d[first - 1] - d[first - 2]
    dx, dy = machine.law.centre + machine.axis_x * y, machine.axis_y * y
    sides, teeth, found, n = find_pairs(machine.law, theta1, theta2, dx, dy, MARGIN)
    rows = contact_rows(machine, sides, teeth, found, n)
    cross, modal = coupling(machine.law, sides, teeth, found, n), modal_flexibility(rows, machine.stiffness, first)
    over = overlaps(found, n)
    for p in range(n):
        for k in range(first, len(d)):
            over[p] -= rows[p, k] * d[k]
        for q in range(n):
            cross[p, q] -= modal[p, q]
    return sides, teeth, found, n, rows, over, cross


@compiled
def take_step(machine: Machine, scheme: Scheme, state: State, torque: float):
    """One step under the driver torque at its end. Returns the new state, the driven gear's torque and success."""
    h, late, r = scheme.step, 1.0 - scheme.alpha_f, machine.rotations
    square = scheme.beta * h * h
    t = state.t + h
    outer = np.zeros(len(state.d))
    outer[0] = torque
    if r == 2:
        outer[1] = -torque * machine.law.driven.rb / machine.law.driver.rb
    axis1, axis2 = support_axes(machine, *angles(machine, state.d, state.t))
    corner = hub_coupling(machine.hub1, machine.hub2, r, axis1, axis2)
    d0, v0, rest, diagonal = predict(machine.mass, machine.damping, machine.stiffness, corner, scheme, state, outer)
    factor = arrow_factor(diagonal, corner, 1.0 - scheme.alpha_m)
    a = arrow_solve(factor, diagonal, corner, 1.0 - scheme.alpha_m, rest)

    sides, teeth, found, n, rows, over, cross = meet(machine, plus(d0, square, a), t)
    kappa = machine.beta / (2.0 * h)
    gain = 1.0 / (1.0 + 3.0 * kappa)
    guess, residual, memory = history(state, cross, sides, teeth, kappa)
    flexibility = np.empty((n, n))
    moved = [a] * n
    for p in range(n):
        over[p] -= memory[p]
        moved[p] = arrow_solve(factor, diagonal, corner, 1.0 - scheme.alpha_m, rows[p])
        shift = times(rows, moved[p])
        for q in range(n):
            flexibility[p, q] = gain * cross[p, q] + square * late * shift[q]
    force, _, _, ok = share_load(machine.law.curves, found, over, flexibility, gain, guess)

    load = outer
    fresh = times(cross, force)
    for p in range(n):
        load = plus(load, force[p], rows[p])
        a = plus(a, late * force[p], moved[p])
        if force[p] > 0.0:
            fresh[p] += lone_approach(machine.law.curves, contact_in(found, p), force[p])[0]
        fresh[p] = memory[p] + gain * fresh[p]
    d, v = plus(d0, square, a), plus(v0, h * scheme.gamma, a)
    new = State(t, d, v, a, load, sides, teeth, padded(force), padded(fresh), padded(residual), n)
    moment = -outer[1] if r == 2 else reaction(machine.hub2, sides, found, force, a, n)
    return new, moment, ok


@compiled
def advance(machine: Machine, scheme: Scheme, state: State, torque: Array, substeps: int):
    """Integrate over len(torque) steps, `torque` being the driver torque at the end of each.

    Returns the state at the end, samples (len(torque)/substeps, CHANNELS) taken after every `substeps` steps, and the
    step at which contact was not found (-1: none; -2 - n: at step n it left the modelled flanks).
    """
    samples = np.zeros((len(torque) // substeps, CHANNELS))
    r = machine.rotations
    for i in range(len(torque)):
        state, moment, ok = take_step(machine, scheme, state, torque[i])
        if not ok:
            return state, samples, i
        if (i + 1) % substeps == 0:
            k = (i + 1) // substeps - 1
            samples[k, 0], samples[k, 1] = angles(machine, state.d, state.t)
            samples[k, 2], samples[k, 3] = state.d[r], state.d[r + 1]
            samples[k, 4] = moment
            y = machine.axis_x * (state.d[r + 1] - state.d[r]), machine.axis_y * (state.d[r + 1] - state.d[r])
            if off_flanks(machine.law, samples[k, 0], samples[k, 1], machine.law.centre + y[0], y[1]):
                return state, samples, -2 - i
            for p in range(state.pairs):
                samples[k, 5] += state.force[p] > 0.0
    return state, samples, -1
