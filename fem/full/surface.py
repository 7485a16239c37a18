"""Surfaces of plain finite elements that meet: Gauss points on a slave's flank against the curved sides of a master's.

Nothing is known here of involutes or of half-planes: gaps, normals and forces are those of the elements' own quadratic
sides, and a contact narrower than a side presses on a Gauss point or two of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.law import Meetings
from gearbench.fem.full.contact import Met, Pressed
from gearbench.fem.full.gear import FullGear
from gearbench.fem.full.machine import Angles, Machine

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Gauss points of a side [-1, 1]: as many as a side has unknown normal displacements, or the surfaces would lock.
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
AROUND = 0.6  # how far around a tooth pair's contact sides are looked at [modules]
TURNS = 4  # sides that a projection may move on by
NEWTON = 4

# A Gauss point of a tooth pair: flank side and driver tooth as in `Meetings`, the slave (0 driver), and its number.
POINT = np.dtype([("side", np.int64), ("tooth", np.int64), ("slave", np.int64), ("number", np.int64)])


class Sides(NamedTuple):
    """Quadratic sides (e, 3) of a sector's outline, as places in `Outline.nodes`, from root to tip and on to the other
    root, their nodes (e, 3, 2) in space [m], and the turn (2, 2) from the sector's frame to space."""

    places: Index
    nodes: Array
    turn: Array


class Touching(NamedTuple):
    """Points of contact (n,): whose they are, what a force on each does, as `Met`, and the element side's share that
    each stands for [m]."""

    points: NDArray[np.void]
    met: Met
    share: Array


def shapes(xi: Array) -> Array:
    """Quadratic shape functions (..., 3) of begin, middle and end of a side at xi in [-1, 1]."""
    return np.stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2], axis=-1)


def slopes(xi: Array) -> Array:
    """Their derivatives (..., 3)."""
    return np.stack([xi - 0.5, -2 * xi, xi + 0.5], axis=-1)


def _bends(xi: Array) -> Array:
    return np.broadcast_to(np.array([1.0, -2.0, 1.0]), (*xi.shape, 3))


def sides_of(gear: FullGear, sector: int, turned: float, centre: Array) -> Sides:
    """The outline of a sector, counted counter-clockwise, of a gear turned by an angle [rad] about `centre` (2,)."""
    nodes = gear.outline.nodes
    first = np.arange(0, len(nodes) - 1, 2)
    places = np.stack([first, first + 1, first + 2], axis=1)
    angle = turned + 2 * np.pi * sector / gear.teeth
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    at = gear.sector.points[nodes] @ turn.T + centre
    return Sides(places, at[places], turn)


def project(master: Sides, points: Array) -> tuple[Index, Array]:
    """Sides (n,) and places (n,) in [-1, 1] on them that are closest to points (n, 2)."""
    distance = np.linalg.norm(points[:, None] - master.nodes[None, :, 1], axis=2)
    side = distance.argmin(axis=1)
    xi = np.zeros(len(points))
    last = len(master.nodes) - 1
    for _ in range(TURNS):
        nodes = master.nodes[side]
        for _ in range(NEWTON):
            apart = np.einsum("na,nac->nc", shapes(xi), nodes) - points
            along = np.einsum("na,nac->nc", slopes(xi), nodes)
            curved = np.einsum("na,nac->nc", _bends(xi), nodes)
            stiff = np.sum(along**2, axis=1) + np.sum(apart * curved, axis=1)
            xi = np.clip(xi - np.sum(apart * along, axis=1) / np.maximum(stiff, 1e-30), -1.5, 1.5)
        move = np.where(xi > 1, 1, np.where(xi < -1, -1, 0))
        new = np.clip(side + move, 0, last)
        if np.array_equal(new, side):
            break
        xi = np.where(new != side, xi - 2.0 * move, xi)
        side = new
    return side, np.clip(xi, -1.0, 1.0)


def outwards(sides: Sides, side: Index, xi: Array, clockwise: bool) -> Array:
    """Outward unit normals (n, 2) at places of sides that run clockwise around the gear's tooth, or the other way."""
    along = np.einsum("na,nac->nc", slopes(xi), sides.nodes[side])
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    return normal if clockwise else -normal


def runs_clockwise(gear: FullGear) -> bool:
    """Whether the outline of a tooth, seen from the gear's centre, runs clockwise."""
    at = gear.sector.points[gear.outline.nodes]
    angle = np.arctan2(at[:, 1], at[:, 0])
    return bool(angle[-1] < angle[0])


