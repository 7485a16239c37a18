"""What holds and drives the hubs: their unknowns, and the matrices between them.

Every unknown of a rotation is the departure from its nominal angle, so that a shaft is a spring between two unknowns,
or to the ground where the speed of its other end is prescribed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.tooth.body import Body
from gearbench.rig import Housing, Rig, Rocking, Support

Array = NDArray[np.float64]
ABSENT = -1


class Unknowns(NamedTuple):
    """Numbers of the hubs' unknowns, ABSENT where a rig has none: departures of the gears' rotations, of those of the
    outer ends of drive and load from the nominal ones [rad]; motions of the centres along the supports and across them,
    and both of the housing [m]."""

    driver: int
    driven: int
    y1: int
    y2: int
    x1: int
    x2: int
    drive_end: int
    load_end: int
    housing: int
    rocking: int


class Springs(NamedTuple):
    """Springs of n supports whose force on their deflection s is stiffness s |s/reference|^exponent: how the hubs'
    unknowns deflect them (n, hubs), and their numbers (n,) [N/m], [-], [m]."""

    rows: Array
    stiffness: Array
    exponent: Array
    reference: Array


class Hubs(NamedTuple):
    """Hubs' unknowns and what is between them: masses (hubs,), damping and stiffness (hubs, hubs), non-linear springs,
    flags (hubs,) of unknowns that are held, the unknowns that the torques of drive and load act on, ABSENT where a
    speed is prescribed, and stiffness and damping of the shafts to prescribed speeds (0: rigid)."""

    unknowns: Unknowns
    mass: Array
    damping: Array
    stiffness: Array
    springs: Springs
    held: NDArray[np.bool_]
    driven_at: int
    loaded_at: int
    drive_shaft: tuple[float, float]
    load_shaft: tuple[float, float]


def unknowns_of(rig: Rig) -> tuple[Unknowns, int]:
    """Numbers of the hubs' unknowns of a rig, and how many there are."""
    across = rig.support.move_across
    wanted = {
        "driver": True,
        "driven": rig.load.boundary != "speed" or rig.load.twists,
        "y1": True,
        "y2": True,
        "x1": across,
        "x2": across,
        "drive_end": rig.drive.twists and rig.drive.boundary != "speed",
        "load_end": rig.load.twists and rig.load.boundary != "speed",
        "housing": rig.housing is not None,
        "rocking": rig.housing is not None and rig.housing.rocking is not None,
    }
    present = [name for name, there in wanted.items() if there]
    return Unknowns(*(present.index(name) if there else ABSENT for name, there in wanted.items())), len(present)


def hubs_of(rig: Rig, bodies: tuple[Body, Body]) -> Hubs:
    """Hubs of a rig whose gears have these masses and inertias."""
    at, count = unknowns_of(rig)
    mass, held = np.ones(count), np.zeros(count, np.bool_)
    damping, stiffness = np.zeros((count, count)), np.zeros((count, count))
    springs: list[tuple[Array, float, float, float]] = []
    shafts = []
    ends = (
        (at.driver, at.drive_end, rig.drive, bodies[0].inertia),
        (at.driven, at.load_end, rig.load, bodies[1].inertia),
    )
    for gear, end, side, inertia in ends:
        coupling = side.coupling
        elastic = coupling is not None and coupling.stiffness is not None
        shaft = (coupling.stiffness or 0.0, coupling.damping) if coupling is not None and elastic else (0.0, 0.0)
        if gear != ABSENT:
            mass[gear] = inertia + (coupling.inertia if coupling is not None and not elastic else 0.0)
            _between(stiffness, damping, _row(count, gear, end), shaft)
            held[gear] = side.boundary == "speed" and not elastic
        if end != ABSENT and coupling is not None:
            mass[end] = coupling.inertia
        shafts.append(shaft)
    moves = _moves(rig, at)
    supports = ((at.y1, at.x1, rig.support.driver, bodies[0]), (at.y2, at.x2, rig.support.driven, bodies[1]))
    for number, (y, x, support, body) in enumerate(supports):
        mass[y], holds, damps = support.holding(body.mass)
        row = _row(count, y)
        for place, move in moves:
            row[place] = -(move.driver_share, move.driven_share)[number]
        if support.exponent:
            springs.append((row, holds, support.exponent, support.reference_deflection))
        _between(stiffness, damping, row, (0.0 if support.exponent else holds, damps))
        if x != ABSENT:
            mass[x] = body.mass
            held[x] = support.across is None
            aside = _row(count, x)
            for place, move in moves:
                aside[place] = -(move.driver_share_across, move.driven_share_across)[number]
            _across(stiffness, damping, row, aside, support)
    for place, move in moves:
        mass[place] = move.mass
        _between(stiffness, damping, _row(count, place), (move.stiffness, move.damping))
    return Hubs(
        unknowns=at,
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        springs=_springs(springs, count),
        held=held,
        driven_at=ABSENT if rig.drive.boundary == "speed" else max(at.driver, at.drive_end),
        loaded_at=ABSENT if rig.load.boundary == "speed" else max(at.driven, at.load_end),
        drive_shaft=shafts[0],
        load_shaft=shafts[1],
    )


