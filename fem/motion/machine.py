"""The reduced rig: rigid hubs and what holds them, fixed-hub modes and the contact law, as one set of equations.

Unknowns d: those of the hubs (`hubs.Unknowns`), then modal coordinates of both gears [kg^1/2 m].
Coriolis and centrifugal terms of the elastic displacement (not of the hubs, which are kept in inertial coordinates)
are left out: relative to the elastic forces they are of the order (speed of rotation / lowest modal frequency)^2.
Friction acts on the hubs only: the flanks' displacement along their tangent is not followed.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.coupling import PLACE, Places, find_places
from gearbench.fem.contact.kernel import Kernel
from gearbench.fem.contact.law import Law, Meetings
from gearbench.fem.gear.body import CondensedGear
from gearbench.fem.motion.hubs import ABSENT, Springs, Unknowns, hubs_of
from gearbench.geometry.pair.kinematics import Pair
from gearbench.geometry.tooth.body import Body
from gearbench.kernels.compiled import INNER, compiled
from gearbench.rig import Rig

Array = NDArray[np.float64]


class Rubbing(NamedTuple):
    """Friction between the flanks: coefficient, and 1/v0 [s/m] of the sliding speed over which it turns round."""

    coefficient: float
    steepness: float


class Waves(NamedTuple):
    """Torque ripple (waves,): orders per driver revolution, amplitudes [N m], phases [rad]."""

    order: Array
    torque: Array
    phase: Array


class Correction(NamedTuple):
    """What is common to all pairs: factor on the mesh force, its relative drift over `duration` [s] from time 0 on, its
    series in mesh orders 1, 2, ..., and its exponent over a force [N]; excess of the working flanks [m], its mean and
    series."""

    scale: float
    drift: float
    duration: float
    stiffness_cos: Array
    stiffness_sin: Array
    exponent: float
    reference: float
    error_mean: float
    error_cos: Array
    error_sin: Array


class Balance(NamedTuple):
    """The load's torque where its speed is not prescribed: parts of the driver's torque, of the mean one [N m], and of
    what friction and contact off the line of action take from both rotations together, that it balances."""

    follow: float
    constant: float
    mean: float
    losses: float


class Course(NamedTuple):
    """A nominal rotation whose speed changes, arrays (n,), empty where it is constant: instants [s] that rise from 0,
    the driver's speed [rad/s], linear between them and constant beyond, and its rotation [rad] there; inertias [kg m^2]
    that the torques of drive and load speed up beside the unknowns: what turns rigidly at a prescribed speed, or, at
    the load where neither is prescribed, all that turns, seen from the driven gear."""

    time: Array
    speed: Array
    angle: Array
    inertia1: float
    inertia2: float


STEADY = Course(np.zeros(0), np.zeros(0), np.zeros(0), 0.0, 0.0)


class Machine(NamedTuple):
    """Equations of motion of the reduced rig.

    The first `hubs` unknowns are those of the hubs, numbered by `at`, the others modes. rotations: 1 where the driven
    gear turns at its prescribed speed, 2 where both turn freely. axis_x, axis_y: direction of the support motion; a
    motion across it is along (axis_y, -axis_x). mass (d,): diagonal (the rest of the mass matrix is `hub_coupling`);
    hub_damping, hub_stiffness (hubs, hubs), springs, held, driven_at, loaded_at: as in `Hubs`; drive_shaft, load_shaft:
    stiffness and damping of shafts to a prescribed speed; squares (modes,): modal stiffnesses, with the damping beta
    [s] times as large; hub1, hub2 (3, modes): coupling mass of hub and modes; shapes1, shapes2 (2, teeth, n, modes): of
    both flank sides, as in the contact law's kernels; speed1, speed2: nominal speeds [rad/s], up to time 0 where
    `course` changes them.
    """

    law: Law
    rotations: int
    hubs: int
    at: Unknowns
    axis_x: float
    axis_y: float
    mass: Array
    hub_damping: Array
    hub_stiffness: Array
    springs: Springs
    held: NDArray[np.bool_]
    driven_at: int
    loaded_at: int
    drive_shaft: tuple[float, float]
    load_shaft: tuple[float, float]
    rubbing: Rubbing
    ripple: Waves
    correction: Correction
    balance: Balance
    squares: Array
    hub1: Array
    hub2: Array
    shapes1: Array
    shapes2: Array
    speed1: float
    speed2: float
    beta: float
    course: Course = STEADY


def make_machine(
    rig: Rig,
    pair: Pair,
    law: Law,
    gears: tuple[CondensedGear, CondensedGear],
    bodies: tuple[Body, Body],
    mesh_frequency: float,
    mean_torque: float = 0.0,
    duration: float = 1.0,
    course: Course = STEADY,
) -> Machine:
    """The reduced model of a rig at a mesh frequency [Hz]; gears and bodies: driver first. Where a constant torque is
    imposed it is the mean one [N m]; stiffness drifts over the duration [s]; `course` changes the speed from time 0 on
    (its inertias are those of the rig)."""
    driver, driven = gears
    hubs = hubs_of(rig, bodies)
    squares = np.concatenate([driver.omega, driven.omega]) ** 2
    alpha = pair.working_pressure_angle if rig.support.direction == "line-of-action" else 0.0
    friction, mesh, free = rig.friction, rig.mesh, rig.turns_freely
    series = (mesh.stiffness_cos, mesh.stiffness_sin, mesh.error_cos, mesh.error_sin)
    one, two, three, four = (np.array(values, dtype=float) for values in series)
    return Machine(
        law=law._replace(shared=mesh.shared_compliance, ends=mesh.end_compliance, tilt=mesh.tilt_compliance),
        rotations=1 if hubs.unknowns.driven == ABSENT else 2,
        hubs=len(hubs.mass),
        at=hubs.unknowns,
        axis_x=sin(alpha),
        axis_y=cos(alpha),
        mass=np.concatenate([hubs.mass, np.ones(len(squares))]),
        hub_damping=hubs.damping,
        hub_stiffness=hubs.stiffness,
        springs=hubs.springs,
        held=hubs.held,
        driven_at=hubs.driven_at,
        loaded_at=hubs.loaded_at,
        drive_shaft=hubs.drive_shaft,
        load_shaft=hubs.load_shaft,
        rubbing=Rubbing(friction.coefficient, 1.0 / friction.transition_speed),
        ripple=_waves(rig),
        correction=Correction(
            mesh.stiffness_scale, mesh.stiffness_drift, duration, one, two, mesh.exponent, mesh.reference_force,
            mesh.error_mean, three, four,
        ),
        balance=Balance(
            follow=1.0 if free and rig.load.boundary == "torque" else 0.0,
            constant=1.0 if rig.load.boundary == "inertia" or rig.drive.boundary == "speed" else 0.0,
            mean=mean_torque,
            losses=1.0 if free else 0.0,
        ),
        squares=squares,
        # Each row is read from end to end. One layout for any number of modes: loops are compiled for each.
        hub1=np.ascontiguousarray(driver.mode_hub.T),
        hub2=np.ascontiguousarray(driven.mode_hub.T),
        shapes1=_shapes(law.k1),
        shapes2=_shapes(law.k2),
        speed1=2 * pi * mesh_frequency / driver.teeth,
        speed2=2 * pi * mesh_frequency / driven.teeth,
        beta=rig.damping.beta,
        course=_course(course, rig, bodies),
    )


def _course(course: Course, rig: Rig, bodies: tuple[Body, Body]) -> Course:
    """The course with the inertias of the rig."""
    shafts = rig.drive.coupling, rig.load.coupling
    one, two = (shaft.inertia if shaft is not None else 0.0 for shaft in shafts)
    driver, driven = bodies[0].inertia + one, bodies[1].inertia + two
    if rig.turns_freely:
        ratio = rig.driven.teeth / rig.driver.teeth
        return course._replace(inertia2=driver * ratio**2 + driven)
    return course._replace(
        inertia1=(one if rig.drive.twists else driver) if rig.drive.boundary == "speed" else 0.0,
        inertia2=(two if rig.load.twists else driven) if rig.load.boundary == "speed" else 0.0,
    )


def _waves(rig: Rig) -> Waves:
    ripple = rig.drive.ripple
    if ripple is None or not any(ripple.amplitude):
        return Waves(np.zeros(0), np.zeros(0), np.zeros(0))
    return Waves(*(np.array(values, dtype=float) for values in (ripple.orders, ripple.amplitude, ripple.phase)))


def _shapes(kernel: Kernel) -> Array:
    """Modal displacements with those of all modes at a point side by side."""
    return np.ascontiguousarray(np.moveaxis(np.stack([kernel.modes_front, kernel.modes_back]), 1, -1))


def block_diagonal(hubs: Array, modes: Array) -> Array:
    """Matrix (d, d) of a block of the hubs' unknowns and a diagonal of the modes."""
    out = np.diag(np.concatenate([np.zeros(len(hubs)), modes]))
    out[: len(hubs), : len(hubs)] = hubs
    return out


