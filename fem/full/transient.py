"""Time integration of the unreduced rig: generalised-alpha (Chung and Hulbert 1993, eqs. 9-17), contact implicit.

The effective matrix of each gear is constant and factorised once. Hubs enter through its answer to rigid accelerations,
contact through the flexibility of the outline: both are small Schur complements, so that a step takes one solution with
each gear's factors. The residual approach of the flanks, which has no mass, obeys u + beta u' = R(F) by the
second-order backward difference, as in the reduced model.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import lone_approach
from gearbench.fem.contact.law import Meetings, contact_in
from gearbench.fem.contact.sharing import share_load
from gearbench.fem.full.contact import Met, meet
from gearbench.fem.full.gear import Effective, effective
from gearbench.fem.full.machine import Machine, angles, hub_motions, nominal
from gearbench.fem.full.penalty import TOLERANCE, closed_points, near_surfaces, softness
from gearbench.fem.motion.scheme import Scheme

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """Displacements, or rates, or accelerations: of the hubs (h,) and of both gears (u, teeth)."""

    hub: Array
    driver: Array
    driven: Array

    @property
    def gears(self) -> tuple[Array, Array]:
        """Fields of both gears."""
        return self.driver, self.driven


class State(NamedTuple):
    """State of the integration at time `t` [s].

    d, v, a: displacements, rates, accelerations; outer, pressed (h,): forces on the hubs from outside and from the
    flanks; push: nodal forces (m, teeth) on both outlines; pairs (n,): tooth pairs near contact; force [N], residual
    and older residual [m] (n,) of each.
    """

    t: float
    d: Motion
    v: Motion
    a: Motion
    outer: Array
    pressed: Array
    push: tuple[Array, Array]
    pairs: Meetings
    force: Array
    residual: Array
    older: Array


class Stepped(NamedTuple):
    """A step: the new state, the torque on the driven gear [N m], and whether contact was found."""

    state: State
    torque_driven: float
    converged: bool


class Integrator(NamedTuple):
    """A machine under one scheme, its gears' effective matrices factorised."""

    machine: Machine
    scheme: Scheme
    gears: tuple[Effective, Effective]


def make_integrator(machine: Machine, scheme: Scheme) -> Integrator:
    """Factorise the effective matrices of both gears."""
    h, late = scheme.step, 1.0 - scheme.alpha_f
    stiff = late * h * (scheme.gamma * machine.beta + scheme.beta * h)
    one, two = (effective(gear, 1.0 - scheme.alpha_m, stiff) for gear in machine.gears)
    return Integrator(machine, scheme, (one, two))


def outer_load(machine: Machine, torque: float) -> Array:
    """Forces (h,) on the hubs from outside under a driver torque [N m]."""
    out = np.zeros(machine.hubs)
    out[0] = torque
    if machine.rotations == 2:
        out[1] = -torque * machine.law.driven.rb / machine.law.driver.rb
    return out


def lag(machine: Machine, t: float) -> Motion | None:
    """Forces by which all that turns lags behind the nominal rotation at time t [s], whose departures are the unknowns;
    None while it is steady. Where neither speed is prescribed the load's torque makes up for them."""
    at = nominal(machine, t)
    if at.pull1 == 0.0:
        return None
    hub = np.zeros(machine.hubs)
    hub[0] = -machine.mass[0] * at.pull1
    if machine.rotations == 2:
        hub[1] = (machine.course.inertia2 - machine.mass[1]) * at.pull2
    one, two = machine.gears
    return Motion(hub, -at.pull1 * one.rigid[..., 2], at.pull2 * two.rigid[..., 2])


def onto_hub(rigid: Array, field: Array) -> Array:
    """Product (3,) of a field (u, teeth) with the three of `rigid` (u, teeth, 3)."""
    return np.asarray(field.ravel() @ rigid.reshape(-1, 3))


