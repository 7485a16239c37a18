"""The reduced rig: rigid hubs on supports, fixed-hub modes and the contact law, as one set of equations of motion.

Unknowns d: driver rotation beyond its nominal angle [rad]; the driven gear's likewise where its speed is not
prescribed; support motions of driver and driven gear [m]; modal coordinates of both gears [kg^1/2 m].
Coriolis and centrifugal terms of the elastic displacement (not of the hubs, which are kept in inertial coordinates)
are left out: relative to the elastic forces they are of the order (speed of rotation / lowest modal frequency)^2.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.kernel import grid_position, row_at
from gearbench.fem.contact.law import Law, Meetings
from gearbench.fem.gear.body import CondensedGear
from gearbench.geometry.pair.kinematics import Pair
from gearbench.geometry.tooth.body import Body
from gearbench.kernels.compiled import compiled
from gearbench.rig import Rig

Array = NDArray[np.float64]


class Machine(NamedTuple):
    """Equations of motion of the reduced rig.

    rotations: 1 where the driven speed is prescribed, 2 where both gears turn freely. axis_x, axis_y: direction of the
    support motion. mass, damping, stiffness (d,): diagonals (the rest of the mass matrix is `hub_coupling`); hub1,
    hub2 (modes, 3): coupling mass of modes and hub; speed1, speed2: nominal speeds [rad/s]; beta [s]:
    stiffness-proportional damping.
    """

    law: Law
    rotations: int
    axis_x: float
    axis_y: float
    mass: Array
    damping: Array
    stiffness: Array
    hub1: Array
    hub2: Array
    omega1: Array
    omega2: Array
    speed1: float
    speed2: float
    beta: float


def make_machine(
    rig: Rig,
    pair: Pair,
    law: Law,
    gears: tuple[CondensedGear, CondensedGear],
    bodies: tuple[Body, Body],
    mesh_frequency: float,
) -> Machine:
    """The reduced model of a rig at a mesh frequency [Hz]; gears and bodies: driver first."""
    driver, driven = gears
    rotations = 1 if rig.load.boundary == "speed" else 2
    n1, n2 = len(driver.omega), len(driven.omega)
    size = rotations + 2 + n1 + n2
    mass, damping, stiffness = (np.zeros(size) for _ in range(3))
    mass[0] = bodies[0].inertia
    if rotations == 2:
        mass[1] = bodies[1].inertia
    for i, support in enumerate((rig.support.driver, rig.support.driven)):
        k = rotations + i
        mass[k], damping[k], stiffness[k] = (bodies[i].mass, support.damping, support.stiffness)
    modal = slice(rotations + 2, size)
    squares = np.concatenate([driver.omega, driven.omega]) ** 2
    mass[modal] = 1.0
    stiffness[modal] = squares
    damping[modal] = rig.damping.beta * squares
    alpha = pair.working_pressure_angle if rig.support.direction == "line-of-action" else 0.0
    return Machine(
        law=law,
        rotations=rotations,
        axis_x=sin(alpha),
        axis_y=cos(alpha),
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        hub1=driver.mode_hub,
        hub2=driven.mode_hub,
        omega1=driver.omega,
        omega2=driven.omega,
        speed1=2 * pi * mesh_frequency / driver.teeth,
        speed2=2 * pi * mesh_frequency / driven.teeth,
        beta=rig.damping.beta,
    )


class Vector(NamedTuple):
    """Components of a direction."""

    x: float
    y: float


@compiled
def seen_from(x: float, y: float, chi: float) -> Vector:
    """World direction in the frame of a gear turned by chi."""
    return Vector(x * cos(chi) + y * sin(chi), -x * sin(chi) + y * cos(chi))


@compiled
def hub_coupling(hub1: Array, hub2: Array, rotations: int, axis1: Vector, axis2: Vector) -> Array:
    """Coupling mass of the hubs' unknowns and the modes, (hub unknowns, modes), the supports' direction being axis1
    (axis2) in the frame of the driver (driven gear): the modes turn with their gear, the supports do not."""
    n1, n2 = len(hub1), len(hub2)
    out = np.zeros((rotations + 2, n1 + n2))
    for k in range(n1):
        out[0, k] = hub1[k, 2]
        out[rotations, k] = hub1[k, 0] * axis1.x + hub1[k, 1] * axis1.y
    for k in range(n2):
        if rotations == 2:
            out[1, n1 + k] = -hub2[k, 2]
        out[rotations + 1, n1 + k] = hub2[k, 0] * axis2.x + hub2[k, 1] * axis2.y
    return out


@compiled
def support_axes(machine: Machine, theta1: float, theta2: float) -> tuple[Vector, Vector]:
    """The supports' direction in the frames of driver and driven gear."""
    x, y = machine.axis_x, machine.axis_y
    chi1, chi2 = theta1 + machine.law.driver.zero, machine.law.driven.zero - theta2 + pi
    return seen_from(x, y, chi1), seen_from(x, y, chi2)


