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
largest departure.
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
    direction of a force in the mesh."""

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
    values = (
        -inverse * tangent.springs, -inverse * tangent.dampers, tangent.inverse, tangent.mesh,
        -tangent.inverse * (tangent.mesh + tangent.rubbed), tangent.stiffness, tangent.damping, acting.values,
        tangent.bearings, -inverse.T * tangent.bearings, tangent.stiffer, tangent.turned_on, tangent.turning,
    )  # fmt: skip
    single = (np.ascontiguousarray(one, np.float32) for one in values)
    _run(*single, acting.on, acting.of, np.float32(tangent.step), substeps, early, np.array(weights, np.float32),
         places, pushes)  # fmt: skip
    return places[..., :columns], pushes[:, :columns]


@compiled(fastmath=ROUNDING, **INLINED)
def _rates(
    q: Single, v: Single, springs: Single, dampers: Single, inverse: Single, mesh: Single, pushed: Single,
    k: np.float32, c: np.float32, force: Single, bearings: Single, held: Single, stiffer: Single, turned: Single,
    w: np.float32, on: Integers, of: Integers, out: Single, push: Single,
) -> None:  # fmt: skip
    """Accelerations `out` (n, columns) and the force `push` (columns,) in the mesh."""
    size, columns = q.shape
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


@compiled(fastmath=ROUNDING)
def _run(
    springs: Single, dampers: Single, inverse: Single, mesh: Single, pushed: Single, stiffness: Single,
    damping: Single, forces: Single, bearings: Single, held: Single, stiffer: Single, turned: Single, turning: Single,
    on: Integers, of: Integers, h: np.float32, substeps: int, early: int, weights: Single, places: Single,
    pushes: Single,
) -> None:  # fmt: skip
    """Fill places and pushes."""
    entries, size, columns = len(forces), len(mesh), pushes.shape[1]
    q, v = np.zeros((size, columns), np.float32), np.zeros((size, columns), np.float32)
    q2, v2, v3, v4 = np.empty_like(q), np.empty_like(q), np.empty_like(q), np.empty_like(q)
    a1, a2, a3, a4 = np.empty_like(q), np.empty_like(q), np.empty_like(q), np.empty_like(q)
    push = np.empty(columns, np.float32)
    steps = entries // 2
    for number in range(-early, steps):
        i = (2 * number) % entries
        middle, after = i + 1, (i + 2) % entries
        _rates(q, v, springs, dampers, inverse, mesh, pushed[i], stiffness[i], damping[i],
               forces[i], bearings, held, stiffer[i], turned, turning[i], on, of, a1, push)  # fmt: skip
        if number >= 0 and number % substeps == 0:
            sample = number // substeps
            for c in range(size):
                for p in range(columns):
                    places[sample, c, p] = q[c, p]
        _gather(push, weights[0], number, pushes)
        for c in range(size):
            for p in range(columns):
                q2[c, p] = q[c, p] + HALF * h * v[c, p]
                v2[c, p] = v[c, p] + HALF * h * a1[c, p]
        _rates(q2, v2, springs, dampers, inverse, mesh, pushed[middle], stiffness[middle], damping[middle],
               forces[middle], bearings, held, stiffer[middle], turned, turning[middle], on, of, a2, push)  # fmt: skip
        _gather(push, weights[1], number, pushes)
        for c in range(size):
            for p in range(columns):
                q2[c, p] = q[c, p] + HALF * h * v2[c, p]
                v3[c, p] = v[c, p] + HALF * h * a2[c, p]
        _rates(q2, v3, springs, dampers, inverse, mesh, pushed[middle], stiffness[middle], damping[middle],
               forces[middle], bearings, held, stiffer[middle], turned, turning[middle], on, of, a3, push)  # fmt: skip
        _gather(push, weights[2], number, pushes)
        for c in range(size):
            for p in range(columns):
                q2[c, p] = q[c, p] + h * v3[c, p]
                v4[c, p] = v[c, p] + h * a3[c, p]
        _rates(q2, v4, springs, dampers, inverse, mesh, pushed[after], stiffness[after], damping[after],
               forces[after], bearings, held, stiffer[after], turned, turning[after], on, of, a4, push)  # fmt: skip
        _gather(push, weights[3], number, pushes)
        for c in range(size):
            for p in range(columns):
                q[c, p] += SIXTH * h * (v[c, p] + TWO * (v2[c, p] + v3[c, p]) + v4[c, p])
                v[c, p] += SIXTH * h * (a1[c, p] + TWO * (a2[c, p] + a3[c, p]) + a4[c, p])