def inertia(machine: Machine, hubs: tuple[Array, Array], a: Motion) -> Motion:
    """Mass matrix times accelerations, `hubs` being the gears' rigid motions (h, 3) per hub unknown."""
    on_hub = machine.mass * a.hub
    fields = []
    for gear, rigid, field in zip(machine.gears, hubs, a.gears, strict=True):
        on_hub = on_hub + rigid @ onto_hub(gear.rigid, field)
        fields.append(gear.mass @ field + gear.rigid @ (rigid.T @ a.hub))
    return Motion(on_hub, *fields)


class Ahead(NamedTuple):
    """A step without new accelerations: displacements, rates, and the forces that the new accelerations must balance,
    contact's new ones left out."""

    d: Motion
    v: Motion
    rest: Motion


def predict(
    machine: Machine,
    scheme: Scheme,
    state: State,
    hubs: tuple[Array, Array],
    outer: Array,
    lags: tuple[Motion | None, Motion | None] = (None, None),
) -> Ahead:
    """What the next step would bring without new accelerations; lags: at its beginning and its end."""
    h, am, af, gamma, beta = scheme.step, scheme.alpha_m, scheme.alpha_f, scheme.gamma, scheme.beta
    late = 1.0 - af
    d = Motion(*(x + h * v + h * h * (0.5 - beta) * a for x, v, a in zip(state.d, state.v, state.a, strict=True)))
    v = Motion(*(v + h * (1.0 - gamma) * a for v, a in zip(state.v, state.a, strict=True)))
    old = inertia(machine, hubs, state.a)
    damped = machine.damping * (late * v.hub + af * state.v.hub)
    sprung = machine.stiffness * (late * d.hub + af * state.d.hub)
    on_hub = late * outer + af * (state.outer + state.pressed) - am * old.hub - damped - sprung
    fields = []
    for i, gear in enumerate(machine.gears):
        strain = late * d.gears[i] + af * state.d.gears[i]
        strain += machine.beta * (late * v.gears[i] + af * state.v.gears[i])
        field = -am * old.gears[i] - gear.stiffness @ strain
        field[gear.loaded] += af * state.push[i]
        for part, force in zip((af, late), lags, strict=True):
            if force is not None:
                field += part * force.gears[i]
        fields.append(field)
    return Ahead(d, v, Motion(on_hub, *fields))


class Hubs(NamedTuple):
    """How the hubs answer forces (h, h) [per kg], the gears' elasticity eliminated, and the gears' share in it:
    (1 - alpha_m) times their rigid motions (h, 3) per hub unknown."""

    compliance: Array
    coupling: tuple[Array, Array]


def eliminated(integrator: Integrator, hubs: tuple[Array, Array]) -> Hubs:
    """The Schur complement of the hubs."""
    machine, scheme = integrator.machine, integrator.scheme
    h, late, share = scheme.step, 1.0 - scheme.alpha_f, 1.0 - scheme.alpha_m
    diagonal = share * machine.mass
    diagonal = diagonal + late * h * (scheme.gamma * machine.damping + scheme.beta * h * machine.stiffness)
    matrix = np.diag(diagonal)
    coupling = share * hubs[0], share * hubs[1]
    for gear, rigid in zip(integrator.gears, coupling, strict=True):
        matrix -= rigid @ gear.product @ rigid.T
    return Hubs(np.asarray(np.linalg.inv(matrix), dtype=np.float64), coupling)


def hub_acceleration(integrator: Integrator, hubs: Hubs, rest: Motion) -> Array:
    """Accelerations (h,) of the hubs under forces."""
    total = rest.hub
    for gear, rigid, field in zip(integrator.gears, hubs.coupling, rest.gears, strict=True):
        total = total - rigid @ onto_hub(gear.answer, field)
    return np.asarray(hubs.compliance @ total)


def held(integrator: Integrator, hubs: Hubs, state: State) -> Array:
    """Accelerations (h,) of the hubs by the flanks' forces of the last step."""
    late = 1.0 - integrator.scheme.alpha_f
    total = late * state.pressed
    for i, gear in enumerate(integrator.gears):
        pushed = gear.answer[integrator.machine.gears[i].loaded].reshape(-1, 3)
        total = total - late * (hubs.coupling[i] @ (state.push[i].ravel() @ pushed))
    return np.asarray(hubs.compliance @ total)


