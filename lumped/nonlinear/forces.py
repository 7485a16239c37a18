"""Forces of mesh, supports and friction at an instant, compiled."""

from __future__ import annotations

from math import copysign, exp, floor, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import INLINED, ROUNDING, compiled
from gearbench.lumped.nonlinear.constants import Constants, Rubbing
from gearbench.lumped.nonlinear.coordinates import Coordinates
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.tables import Table

Array = NDArray[np.float64]


class Apart(NamedTuple):
    """What pairs whose teeth differ have of their own: `own` of the `Table`, and secants (phases + 1, n_d, n_o) [N/m];
    bending: their parts (phases + 1, n_o, 2), or empty where no tooth is cracked."""

    own: Array
    secant: Array
    bending: Array | tuple[()]


class Entry(NamedTuple):
    """One entry of a `Table`."""

    first_pair: int
    position: float
    excess: float
    excess_rate: float
    gain: float
    ripple: float
    back: float
    pace: float
    pull: float
    lever1: float
    lever2: float
    tilt: float
    led: float


class Rubbed(NamedTuple):
    """Friction per normal force: against the driver's rotation, along and across the supports, and with the driven
    rotation."""

    driver: float
    along: float
    across: float
    driven: float


def apart_of(table: Table, law: MeshLaw) -> Apart | tuple[()]:
    """The pairs of a table and its law; empty where all teeth are alike."""
    if not table.own.size:
        return ()
    return Apart(table.own, law.pair_secants, law.closed[1] if table.own[:, 1:].any() else ())


@compiled(fastmath=ROUNDING, **INLINED)
def entry(table: Table, i: int) -> Entry:
    """Entry i of the table."""
    changes, runs_out = len(table.pull) > 0, len(table.levers) > 0
    return Entry(
        first_pair=int(table.first_pair[i]),
        position=table.position[i],
        excess=table.excess[i],
        excess_rate=table.excess_rate[i],
        gain=table.gain[i],
        ripple=table.ripple[i],
        back=table.back[i],
        pace=table.pace[i] if changes else 1.0,
        pull=table.pull[i] if changes else 0.0,
        lever1=table.levers[i, 0] if runs_out else 0.0,
        lever2=table.levers[i, 1] if runs_out else 0.0,
        tilt=table.levers[i, 2] if runs_out else 0.0,
        led=table.led[i] if len(table.led) > 0 else 0.0,
    )


@compiled(fastmath=ROUNDING, **INLINED)
def _held(cycles: float, first: int, apart: Any) -> int:
    """By how many pairs `first` moves on with so many cycles, of those that there are."""
    if len(apart) == 0:
        return 0
    last = apart.own.shape[0] - apart.secant.shape[2]
    return int(min(max(first + cycles, 0.0), float(last))) - first


@compiled(fastmath=ROUNDING, **INLINED)
def turned_on(at: Entry, rows: float, count: int, apart: Any) -> Entry:
    """The entry with the mesh turned on by so many rows of a table of `count`."""
    position, first = at.position + rows, at.first_pair
    if not 0.0 <= position < count:
        cycles = floor(position / count)
        position = min(max(position - count * cycles, 0.0), count * (1.0 - 1e-16))
        first += _held(cycles, first, apart)
    return Entry(
        first, position, at.excess, at.excess_rate, at.gain, at.ripple, at.back, at.pace, at.pull, at.lever1,
        at.lever2, at.tilt, at.led,
    )  # fmt: skip


@compiled(fastmath=ROUNDING, **INLINED)
def _viscosity(elastic: float, tangent: float, p: Constants) -> float:
    """Damping coefficient of the mesh [N s/m] at an elastic force [N] and its tangent [N/m]."""
    plain = p.damping_factor * sqrt(tangent)
    if p.damping_exponent == 0.0:
        return plain
    return plain * (elastic * p.damping_pliancy) ** p.damping_exponent


@compiled(fastmath=ROUNDING, **INLINED)
def _beyond(depth: float, low: float, high: float, last: int, root: float) -> tuple[float, float]:
    """Force and tangent behind the last node of a table whose last two secants are these; `root`: nodes per root of
    a deflection [m]."""
    end, before = (last / root) ** 2, ((last - 1) / root) ** 2
    tangent = max((end * high - before * low) / (end - before), 0.0)
    return end * high + tangent * (depth - end), tangent


@compiled(fastmath=ROUNDING, **INLINED)
def _pressed(depth: float, rate: float, position: float, gain: float, secant: Array, p: Constants) -> float:
    """Force [N] of flanks pressed by depth > 0 [m] and closing at rate [m/s]; never negative."""
    last = secant.shape[1] - 1
    row = int(position)
    weight = position - row
    root = p.root * sqrt(depth)
    node = min(int(root), last - 1)
    low = secant[row, node] + weight * (secant[row + 1, node] - secant[row, node])
    high = secant[row, node + 1] + weight * (secant[row + 1, node + 1] - secant[row, node + 1])
    rise = high - low
    stiffness = low + (root - node) * rise
    tangent = max(stiffness + 0.5 * root * rise, 0.0)
    elastic = gain * depth * stiffness
    if root > last:
        elastic, tangent = _beyond(depth, low, high, last, p.root)
        elastic *= gain
    return max(elastic + _viscosity(elastic, gain * tangent, p) * rate, 0.0)