def stiffness_matrix(machine: Machine) -> Array:
    """Stiffness (d, d) without contact."""
    return block_diagonal(machine.hub_stiffness, machine.squares)


def damping_matrix(machine: Machine) -> Array:
    """Damping (d, d) without contact."""
    return block_diagonal(machine.hub_damping, machine.beta * machine.squares)


class Vector(NamedTuple):
    """Components of a direction."""

    x: float
    y: float


@compiled(forceinline=True, **INNER)
def seen_from(x: float, y: float, chi: float) -> Vector:
    """World direction in the frame of a gear turned by chi."""
    return Vector(x * cos(chi) + y * sin(chi), -x * sin(chi) + y * cos(chi))


@compiled(forceinline=True)
def write_hub_coupling(machine: Machine, theta1: float, theta2: float, out: Array) -> None:
    """`hub_coupling` into `out`, whose other rows stay as they are."""
    at, hub1, hub2 = machine.at, machine.hub1, machine.hub2
    x, y = machine.axis_x, machine.axis_y
    chi1, chi2 = theta1 + machine.law.driver.zero, machine.law.driven.zero - theta2 + pi
    n1, n2 = hub1.shape[1], hub2.shape[1]
    axis1, axis2 = seen_from(x, y, chi1), seen_from(x, y, chi2)
    # Slices, whose indices count from 0: others might be negative for all that the compiler knows, and are gathered.
    turn1, along1, along2 = out[at.driver], out[at.y1], out[at.y2, n1:]
    for k in range(n1):
        turn1[k] = hub1[2, k]
    for k in range(n1):
        along1[k] = hub1[0, k] * axis1.x + hub1[1, k] * axis1.y
    for k in range(n2):
        along2[k] = hub2[0, k] * axis2.x + hub2[1, k] * axis2.y
    if at.driven >= 0:
        turn2 = out[at.driven, n1:]
        for k in range(n2):
            turn2[k] = -hub2[2, k]
    if at.x1 >= 0:
        # Across the supports: their direction, turned clockwise.
        across1, across2 = out[at.x1], out[at.x2, n1:]
        for k in range(n1):
            across1[k] = hub1[0, k] * axis1.y - hub1[1, k] * axis1.x
        for k in range(n2):
            across2[k] = hub2[0, k] * axis2.y - hub2[1, k] * axis2.x


