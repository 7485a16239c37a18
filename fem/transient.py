"""Time integration of the reduced rig: generalised-alpha for the linear part, implicit contact with a damped residual.

Chung and Hulbert (1993), eqs. 9-17. The flanks carry no mass: their residual flexibility obeys
u + beta u' = R(F), integrated by the second-order backward difference, so contact does not chatter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.compiled import compiled
from gearbench.fem.law import PAIRS, Law, coupling, find_pairs, lone_approach
from gearbench.fem.machine import Machine, angles, contact_rows, mass_matrix, modal_flexibility, reaction
from gearbench.fem.static import MARGIN, ContactError, position, solve_torque

Array = NDArray[np.float64]

REBASE = 1e-3  # change of gear angle after which the mass matrix is renewed [rad]
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
    contact; force [N], residual and older residual [m] of each; count: number of pairs.
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
    count: int


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
    size = machine.mass.shape[0]
    d = np.zeros(size)
    k1, k2 = machine.stiffness[r, r], machine.stiffness[r + 1, r + 1]
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
    d[modes] = push[modes] / np.diag(machine.stiffness)[modes]
    load = push.copy()
    load[0] += torque
    if r == 2:
        load[1] -= torque * law.driven.rb / law.driver.rb
    pad = np.zeros(PAIRS)
    residual = pad.copy()
    modal = modal_flexibility(machine, rows)
    overlap = np.array([-found[p].gap for p in range(n)]) - modal @ force[:n]
    pushed = (coupling(law, sides, teeth, found, n) - modal) @ force[:n]
    residual[:n] = np.where(force[:n] > 0.0, overlap, pushed)
    padded = pad.copy()
    padded[:n] = force[:n]
    zero = np.zeros(size)
    return State(t, d, zero, zero.copy(), load, sides, teeth, padded, residual, residual.copy(), n)


@compiled
def history(state: State, sides, teeth, n: int):  # type: ignore[no-untyped-def]
    """Force and residuals of the listed pairs at the last step; NaN residuals mark pairs that are new."""
    force = np.zeros(n)
    residual = np.full(n, np.nan)
    older = np.full(n, np.nan)
    for p in range(n):
        for q in range(state.count):
            if state.sides[q] == sides[p] and state.teeth[q] == teeth[p]:
                force[p] = state.force[q]
                residual[p] = state.residual[q]
                older[p] = state.older[q]
    return force, residual, older


@compiled
def solve_contact(
    law: Law, found, over: Array, hub: Array, cross: Array, memory: Array, gain: float, guess: Array, n: int
):  # type: ignore[no-untyped-def]
    """Forces >= 0 with over - hub F = gain (D(F) + cross F) + memory on loaded pairs; Newton with an active set.

    over (n,): overlap that free motion would give; hub (n, n): flexibility of hubs and modes over one step; cross:
    residual coupling; memory: damped residual carried over. Returns forces and whether it converged.
    """
    force = guess.copy()
    active = np.zeros(n, np.bool_)
    for p in range(n):
        active[p] = force[p] > 0.0 or over[p] > memory[p]
        if active[p] and force[p] <= 0.0:
            force[p] = 1e-3
    for _ in range(100):
        system = np.zeros((n, n))
        rhs = np.zeros(n)
        for p in range(n):
            value = over[p] - memory[p]
            for q in range(n):
                value -= (hub[p, q] + gain * cross[p, q]) * force[q]
                if active[p] and active[q]:
                    system[p, q] = hub[p, q] + gain * cross[p, q]
            if active[p]:
                u, slope = lone_approach(law, found[p], force[p])
                value -= gain * u
                system[p, p] += gain * slope
            else:
                system[p, p] = 1.0
            rhs[p] = value
        changed = False
        for p in range(n):
            if not active[p]:
                if rhs[p] > 1e-16:
                    active[p] = True
                    force[p] = 1e-6
                    changed = True
                rhs[p] = 0.0
        if changed:
            continue
        step = np.linalg.solve(system, rhs)
        worst = 0.0
        for p in range(n):
            if not active[p]:
                continue
            new = force[p] + step[p]
            if new <= 0.0:
                new = 0.1 * force[p]
                if new < 1e-9:
                    active[p] = False
                    new = 0.0
                changed = True
            worst = max(worst, abs(new - force[p]) / max(new, 1e-3))
            force[p] = new
        if not changed and worst < 1e-10:
            return force, True
    return force, False


@compiled
def take_step(machine: Machine, scheme: Scheme, inverse: Array, mass: Array, state: State, torque: float):  # type: ignore[no-untyped-def]
    """One step under the driver torque at its end. Returns the new state, the reaction moment and success."""
    h, am, af = scheme.step, scheme.alpha_m, scheme.alpha_f
    r = machine.rotations
    law = machine.law
    t = state.t + h
    external = np.zeros(len(state.d))
    external[0] = torque
    if r == 2:
        external[1] = -torque * law.driven.rb / law.driver.rb
    d0 = state.d + h * state.v + h * h * (0.5 - scheme.beta) * state.a
    v0 = state.v + h * (1 - scheme.gamma) * state.a
    rhs = (
        (1 - af) * external
        + af * state.load
        - am * (mass @ state.a)
        - machine.damping @ ((1 - af) * v0 + af * state.v)
        - machine.stiffness @ ((1 - af) * d0 + af * state.d)
    )
    a_free = inverse @ rhs
    d_free = d0 + scheme.beta * h * h * a_free
    theta1, theta2 = angles(machine, d_free, t)
    y = d_free[r + 1] - d_free[r]
    sides, teeth, found, n = find_pairs(
        law, theta1, theta2, law.centre + machine.axis_x * y, machine.axis_y * y, MARGIN
    )
    rows = contact_rows(machine, sides, teeth, found, n)
    moved = inverse @ rows.T
    hub = scheme.beta * h * h * (1 - af) * (rows @ moved)
    cross = coupling(law, sides, teeth, found, n) - modal_flexibility(machine, rows)
    over = np.zeros(n)
    for p in range(n):
        over[p] = -found[p].gap
        for k in range(r + 2, len(d_free)):
            over[p] -= rows[p, k] * d_free[k]
    guess, residual, older = history(state, sides, teeth, n)
    start = cross @ guess
    for p in range(n):
        if np.isnan(residual[p]):
            residual[p] = start[p]
            older[p] = start[p]
    kappa = machine.beta / (2 * h)
    gain = 1.0 / (1.0 + 3.0 * kappa)
    memory = gain * kappa * (4.0 * residual - older)
    force, ok = solve_contact(law, found, over, hub, cross, memory, gain, guess, n)
    push = rows.T @ force
    a = a_free + (1 - af) * (inverse @ push)
    fresh = memory + gain * (cross @ force)
    padded = np.zeros(PAIRS)
    new_residual = np.zeros(PAIRS)
    new_older = np.zeros(PAIRS)
    for p in range(n):
        if force[p] > 0.0:
            u, _ = lone_approach(law, found[p], force[p])
            fresh[p] += gain * u
        padded[p] = force[p]
        new_residual[p] = fresh[p]
        new_older[p] = residual[p]
    new = State(
        t,
        d0 + scheme.beta * h * h * a,
        v0 + h * scheme.gamma * a,
        a,
        external + push,
        sides,
        teeth,
        padded,
        new_residual,
        new_older,
        n,
    )
    return new, reaction(machine, rows, sides, found, force, a, n), ok


@compiled
def effective_inverse(machine: Machine, scheme: Scheme, mass: Array) -> Array:
    """Inverse of the scheme's effective mass matrix."""
    h, af = scheme.step, scheme.alpha_f
    effective = (
        (1 - scheme.alpha_m) * mass
        + (1 - af) * scheme.gamma * h * machine.damping
        + (1 - af) * scheme.beta * h * h * machine.stiffness
    )
    return np.linalg.inv(effective)