class Approach(NamedTuple):
    """Of n pairs: overlaps (n,) [m] that are left after a step without new contact forces, displacement (n, n) per
    force on a pair [m/N] within the step, and the hubs' part of each force (n, h)."""

    over: Array
    flexibility: Array
    on_hub: Array


def approach(integrator: Integrator, hubs: Hubs, ahead: Ahead, free: Array, met: Met) -> Approach:
    """What the pairs meet when the hubs accelerate by `free` (h,), no new contact force acting."""
    machine, scheme = integrator.machine, integrator.scheme
    square = scheme.beta * scheme.step**2
    over, on_hub = met.over.copy(), met.rows.copy()
    flexibility = np.zeros((len(over), len(over)))
    for i, gear in enumerate(integrator.gears):
        pressed, rigid, loaded = met.pressed[i], hubs.coupling[i], machine.gears[i].loaded
        near = gear.solver.solve_near(ahead.rest.gears[i], pressed.sectors)[loaded]
        answer = gear.answer[loaded][:, pressed.sectors]
        near = near - answer @ (rigid.T @ free)
        over -= pressed.moved(ahead.d.gears[i][np.ix_(loaded, pressed.sectors)] + square * near)
        flexibility += pressed.between(gear.flexibility, machine.gears[i].teeth)
        on_hub -= np.einsum("nm,mnc->nc", pressed.patches, answer) @ rigid.T
    flexibility += on_hub @ hubs.compliance @ on_hub.T
    return Approach(over, square * (1.0 - scheme.alpha_f) * flexibility, on_hub)


class History(NamedTuple):
    """Of pairs (n,): forces [N] and residuals [m] at the last step, and the residual [m] that they carry over."""

    force: Array
    residual: Array
    memory: Array


def history(state: State, met: Met, kappa: float) -> History:
    """What the last step left of the pairs.

    The backward difference of u + beta u' = R is (1 + 3 kappa) u = R + kappa (4 u_1 - u_2), kappa = beta/2h. Pairs
    that are new come with the residual that their neighbours' forces hold them at.
    """
    n = len(met.pairs)
    force, residual, memory, known = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n, bool)
    for p in range(n):
        same = (state.pairs["side"] == met.pairs["side"][p]) & (state.pairs["tooth"] == met.pairs["tooth"][p])
        for q in np.flatnonzero(same):
            force[p], residual[p], known[p] = state.force[q], state.residual[q], True
            memory[p] = kappa * (4.0 * state.residual[q] - state.older[q])
    new = ~known
    residual[new] = (met.cross @ force)[new]
    memory[new] = 3.0 * kappa * residual[new]
    return History(force, residual, memory / (1.0 + 3.0 * kappa))


def residual_of(machine: Machine, met: Met, force: Array) -> Array:
    """Residual approach (n,) [m] of pairs at rest under forces (n,) [N]."""
    out: Array = met.cross @ force
    for p in np.flatnonzero(force > 0.0):
        out[p] += lone_approach(machine.law.curves, contact_in(met.pairs, p), force[p])[0]
    return out


class Step(NamedTuple):
    """A step before its contact forces are known: the hubs' Schur complement, what old accelerations bring, the hubs'
    accelerations (h,) without contact, their unknowns (h,) where contact is looked for and how far the last forces have
    moved them there (h,), and the time at the end [s]."""

    hubs: Hubs
    ahead: Ahead
    free: Array
    at: Array
    shift: Array
    t: float


class Pressing(NamedTuple):
    """What the flanks do in a step: where pairs meet, forces (n,) [N], residual and older residual (n,) [m], and
    whether the forces were found."""

    met: Met
    force: Array
    residual: Array
    older: Array
    converged: bool


def press_law(integrator: Integrator, state: State, step: Step) -> Pressing:
    """Forces of the contact law."""
    machine, at = integrator.machine, step.at
    met = meet(machine, angles(machine, at, step.t), at[machine.rotations :])
    met = met._replace(over=met.over + met.rows @ step.shift)
    kappa = machine.beta / (2.0 * integrator.scheme.step)
    gain = 1.0 / (1.0 + 3.0 * kappa)
    past = history(state, met, kappa)
    near = approach(integrator, step.hubs, step.ahead, step.free, met)
    shared = share_load(
        machine.law.curves, met.pairs, near.over - past.memory, gain * met.cross + near.flexibility, gain, past.force
    )
    fresh = past.memory + gain * residual_of(machine, met, shared.force)
    return Pressing(met, shared.force, fresh, past.residual, bool(shared.converged))


