"""Classical fourth-order Runge-Kutta for the non-linear lumped model, compiled.

What varies with time is tabulated on the half-step grid (`tables`); the excitation is sampled there exactly. The
loop allocates nothing and releases the interpreter lock.
"""

from __future__ import annotations

from math import copysign, sqrt, tanh
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import ROUNDING, compiled
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.nonlinear.model import COORDINATES, Constants, Coordinates, NonLinear, Rubbing
from gearbench.lumped.nonlinear.tables import Table

Array = NDArray[np.float64]


class Outputs(NamedTuple):
    """What is seen at the start of each sample; arrays (samples,)."""

    u1: Array  # coordinates [m]
    y1: Array
    y2: Array
    u2: Array
    w: Array
    mesh_force: Array  # [N]
    load_force: Array  # at the load's base circle [N]


class Entry(NamedTuple):
    """One entry of a `Table`."""

    position: float
    excess: float
    excess_rate: float
    gain: float
    ripple: float
    back: float


class Answer(NamedTuple):
    """What the equations of motion give: accelerations [m/s^2] and forces [N] as in `Outputs`."""

    acceleration: Coordinates
    mesh_force: float
    load_force: float


def integrate(
    model: NonLinear,
    table: Table,
    force: Array,
    state: Array,
    *,
    step: float,
    substeps: int,
    mesh_frequency: float,
    first_entry: int = 0,
) -> tuple[Array, Array]:
    """Run through the whole `table` of entries + 1 from `state` (2 COORDINATES,): coordinates [m] and their rates.

    `force` (n,) [N] is T1/rb1 on the half-step grid; it repeats, and `first_entry` of it belongs to the table's first.
    `mesh_frequency` [Hz]: that of the table, for the steady part of the sliding velocity.
    Returns the final state and the samples (samples, 7), named by `columns`. Raises LumpedError for tables
    that do not fit and for overflow.
    """
    entries = len(table.position) - 1
    if entries % (2 * substeps) or force.size % 2 or first_entry % 2:
        raise LumpedError(f"{entries} entries do not hold whole samples of {substeps} steps")
    state = np.asarray(state, dtype=float)
    if state.shape != (2 * COORDINATES,):
        raise LumpedError(f"the state has shape {state.shape}, not ({2 * COORDINATES},)")
    samples = np.empty((entries // (2 * substeps), len(Outputs._fields)))
    secant = np.ascontiguousarray(model.law.secant)
    free = 1.0 if model.free else 0.0
    rubbing = model.rubbing(mesh_frequency)
    place, rate = Coordinates(*state[:COORDINATES]), Coordinates(*state[COORDINATES:])
    place, rate = _run(
        place, rate, table, force, first_entry, secant, model.constants(), rubbing, free, step, substeps,
        columns(samples),
    )  # fmt: skip
    final = np.array([*place, *rate])
    if not np.isfinite(final).all():
        raise LumpedError(f"the integration overflowed: steps of {step:.3g} s are too long")
    return final, samples


def columns(samples: Array) -> Outputs:
    """The columns of samples (..., 7) by their names."""
    return Outputs(*np.moveaxis(samples, -1, 0))


@compiled(fastmath=ROUNDING)
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
    return max(gain * depth * stiffness + p.damping_factor * sqrt(gain * tangent) * rate, 0.0)


@compiled(fastmath=ROUNDING)
def _mesh(travel: float, rate: float, at: Entry, secant: Array, p: Constants) -> float:
    """Mesh force [N] at dte `travel` [m] and its rate [m/s]; negative on the back flanks."""
    depth = travel + at.excess
    if depth > 0.0:
        return _pressed(depth, rate + at.excess_rate, at.position, at.gain, secant, p)
    depth = at.back - travel - p.backlash
    if depth > 0.0:
        rows = secant.shape[0] - 1
        position = p.mirror - at.position
        if position < 0.0:
            position += rows
        return -_pressed(depth, -rate, min(position, rows * (1.0 - 1e-16)), at.gain, secant, p)
    return 0.0


@compiled(fastmath=ROUNDING)
def _spring(y: float, stiffness: float, exponent: float, reference: float) -> float:
    """Force [N] of a support."""
    if exponent == 0.0:
        return stiffness * y
    return stiffness * reference * copysign((abs(y) / reference) ** (1.0 + exponent), y)


@compiled(fastmath=ROUNDING)
def _friction(v: Coordinates, position: float, r: Rubbing) -> tuple[float, float, float]:
    """Friction on driver rotation, supports and driven rotation per normal force, at the rates v."""
    row = int(position)
    weight = position - row
    cycle = position / (r.share.shape[0] - 1)
    # The sliding velocity is linear in the distance from the pitch point.
    middle = r.centre1 * v.u1 - r.centre2 * v.u2 + r.slide * (v.y1 - v.y2)
    slope = r.drift + r.pitch1 * v.u1 + r.pitch2 * v.u2
    m1, s, m2 = 0.0, 0.0, 0.0
    for o in range(r.share.shape[1]):
        part = r.share[row, o] + weight * (r.share[row + 1, o] - r.share[row, o])
        if part != 0.0:
            away = cycle - r.offset - o
            part *= r.coefficient * tanh((middle + away * slope) * r.steepness)
            m1 += part * (r.centre1 + away * r.pitch1)
            s += part
            m2 += part * (r.centre2 - away * r.pitch2)
    return m1, s * r.slide, m2


@compiled(fastmath=ROUNDING)
def _answer(
    q: Coordinates, v: Coordinates, at: Entry, force: float, secant: Array, p: Constants, r: Rubbing | None, free: float
) -> Answer:
    """Accelerations and forces at the coordinates q and their rates v."""
    f = _mesh(q.u1 - q.u2 + p.factor * (q.y1 - q.y2), v.u1 - v.u2 + p.factor * (v.y1 - v.y2), at, secant, p)
    pull, pull_y, pull2 = 0.0, 0.0, 0.0
    if r is not None and f > 0.0:  # without friction r is None, known to the compiler
        pull, pull_y, pull2 = _friction(v, at.position, r)
        pull, pull_y, pull2 = f * pull, f * pull_y, f * pull2
    shaft = p.shaft_stiffness * (q.w - q.u1) + p.shaft_damping * (v.w - v.u1)
    drive = force + at.ripple
    load = free * (force - pull) + (1.0 - free) * f + pull2
    across = p.factor * f + pull_y
    acceleration = Coordinates(
        u1=p.inverse_u1 * (p.rigid * drive + shaft - f - pull),
        y1=p.inverse_y1 * (-across - p.damping1 * v.y1 - _spring(q.y1, p.stiffness1, p.exponent1, p.reference1)),
        y2=p.inverse_y2 * (across - p.damping2 * v.y2 - _spring(q.y2, p.stiffness2, p.exponent2, p.reference2)),
        u2=p.inverse_u2 * (f + pull2 - load),
        w=p.inverse_w * (drive - shaft),
    )
    return Answer(acceleration, f, load)


@compiled(fastmath=ROUNDING)
def _entry(table: Table, i: int) -> Entry:
    """Entry i of the table."""
    return Entry(
        position=table.position[i],
        excess=table.excess[i],
        excess_rate=table.excess_rate[i],
        gain=table.gain[i],
        ripple=table.ripple[i],
        back=table.back[i],
    )


@compiled(fastmath=ROUNDING)
def _moved(q: Coordinates, h: float, v: Coordinates) -> Coordinates:
    """q + h v."""
    return Coordinates(q.u1 + h * v.u1, q.y1 + h * v.y1, q.y2 + h * v.y2, q.u2 + h * v.u2, q.w + h * v.w)


@compiled(fastmath=ROUNDING)
def _mean(h: float, one: float, two: float, three: float, four: float) -> float:
    """Change in a sixth h of a step by the rates at its four stages."""
    return h * (one + 2.0 * (two + three) + four)


@compiled(fastmath=ROUNDING)
def _stepped(
    q: Coordinates, h: float, one: Coordinates, two: Coordinates, three: Coordinates, four: Coordinates
) -> Coordinates:
    """q after a step of which h is the sixth part."""
    return Coordinates(
        q.u1 + _mean(h, one.u1, two.u1, three.u1, four.u1),
        q.y1 + _mean(h, one.y1, two.y1, three.y1, four.y1),
        q.y2 + _mean(h, one.y2, two.y2, three.y2, four.y2),
        q.u2 + _mean(h, one.u2, two.u2, three.u2, four.u2),
        q.w + _mean(h, one.w, two.w, three.w, four.w),
    )


@compiled(fastmath=ROUNDING)
def _run(
    q: Coordinates, v: Coordinates, table: Table, force: Array, first: int, secant: Array, p: Constants,
    r: Rubbing | None, free: float, h: float, substeps: int, out: Outputs,
) -> tuple[Coordinates, Coordinates]:  # fmt: skip
    """Fill `out` from the coordinates q and rates v; returns those at the end."""
    half, sixth = 0.5 * h, h / 6.0
    n = force.size
    i, j = 0, first % n
    for sample in range(len(out.u1)):
        out.u1[sample], out.y1[sample], out.y2[sample], out.u2[sample], out.w[sample] = q
        for sub in range(substeps):
            one = _answer(q, v, _entry(table, i), force[j], secant, p, r, free)
            if sub == 0:
                out.mesh_force[sample], out.load_force[sample] = one.mesh_force, one.load_force
            middle, v2 = _entry(table, i + 1), _moved(v, half, one.acceleration)
            two = _answer(_moved(q, half, v), v2, middle, force[j + 1], secant, p, r, free)
            v3 = _moved(v, half, two.acceleration)
            three = _answer(_moved(q, half, v2), v3, middle, force[j + 1], secant, p, r, free)
            i += 2
            j = j + 2 if j + 2 < n else 0
            v4 = _moved(v, h, three.acceleration)
            four = _answer(_moved(q, h, v3), v4, _entry(table, i), force[j], secant, p, r, free)
            q = _stepped(q, sixth, v, v2, v3, v4)
            v = _stepped(v, sixth, one.acceleration, two.acceleration, three.acceleration, four.acceleration)
    return q, v