def mass_matrix(machine: Machine, theta1: float, theta2: float) -> Array:
    """Mass matrix (d, d) at given gear angles."""
    out = np.diag(machine.mass)
    first = machine.rotations + 2
    axis1, axis2 = support_axes(machine, theta1, theta2)
    out[:first, first:] = hub_coupling(machine.hub1, machine.hub2, machine.rotations, axis1, axis2)
    out[first:, :first] = out[:first, first:].T
    return out


@compiled
def angles(machine: Machine, d: Array, t: float) -> tuple[float, float]:
    """Angles of driver and driven gear [rad] at time t."""
    theta1 = machine.speed1 * t + d[0]
    theta2 = machine.speed2 * t
    return theta1, theta2 + d[1] if machine.rotations == 2 else theta2


@compiled
def contact_rows(machine: Machine, pairs: Meetings) -> Array:
    """Derivative of every pair's gap by the unknowns, which is also the direction of its force; (n, d)."""
    r = machine.rotations
    n1, n2 = len(machine.omega1), len(machine.omega2)
    k1, k2 = machine.law.k1, machine.law.k2
    z1 = k1.modes_front.shape[1]
    z2 = k2.modes_front.shape[1]
    rows = np.zeros((len(pairs), r + 2 + n1 + n2))
    for p in range(len(pairs)):
        k = pairs[p]
        sign = 1.0 - 2.0 * k.side
        rows[p, 0] = -sign * k.lever1
        if r == 2:
            rows[p, 1] = sign * k.lever2
        along = k.nx * machine.axis_x + k.ny * machine.axis_y
        rows[p, r] = -along
        rows[p, r + 1] = along
        x1 = grid_position(k1, k.s1)
        x2 = grid_position(k2, k.s2)
        tooth1 = (-k.tooth) % z1
        tooth2 = (k.tooth + k.side) % z2
        for q in range(n1):
            table = k1.modes_front if k.side == 0 else k1.modes_back
            rows[p, r + 2 + q] = row_at(table[q, tooth1], x1)
        for q in range(n2):
            table = k2.modes_front if k.side == 0 else k2.modes_back
            rows[p, r + 2 + n1 + q] = row_at(table[q, tooth2], x2)
    return rows


@compiled
def modal_flexibility(rows: Array, stiffness: Array, first: int) -> Array:
    """Static flexibility of the kept modes (unknowns from `first` on) between the pairs [m/N], which the residual must
    not count again."""
    n = rows.shape[0]
    out = np.zeros((n, n))
    for k in range(first, rows.shape[1]):
        for p in range(n):
            for q in range(n):
                out[p, q] += rows[p, k] * rows[q, k] / stiffness[k]
    return out


@compiled
def reaction(hub: Array, pairs: Meetings, force: Array, acceleration: Array) -> float:
    """Moment [N m] that holds the driven gear against its rotation where its speed is prescribed.

    hub (modes, 3): coupling mass of the driven gear's modes, the last of the accelerations.
    """
    total = 0.0
    for p in range(len(pairs)):
        total += (1.0 - 2.0 * pairs[p].side) * pairs[p].lever2 * force[p]
    first = len(acceleration) - len(hub)
    for k in range(len(hub)):
        total += hub[k, 2] * acceleration[first + k]
    return total