def press_surfaces(integrator: Integrator, state: State, step: Step) -> Pressing:
    """Forces of the meshes' own surfaces, by penalty and multipliers."""
    machine, at = integrator.machine, step.at
    touching = near_surfaces(machine, angles(machine, at, step.t), at[machine.rotations :])
    met = touching.met._replace(over=touching.met.over + touching.met.rows @ step.shift)
    near = approach(integrator, step.hubs, step.ahead, step.free, met)
    known = {key.tobytes(): force for key, force in zip(state.pairs, state.force, strict=True)}
    guess = np.array([known.get(key.tobytes(), 0.0) for key in met.pairs])
    found = closed_points(near.flexibility, near.over, softness(machine), guess, TOLERANCE * touching.share)
    none = np.zeros(len(found.force))
    return Pressing(met, found.force, none, none, found.found)


def take_step(integrator: Integrator, state: State, torque: float) -> Stepped:
    """One step under the driver torque [N m] at its end."""
    machine, scheme = integrator.machine, integrator.scheme
    h, late = scheme.step, 1.0 - scheme.alpha_f
    t, square = state.t + h, scheme.beta * h * h
    outer = load = outer_load(machine, torque)
    lags = lag(machine, state.t), lag(machine, t)
    if lags[1] is not None:
        outer = load + lags[1].hub
    rigid = hub_motions(machine, angles(machine, state.d.hub, state.t))
    ahead = predict(machine, scheme, state, rigid, outer, lags)
    hubs = eliminated(integrator, rigid)
    free = hub_acceleration(integrator, hubs, ahead.rest)

    # Where the teeth meet is taken with the last forces still acting; the overlaps then without any.
    shift = square * held(integrator, hubs, state)
    step = Step(hubs, ahead, free, ahead.d.hub + square * free + shift, shift, t)
    pressing = (press_surfaces if machine.surfaces else press_law)(integrator, state, step)
    met, force = pressing.met, pressing.force

    push = tuple(on.field(gear.teeth, force) for on, gear in zip(met.pressed, machine.gears, strict=True))
    for gear, field, on in zip(machine.gears, ahead.rest.gears, push, strict=True):
        field[gear.loaded] += late * on
    on_hub = force @ met.rows
    rest = ahead.rest._replace(hub=ahead.rest.hub + late * on_hub)
    a = accelerations(integrator, hubs, rest)
    d = Motion(*(x + square * y for x, y in zip(ahead.d, a, strict=True)))
    v = Motion(*(x + h * scheme.gamma * y for x, y in zip(ahead.v, a, strict=True)))
    pushes = push[0], push[1]
    new = State(t, d, v, a, outer, on_hub, pushes, met.pairs, force, pressing.residual, pressing.older)
    pulled = machine.course.inertia2 * nominal(machine, t).pull2
    return Stepped(new, driven_torque(machine, met, force, a, load) - pulled, pressing.converged)


def accelerations(integrator: Integrator, hubs: Hubs, rest: Motion) -> Motion:
    """Accelerations of hubs and gears under forces."""
    a = hub_acceleration(integrator, hubs, rest)
    fields = []
    for i, gear in enumerate(integrator.gears):
        force = rest.gears[i] - integrator.machine.gears[i].rigid @ (hubs.coupling[i].T @ a)
        fields.append(gear.solver.solve(force))
    return Motion(a, *fields)


def driven_torque(machine: Machine, met: Met, force: Array, a: Motion, outer: Array) -> float:
    """Torque [N m] on the driven gear against its rotation, while it is steady: the load's, or what holds its speed."""
    if machine.rotations == 2:
        return float(-outer[1])
    spun = onto_hub(machine.gears[1].rigid, a.driven)[2]
    return float(met.lever @ force + spun)