def hub_coupling(machine: Machine, theta1: float, theta2: float) -> Array:
    """Coupling mass of the hubs' unknowns and the modes, (hubs, modes), at given gear angles: the modes turn with their
    gear, the supports do not."""
    out = np.zeros((machine.hubs, len(machine.squares)))
    write_hub_coupling(machine, theta1, theta2, out)
    return out


def mass_matrix(machine: Machine, theta1: float, theta2: float) -> Array:
    """Mass matrix (d, d) at given gear angles."""
    out, first = np.diag(machine.mass), machine.hubs
    out[:first, first:] = hub_coupling(machine, theta1, theta2)
    out[first:, :first] = out[:first, first:].T
    return out


class Pace(NamedTuple):
    """The nominal rotation of both gears: angles [rad], speeds [rad/s], accelerations [rad/s^2]."""

    angle1: float
    angle2: float
    speed1: float
    speed2: float
    pull1: float
    pull2: float


@compiled(forceinline=True)
def pace_on(course: Course, speed1: float, speed2: float, t: float) -> Pace:
    """The nominal rotation at time t [s], of speeds [rad/s] that a course changes; at an instant of the course the
    acceleration is that before it."""
    last = len(course.time) - 1
    if last < 0 or t <= 0.0:
        return Pace(speed1 * t, speed2 * t, speed1, speed2, 0.0, 0.0)
    low, high = 0, last + 1
    while high - low > 1:
        middle = (low + high) // 2
        if course.time[middle] < t:
            low = middle
        else:
            high = middle
    since, slope = t - course.time[low], 0.0
    if low < last:
        slope = (course.speed[low + 1] - course.speed[low]) / (course.time[low + 1] - course.time[low])
    speed = course.speed[low] + slope * since
    angle = course.angle[low] + 0.5 * (course.speed[low] + speed) * since
    ratio = speed2 / speed1
    return Pace(angle, ratio * angle, speed, ratio * speed, slope, ratio * slope)


