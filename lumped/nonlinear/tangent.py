"""Small departures from a motion of the non-linear lumped model, compiled: what a little more force in the mesh, or on
one coordinate, does to every coordinate.

Along a given motion the mesh is a spring k(t) and a damper c(t), so that departures q obey

    M q'' + C q' + K q = -(m + r(t)) (k(t) m.q + c(t) m.q' + w(t) n.q + f(t)) - sum b_i s_i(t) b_i.q + g(t)

with m what each coordinate contributes to the deflection, n to the phase of the mesh, which the force grows with by
w(t), b_i likewise that of a support whose stiffness departs by
s_i(t) from the mean one, f(t) the force that a change of the rig adds in the mesh at
unchanged motion, and g(t) those on coordinates: a support, the driver, its shaft. r(t) is the friction that comes
with a normal force (`rubbing`); that its levers change with the departures, as sliding turns round, is left out. Many
departures are carried at once by the classical Runge-Kutta method, in single precision, which leaves 1e-6 of the
largest departure. A stiff mode may need more steps than all that varies has entries, which is read between them then.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import INLINED, ROUNDING, compiled
from gearbench.lumped.nonlinear.coordinates import IN_MESH, Acting

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Integers = NDArray[np.int64]

# A plain 0.5 would be of double precision, and what it is multiplied with.
HALF, SIXTH, TWO = np.float32(0.5), np.float32(1 / 6), np.float32(2.0)
PIECE = 32  # departures that compiled loops take in one piece
# Of a step's four stages in the mesh force that is told of it.
AT_ONCE, OVER_STEP = (1.0, 0.0, 0.0, 0.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)


class Tangent(NamedTuple):
    """A rig along a motion: springs K, dampers C (n, n), inverse masses (n,), what coordinates contribute to the
    deflection (n,), and of the mesh on the half-step grid of one repetition stiffness k and damping c (entries,);
    `step` [s] is two entries. Of supports whose stiffness varies what coordinates contribute to their deflection (b, n)
    and by how much it departs from that in K (entries, b). By how much coordinates turn the mesh on (n,) [cycles/m],
    and what its force grows by with that (entries,) [N/cycle]. `rubbed` (entries, n): what friction adds to the
    direction of a force in the mesh. A step is gone in `finer` ones, between whose entries all is read on a line."""

    springs: Array
    dampers: Array
    inverse: Array
    mesh: Array
    stiffness: Array
    damping: Array
    step: float
    bearings: Array
    stiffer: Array
    turned_on: Array
    turning: Array
    rubbed: Array
    finer: int = 1


class _Course(NamedTuple):
    """What varies along a motion (entries, ...), or at one instant (...): stiffness, damping and what turning on adds
    of the mesh (3,), what coordinates are pushed by per force in the mesh (n,), forces, and stiffer bearings (b,)."""

    mesh: Single
    pushed: Single
    forces: Single
    stiffer: Single


def departures(
    tangent: Tangent, acting: Acting, substeps: int, early: int,
    weights: tuple[float, float, float, float] = AT_ONCE,
) -> tuple[Single, Single]:  # fmt: skip
    """Departures (samples, n, columns) of the coordinates [m] and (steps, columns) of the mesh force [N] under forces;
    `early` steps before the first sample begin at rest. The mesh force is that at the beginning of each step, or with
    the `weights` OVER_STEP the mean over it.
    """
    entries, columns = len(acting.values), int(acting.of.max(initial=-1)) + 1
    size = len(tangent.inverse)
    samples = entries // (2 * substeps)
    padded = ceil(columns / PIECE) * PIECE
    places, pushes = np.empty((samples, size, padded), np.float32), np.zeros((entries // 2, padded), np.float32)
    inverse = tangent.inverse[:, None]
    varying = (
        np.stack([tangent.stiffness, tangent.damping, tangent.turning], axis=1),
        -tangent.inverse * (tangent.mesh + tangent.rubbed), acting.values, tangent.stiffer,
    )  # fmt: skip
    course = _Course(*(np.ascontiguousarray(one, np.float32) for one in varying))
    fixed = (
        -inverse * tangent.springs, -inverse * tangent.dampers, tangent.inverse, tangent.mesh, tangent.bearings,
        -inverse.T * tangent.bearings, tangent.turned_on,
    )  # fmt: skip
    single = (np.ascontiguousarray(one, np.float32) for one in fixed)
    _run(*single, course, acting.on, acting.of, np.float32(tangent.step), substeps, tangent.finer, early,
         np.array(weights, np.float32), places, pushes)  # fmt: skip
    return places[..., :columns], pushes[:, :columns]


@compiled(fastmath=ROUNDING, **INLINED)
def _between(values: Single, here: int, there: int, part: np.float32, out: Single) -> None:
    """Into `out` (m,) the row of values (entries, m) that lies that part of the way from one to another."""
    for n in range(len(out)):
        out[n] = values[here, n] + part * (values[there, n] - values[here, n])


@compiled(fastmath=ROUNDING, **INLINED)
def _read(course: _Course, first: int, place: np.float32, out: _Course) -> None:
    """Into `out` what the course is `place` entries behind the first."""
    behind = int(place)
    part = place - np.float32(behind)
    here = (first + behind) % len(course.mesh)
    there = (here + 1) % len(course.mesh)
    _between(course.mesh, here, there, part, out.mesh)
    _between(course.pushed, here, there, part, out.pushed)
    _between(course.forces, here, there, part, out.forces)
    _between(course.stiffer, here, there, part, out.stiffer)


@compiled(fastmath=ROUNDING, **INLINED)
def _rates(
    q: Single, v: Single, springs: Single, dampers: Single, inverse: Single, mesh: Single, bearings: Single,
    held: Single, turned: Single, now: _Course, on: Integers, of: Integers, out: Single, push: Single,
) -> None:  # fmt: skip
    """Accelerations `out` (n, columns) and the force `push` (columns,) in the mesh."""
    size, columns = q.shape
    force, pushed, stiffer = now.forces, now.pushed, now.stiffer
    k, c, w = now.mesh[0], now.mesh[1], now.mesh[2]
    push[:] = 0.0
    for number in range(len(on)):
        if on[number] == IN_MESH:
            push[of[number]] += force[number]
    for i in range(size):
        if mesh[i] != 0.0:
            spring, damper = mesh[i] * k + turned[i] * w, mesh[i] * c
            for p in range(columns):
                push[p] += spring * q[i, p] + damper * v[i, p]
    for i in range(size):
        for p in range(columns):
            out[i, p] = pushed[i] * push[p]
        for j in range(size):
            if springs[i, j] != 0.0 or dampers[i, j] != 0.0:
                for p in range(columns):
                    out[i, p] += springs[i, j] * q[j, p] + dampers[i, j] * v[j, p]
    for number in range(len(on)):
        if on[number] != IN_MESH:
            out[on[number], of[number]] += inverse[on[number]] * force[number]
    for b in range(len(bearings)):
        for i in range(size):
            for j in range(size):
                if held[b, i] != 0.0 and bearings[b, j] != 0.0:
                    for p in range(columns):
                        out[i, p] += held[b, i] * stiffer[b] * bearings[b, j] * q[j, p]


@compiled(fastmath=ROUNDING, **INLINED)
def _gather(push: Single, weight: np.float32, number: int, pushes: Single) -> None:
    """Add a stage's part of the force in the mesh to that of its step."""
    if number >= 0 and weight > 0.0:
        for p in range(len(push)):
            pushes[number, p] += weight * push[p]