def touch(machine: Machine, at: Angles, y: Array, pairs: Meetings) -> Touching:
    """Gauss points of the tooth pairs, at given angles and support motions (2,) [m], with overlaps of the rigid flanks.

    The slave of a pair is the gear that touches nearer its tip, so that tip edges are found.
    """
    law = machine.law
    turned = at.driver + law.driver.zero, law.driven.zero - at.driven + np.pi
    centres = machine.axis * y[0], machine.axis * y[1] + np.array([law.centre, 0.0])
    parts = [_pair_points(machine, turned, centres, pair) for pair in pairs]
    points = np.concatenate([np.zeros(0, POINT), *(part[0] for part in parts)])
    count, r = len(points), machine.rotations
    where = np.concatenate([np.zeros((0, 2)), *(part[1] for part in parts)])
    normal = np.concatenate([np.zeros((0, 2)), *(part[2] for part in parts)])  # out of the master
    sign = np.where(points["slave"] == 0, 1.0, -1.0)
    rows = np.zeros((count, machine.hubs))
    levers = [_moment(where - centre, normal) for centre in centres]
    rows[:, 0] = sign * levers[0]
    if r == 2:
        rows[:, 1] = sign * levers[1]  # rotation and side of the force both change sign
    along = normal @ machine.axis
    rows[:, r], rows[:, r + 1] = sign * along, -sign * along
    pressed = []
    for gear in (0, 1):
        sectors = np.concatenate([np.zeros(0, np.int64), *(part[3][gear] for part in parts)])
        patches = np.concatenate([np.zeros((0, machine.gears[gear].outline.size)), *(part[4][gear] for part in parts)])
        pressed.append(Pressed(sectors, patches))
    over = np.concatenate([np.zeros(0), *(part[5] for part in parts)])
    share = np.concatenate([np.zeros(0), *(part[6] for part in parts)])
    met = Met(points, rows, (pressed[0], pressed[1]), over, np.zeros((count, count)), sign * levers[1])
    return Touching(points, met, share)


def _moment(arm: Array, force: Array) -> Array:
    return np.asarray(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])


class _Part(NamedTuple):
    """Points of one tooth pair: whose they are, where they are (n, 2), normals out of the master (n, 2), sectors (n,)
    and nodal forces (n, m) of both gears, overlaps and shares (n,) [m]."""

    points: NDArray[np.void]
    where: Array
    normal: Array
    sectors: tuple[Index, Index]
    patches: tuple[Array, Array]
    over: Array
    share: Array


def _pair_points(machine: Machine, turned: tuple[float, float], centres: tuple[Array, Array], pair: np.void) -> _Part:
    """The points of a tooth pair near contact."""
    arcs, side = (float(pair["s1"]), float(pair["s2"])), int(pair["side"])
    numbers = -int(pair["tooth"]), int(pair["tooth"]) + side
    gears = machine.gears
    left = [gear.outline.shape.s_end - s for gear, s in zip(gears, arcs, strict=True)]
    slave = int(left[1] < left[0])
    master = 1 - slave
    both = [sides_of(gears[g], numbers[g], turned[g], centres[g]) for g in (0, 1)]
    chosen = _near(gears[slave], both[slave], arcs[slave], side, centres[slave])
    xi = np.tile(GAUSS, len(chosen))
    own = np.repeat(chosen, len(GAUSS))
    nodes = both[slave].nodes[own]
    where = np.einsum("na,nac->nc", shapes(xi), nodes)
    share = np.linalg.norm(np.einsum("na,nac->nc", slopes(xi), nodes), axis=1)
    on, eta = project(both[master], where)
    normal = outwards(both[master], on, eta, runs_clockwise(gears[master]))
    foot = np.einsum("na,nac->nc", shapes(eta), both[master].nodes[on])
    patches: list[Array] = [np.zeros(0), np.zeros(0)]
    patches[slave] = _nodal(gears[slave], both[slave], own, xi, normal)
    patches[master] = _nodal(gears[master], both[master], on, eta, -normal)
    points = np.zeros(len(xi), POINT)
    points["side"], points["tooth"], points["slave"] = side, pair["tooth"], slave
    points["number"] = len(GAUSS) * own + np.tile(np.arange(len(GAUSS)), len(chosen))
    sectors = [np.full(len(xi), numbers[g] % gears[g].teeth) for g in (0, 1)]
    over = -np.sum((where - foot) * normal, axis=1)
    return _Part(points, where, normal, (sectors[0], sectors[1]), (patches[0], patches[1]), over, share)


def _near(gear: FullGear, sides: Sides, s: float, flank: int, centre: Array) -> Index:
    """Sides of a flank around the arc length s."""
    shape = gear.outline.shape
    at = shape.points(np.array([min(s, shape.s_end)]))[0] * (1.0, -1.0 if flank else 1.0)
    distance = np.linalg.norm(sides.nodes[:, 1] - (sides.turn @ at + centre), axis=1)
    half = len(distance) / 2
    number = np.arange(len(distance)) + 0.5
    own = number > half - 1 if flank else number < half + 1
    return np.flatnonzero(own & (distance < AROUND * shape.module))


def _nodal(gear: FullGear, sides: Sides, side: Index, xi: Array, force: Array) -> Array:
    """Nodal forces (n, m) in the sector's frame of forces (n, 2) in space at places of sides."""
    count = len(side)
    out = np.zeros((count, gear.outline.size // 2, 2))
    out[np.arange(count)[:, None], sides.places[side]] = shapes(xi)[:, :, None] * (force @ sides.turn)[:, None, :]
    return out.reshape(count, -1)