@compiled(forceinline=True, **INNER)
def pace(machine: Machine, t: float) -> Pace:
    """The nominal rotation of a machine at time t [s]."""
    return pace_on(machine.course, machine.speed1, machine.speed2, t)


@compiled(forceinline=True)
def angles(machine: Machine, d: Array, t: float) -> tuple[float, float]:
    """Angles of driver and driven gear [rad] at time t."""
    nominal = pace(machine, t)
    theta1, theta2 = nominal.angle1 + d[0], nominal.angle2
    return theta1, theta2 + d[machine.at.driven] if machine.at.driven >= 0 else theta2


@compiled(forceinline=True)
def centres(machine: Machine, d: Array) -> Vector:
    """From the driver's centre to that of the driven gear [m]."""
    at = machine.at
    y, x = d[at.y2] - d[at.y1], d[at.x2] - d[at.x1] if at.x1 >= 0 else 0.0
    return Vector(
        machine.law.centre + machine.axis_x * y + machine.axis_y * x, machine.axis_y * y - machine.axis_x * x
    )


@compiled(forceinline=True)
def write_rows(machine: Machine, pairs: Meetings, n: int, places: Places, rows: Array) -> None:
    """`contact_rows` of the first n pairs into `rows`, whose other columns stay zero."""
    hub, hubs, n1, n2 = machine.at, machine.hubs, machine.hub1.shape[1], machine.hub2.shape[1]
    shapes1, shapes2 = machine.shapes1, machine.shapes2
    z1, z2 = shapes1.shape[1], shapes2.shape[1]
    for p in range(n):
        k, at = pairs[p], places[p]
        sign = 1.0 - 2.0 * k.side
        rows[p, hub.driver] = -sign * k.lever1
        if hub.driven >= 0:
            rows[p, hub.driven] = sign * k.lever2
        along = k.nx * machine.axis_x + k.ny * machine.axis_y
        rows[p, hub.y1], rows[p, hub.y2] = -along, along
        if hub.x1 >= 0:
            across = k.nx * machine.axis_y - k.ny * machine.axis_x
            rows[p, hub.x1], rows[p, hub.x2] = -across, across
        one, two = shapes1[k.side, (-k.tooth) % z1, at.node1 :], shapes2[k.side, (k.tooth + k.side) % z2, at.node2 :]
        row1, row2 = rows[p, hubs:], rows[p, hubs + n1 :]
        w0, w1, w2, w3 = at.w01, at.w11, at.w21, at.w31
        for q in range(n1):
            row1[q] = w0 * one[0, q] + w1 * one[1, q] + w2 * one[2, q] + w3 * one[3, q]
        w0, w1, w2, w3 = at.w02, at.w12, at.w22, at.w32
        for q in range(n2):
            row2[q] = w0 * two[0, q] + w1 * two[1, q] + w2 * two[2, q] + w3 * two[3, q]


def contact_rows(machine: Machine, pairs: Meetings) -> Array:
    """Derivative of every pair's gap by the unknowns, which is also the direction of its force; (n, d)."""
    rows, places = np.zeros((len(pairs), len(machine.mass))), np.zeros(len(pairs), PLACE)
    find_places(machine.law, pairs, len(pairs), places)
    write_rows(machine, pairs, len(pairs), places, rows)
    return rows


def modal_flexibility(machine: Machine, rows: Array) -> Array:
    """Static flexibility of the kept modes between the pairs of `rows` [m/N], (n, n), which the residual must not count
    again."""
    modes = rows[:, machine.hubs :]
    return np.asarray((modes / machine.squares) @ modes.T)