def _moves(rig: Rig, at: Unknowns) -> list[tuple[int, Housing | Rocking]]:
    """The housing's motions and their unknowns."""
    if rig.housing is None:
        return []
    rocking = rig.housing.rocking
    return [(at.housing, rig.housing), *([(at.rocking, rocking)] if rocking is not None else [])]


def _row(count: int, one: int, two: int = ABSENT) -> Array:
    """How the unknowns make up the difference of two of them, or to the ground."""
    row = np.zeros(count)
    row[one] = 1.0
    if two != ABSENT:
        row[two] = -1.0
    return row


def _between(stiffness: Array, damping: Array, row: Array, spring: tuple[float, float]) -> None:
    """Add a spring and damper on the deflection `row`."""
    stiffness += spring[0] * np.outer(row, row)
    damping += spring[1] * np.outer(row, row)


def _across(stiffness: Array, damping: Array, row: Array, aside: Array, support: Support) -> None:
    """Add what holds a centre across its support, which deflects by `row` along and `aside` across."""
    if support.across is None:
        return
    _between(stiffness, damping, aside, (support.across.stiffness, support.across.damping))
    stiffness += support.across.coupling * (np.outer(row, aside) + np.outer(aside, row))


def _springs(springs: list[tuple[Array, float, float, float]], count: int) -> Springs:
    rows = np.array([row for row, *_ in springs]).reshape(len(springs), count)
    numbers = np.array([numbers for _, *numbers in springs]).reshape(len(springs), 3)
    return Springs(rows, *(np.ascontiguousarray(column) for column in numbers.T))


def spring_force(springs: Springs, d: Array) -> Array:
    """Generalised forces (hubs,) with which the non-linear springs resist the unknowns d (hubs, ...)."""
    s = springs.rows @ d[: springs.rows.shape[1]]
    return np.asarray(springs.rows.T @ (springs.stiffness * s * np.abs(s / springs.reference) ** springs.exponent))


def spring_tangent(springs: Springs, d: Array) -> Array:
    """Stiffness (hubs, hubs) of the non-linear springs at the unknowns d (hubs, ...)."""
    s = np.abs(springs.rows @ d[: springs.rows.shape[1]] / springs.reference)
    tangent = springs.stiffness * (1 + springs.exponent) * s**springs.exponent
    return np.asarray((springs.rows.T * tangent) @ springs.rows)


def hubs_at_rest(
    stiffness: Array, springs: Springs, at: Unknowns, held: NDArray[np.bool_], push: Array
) -> Array:
    """Unknowns (hubs,) of centres and housing at rest under generalised forces (hubs,); rotations stay zero."""
    moving = [k for k in (at.y1, at.y2, at.x1, at.x2, at.housing, at.rocking) if k != ABSENT and not held[k]]
    d = np.zeros(len(push))
    # Each non-linear spring is solved in closed form under what the others leave to it, in turn with those.
    secant = springs.stiffness.copy()
    for _ in range(200):
        matrix = stiffness + (springs.rows.T * secant) @ springs.rows
        d[moving] = np.linalg.solve(matrix[np.ix_(moving, moving)], push[moving])
        force = np.abs(secant * (springs.rows @ d))
        size = springs.reference * (force / (springs.stiffness * springs.reference)) ** (1 / (1 + springs.exponent))
        new = np.where(size > 0, force / np.where(size > 0, size, 1.0), secant)
        if np.all(np.abs(new - secant) <= 1e-13 * secant):
            break
        secant = new
    return d
