"""Augmented-Lagrangian contact of plain finite-element flanks, point by point.

A penalty presses on every Gauss point that overlaps, by the pressure E/L per overlap, L being the length of its side;
multipliers take over what it leaves (Uzawa's iteration, its penalty growing; Simo and Laursen 1992), until the largest
overlap is a millionth of a side. So flanks do not overlap, whatever the penalty; what remains is that a side resolves
no contact narrower than itself.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.law import find_pairs
from gearbench.fem.contact.static import MARGIN, ContactError, solve_torque
from gearbench.fem.full.contact import Met
from gearbench.fem.full.machine import Angles, Machine
from gearbench.fem.full.surface import Touching, touch

Array = NDArray[np.float64]

TOLERANCE = 1e-6  # largest overlap that is left, of the side's length
ROUNDS = 60  # of augmentation
GROWTH = 2.0  # of the penalty from round to round
SOFTEST = 1e-6  # least part of the first penalty's softness: points that move alike keep a regular matrix
ACTIVE = 60  # changes of the set of closed points
STARTS = 60  # passes of the static start
SETTLED = 1e-8  # relative error of torque and support motions that it leaves
STEP = 1e-6  # by which flanks that do not touch are moved together [m]


class Closed(NamedTuple):
    """Forces (n,) [N] of points, and whether they were found."""

    force: Array
    found: bool


def near_surfaces(machine: Machine, at: Angles, y: Array) -> Touching:
    """The points of the tooth pairs that are near contact at given angles and support motions (2,) [m]."""
    dx, dy = machine.law.centre + machine.axis[0] * (y[1] - y[0]), machine.axis[1] * (y[1] - y[0])
    return touch(machine, at, y, find_pairs(machine.law, at.driver, at.driven, dx, dy, MARGIN))


def softness(machine: Machine) -> float:
    """Overlap per force [m/N] of the penalty E/L at a point, which stands for half a side of length L."""
    return machine.law.half_plane * pi / 2.0  # 2/(E' b)


def closed_points(flexibility: Array, over: Array, soft: float, guess: Array, tolerance: Array) -> Closed:
    """Forces F >= 0 that leave no overlap: flexibility F = over where F > 0; (n, n) and (n,). `soft`: of the penalty;
    multipliers begin at `guess`."""
    multiplier = guess.copy()
    closed = multiplier > 0.0
    for number in range(ROUNDS):
        # What the mesh hardly tells apart, multipliers of one penalty alone approach by less than a thousandth a round.
        eased = soft * max(GROWTH**-number, SOFTEST)
        force, closed, found = _pressed(flexibility + eased * np.eye(len(over)), over + eased * multiplier, closed)
        if not found:
            return Closed(force, False)
        left = np.abs(eased * (force - multiplier))
        multiplier = force
        if np.all(left <= tolerance):
            return Closed(force, True)
    return Closed(multiplier, False)


def _pressed(matrix: Array, over: Array, closed: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_], bool]:
    """F >= 0, matrix F >= over, one of both everywhere an equality: Newton's method on the set of closed points."""
    force = np.zeros(len(over))
    size = np.diag(matrix)
    for _ in range(ACTIVE):
        force[:] = 0.0
        on = np.flatnonzero(closed)
        if len(on):
            force[on] = np.linalg.solve(matrix[np.ix_(on, on)], over[on])
        new = force * size + np.where(closed, 0.0, over - matrix @ force) > 0.0
        if np.array_equal(new, closed):
            return force, closed, True
        closed = new
    return force, closed, False


class AtRest(NamedTuple):
    """Static equilibrium: the driver's rotation beyond its nominal one [rad], support motions (2,) [m], the points,
    what they do and their forces (n,) [N]."""

    angle: float
    y: Array
    touching: Touching
    force: Array


def at_rest(machine: Machine, torque: float, t: float) -> AtRest:
    """Static equilibrium under a constant driver torque [N m]. Raises ContactError."""
    law, r, soft = machine.law, machine.rotations, softness(machine)
    phase = machine.speeds[0] * t / law.driver.pitch
    nominal = phase * law.driver.pitch
    angle, y = solve_torque(law, phase, torque, 0.0) / law.driver.rb, np.zeros(2)
    for _ in range(STARTS):
        touching = near_surfaces(machine, Angles(nominal + angle, phase * law.driven.pitch), y)
        met = touching.met
        held = met.rows[:, r:]
        flexibility = static_flexibility(machine, met) + (held / machine.stiffness[r:]) @ held.T
        over = met.over + held @ y
        found = closed_points(flexibility, over, soft, np.zeros(len(over)), TOLERANCE * touching.share)
        if not found.found:
            break
        on = found.force > 0.0
        if not on.any():
            angle += STEP / law.driver.rb
            continue
        new = (found.force @ held) / machine.stiffness[r:]
        off = torque + float(found.force @ met.rows[:, 0])
        if abs(off) <= SETTLED * torque and np.abs(new - y).max() <= SETTLED * np.abs(new).max():
            return AtRest(angle, y, touching, found.force)
        lever = met.rows[on, 0]
        # Closed points may be more than a mesh can tell apart: the penalty keeps their matrix regular.
        matrix = flexibility[np.ix_(on, on)] + soft * 1e-3 * np.eye(int(on.sum()))
        angle += off / float(lever @ np.linalg.solve(matrix, lever))
        y = new
    raise ContactError(f"no static equilibrium of the flanks' surfaces at {torque:g} N m")


def static_flexibility(machine: Machine, met: Met) -> Array:
    """Displacement (n, n) [m/N] at each point per force on another, both gears' meshes at rest."""
    return sum(
        (on.between(gear.compliance, gear.teeth) for gear, on in zip(machine.gears, met.pressed, strict=True)),
        np.zeros((len(met.over), len(met.over))),
    )