@compiled(fastmath=ROUNDING, **INLINED)
def _ahead(q: Single, v: Single, h: np.float32, rates: Single, accelerations: Single, q2: Single, v2: Single) -> None:
    """Places q2 and rates v2 (n, columns) after h [s] from q and v at these rates and accelerations."""
    for c in range(q.shape[0]):
        for p in range(q.shape[1]):
            q2[c, p] = q[c, p] + h * rates[c, p]
            v2[c, p] = v[c, p] + h * accelerations[c, p]


@compiled(fastmath=ROUNDING)
def _run(
    springs: Single, dampers: Single, inverse: Single, mesh: Single, bearings: Single, held: Single, turned: Single,
    course: _Course, on: Integers, of: Integers, step: np.float32, substeps: int, finer: int, early: int,
    weights: Single, places: Single, pushes: Single,
) -> None:  # fmt: skip
    """Fill places and pushes."""
    steps, size, columns = len(course.mesh) // 2, len(mesh), pushes.shape[1]
    q, v = np.zeros((size, columns), np.float32), np.zeros((size, columns), np.float32)
    q2, v2, v3, v4 = np.empty_like(q), np.empty_like(q), np.empty_like(q), np.empty_like(q)
    a1, a2, a3, a4 = np.empty_like(q), np.empty_like(q), np.empty_like(q), np.empty_like(q)
    push = np.empty(columns, np.float32)
    now = _Course(
        np.empty(3, np.float32), np.empty(size, np.float32), np.empty(len(on), np.float32),
        np.empty(len(bearings), np.float32),
    )  # fmt: skip
    h, stage = step / np.float32(finer), np.float32(1.0 / finer)
    # Over a whole step its steps count alike; at its beginning only the first does.
    shares = weights / np.float32(finer) if weights[1] > 0.0 else weights
    for number in range(-early, steps):
        first = (2 * number) % len(course.mesh)
        if number >= 0 and number % substeps == 0:
            sample = number // substeps
            for c in range(size):
                for p in range(columns):
                    places[sample, c, p] = q[c, p]
        for fine in range(finer):
            told = number if fine == 0 or weights[1] > 0.0 else -1
            place = TWO * np.float32(fine) * stage
            _read(course, first, place, now)
            _rates(q, v, springs, dampers, inverse, mesh, bearings, held, turned, now, on, of, a1, push)
            _gather(push, shares[0], told, pushes)
            _ahead(q, v, HALF * h, v, a1, q2, v2)
            _read(course, first, place + stage, now)
            _rates(q2, v2, springs, dampers, inverse, mesh, bearings, held, turned, now, on, of, a2, push)
            _gather(push, shares[1], told, pushes)
            _ahead(q, v, HALF * h, v2, a2, q2, v3)
            _rates(q2, v3, springs, dampers, inverse, mesh, bearings, held, turned, now, on, of, a3, push)
            _gather(push, shares[2], told, pushes)
            _ahead(q, v, h, v3, a3, q2, v4)
            _read(course, first, place + TWO * stage, now)
            _rates(q2, v4, springs, dampers, inverse, mesh, bearings, held, turned, now, on, of, a4, push)
            _gather(push, shares[3], told, pushes)
            for c in range(size):
                for p in range(columns):
                    q[c, p] += SIXTH * h * (v[c, p] + TWO * (v2[c, p] + v3[c, p]) + v4[c, p])
                    v[c, p] += SIXTH * h * (a1[c, p] + TWO * (a2[c, p] + a3[c, p]) + a4[c, p])