@compiled(fastmath=ROUNDING, **INLINED)
def _left(bending: Any, own: Array, pair: int, row: int, o: int, weight: float) -> float:
    """Part of its stiffness that cracks leave a pair."""
    if len(bending) == 0:
        return 1.0
    one = bending[row, o, 0] + weight * (bending[row + 1, o, 0] - bending[row, o, 0])
    two = bending[row, o, 1] + weight * (bending[row + 1, o, 1] - bending[row, o, 1])
    return 1.0 / (1.0 + one * own[pair, 1] + two * own[pair, 2])


@compiled(fastmath=ROUNDING, **INLINED)
def _pressed_apart(travel: float, rate: float, at: Entry, apart: Apart, p: Constants) -> float:
    """Force [N] of pairs that each have an excess of their own over the deflection `travel` [m], closing at rate [m/s];
    never negative."""
    last = apart.secant.shape[1] - 1
    row = int(at.position)
    weight = at.position - row
    elastic, tangent = 0.0, 0.0
    for o in range(apart.secant.shape[2]):
        pair = at.first_pair + o
        depth = travel + apart.own[pair, 0]
        if depth <= 0.0 or apart.secant[row, last, o] + apart.secant[row + 1, last, o] == 0.0:
            continue
        root = p.root * sqrt(depth)
        node = min(int(root), last - 1)
        low = apart.secant[row, node, o] + weight * (apart.secant[row + 1, node, o] - apart.secant[row, node, o])
        node += 1
        high = apart.secant[row, node, o] + weight * (apart.secant[row + 1, node, o] - apart.secant[row, node, o])
        rise = high - low
        stiffness = low + (root - node + 1) * rise
        left = _left(apart.bending, apart.own, pair, row, o, weight)
        if root > last:
            force, slope = _beyond(depth, low, high, last, p.root)
        else:
            force, slope = depth * stiffness, max(stiffness + 0.5 * root * rise, 0.0)
        elastic += left * force
        tangent += left * slope
    elastic *= at.gain
    return max(elastic + _viscosity(elastic, at.gain * tangent, p) * rate, 0.0)


@compiled(fastmath=ROUNDING, **INLINED)
def mesh(travel: float, rate: float, at: Entry, secant: Array, apart: Any, p: Constants) -> float:
    """Mesh force [N] at dte `travel` [m] and its rate [m/s]; negative on the back flanks."""
    depth = travel + at.excess
    if len(apart) != 0:
        force = _pressed_apart(depth, rate + at.excess_rate, at, apart, p)
        if force > 0.0:
            return force
    elif depth > 0.0:
        return _pressed(depth, rate + at.excess_rate, at.position, at.gain, secant, p)
    depth = at.back - travel - p.backlash
    if depth > 0.0:
        rows = secant.shape[0] - 1
        position = p.mirror - at.position
        if position < 0.0:
            position += rows
        return -_pressed(depth, -rate, min(position, rows * (1.0 - 1e-16)), at.gain, secant, p)
    return 0.0


@compiled(fastmath=ROUNDING, **INLINED)
def spring(y: float, stiffness: float, exponent: float, reference: float) -> float:
    """Force [N] of a support."""
    if exponent == 0.0:
        return stiffness * y
    return stiffness * reference * copysign((abs(y) / reference) ** (1.0 + exponent), y)


@compiled(fastmath=ROUNDING, **INLINED)
def _aside(sliding: float, r: Any, factor: float) -> float:
    """Sliding velocity with that of the centres across their supports."""
    if len(r) == 0:
        return sliding
    return sliding - factor * (r.x1 - r.x2)


@compiled(fastmath=ROUNDING, **INLINED)
def _slid(sliding: float) -> float:
    """tanh to rounding of one: the library's, exact near zero too, takes several times as long."""
    if abs(sliding) > 19.0:  # one to rounding
        return copysign(1.0, sliding)
    return 1.0 - 2.0 / (exp(2.0 * sliding) + 1.0)


@compiled(fastmath=ROUNDING, **INLINED)
def friction(v: Coordinates, further: Any, at: Entry, r: Rubbing, factor: float) -> Rubbed:
    """What friction does per normal force, at the rates v and `further`; factor: g."""
    position = at.position
    row = int(position)
    weight = position - row
    cycle = position / (r.carried.shape[0] - 1)
    # The sliding velocity is linear in the distance from the pitch point.
    middle = _aside(r.centre1 * v.u1 - r.centre2 * v.u2 + r.slide * (v.y1 - v.y2), further, factor)
    slope = at.pace * r.drift + r.pitch1 * v.u1 + r.pitch2 * v.u2
    m1, s, m2 = 0.0, 0.0, 0.0
    for o in range(r.carried.shape[1]):
        part = r.carried[row, o] + weight * (r.carried[row + 1, o] - r.carried[row, o])
        if part != 0.0:
            away = cycle - r.offset - o
            part *= r.coefficient * _slid((middle + away * slope) * r.steepness)
            m1 += part * (r.centre1 + away * r.pitch1)
            s += part
            m2 += part * (r.centre2 - away * r.pitch2)
    return Rubbed(m1, s * r.slide, s * factor, m2)