@compiled
def advance(machine: Machine, scheme: Scheme, state: State, torque: Array, substeps: int):  # type: ignore[no-untyped-def]
    """Integrate over len(torque) steps, `torque` being the driver torque at the end of each.

    Returns the state at the end, samples (len(torque)/substeps, CHANNELS) taken after every `substeps` steps, and the
    step at which contact was not found (-1: none).
    """
    samples = np.zeros((len(torque) // substeps, CHANNELS))
    theta1, theta2 = angles(machine, state.d, state.t)
    base1, base2 = theta1, theta2
    mass = mass_matrix(machine, theta1, theta2)
    inverse = effective_inverse(machine, scheme, mass)
    for i in range(len(torque)):
        theta1, theta2 = angles(machine, state.d, state.t)
        if abs(theta1 - base1) > REBASE or abs(theta2 - base2) > REBASE:
            base1, base2 = theta1, theta2
            mass = mass_matrix(machine, theta1, theta2)
            inverse = effective_inverse(machine, scheme, mass)
        state, moment, ok = take_step(machine, scheme, inverse, mass, state, torque[i])
        if not ok:
            return state, samples, i
        if (i + 1) % substeps == 0:
            k = (i + 1) // substeps - 1
            theta1, theta2 = angles(machine, state.d, state.t)
            r = machine.rotations
            samples[k, 0] = theta1
            samples[k, 1] = theta2
            samples[k, 2] = state.d[r]
            samples[k, 3] = state.d[r + 1]
            samples[k, 4] = moment
            samples[k, 5] = np.sum(state.force > 0.0)
    return state, samples, -1
