"""Classical fourth-order Runge-Kutta for the non-linear lumped model, compiled.

What varies with time is tabulated on the half-step grid (`mesh_tables`); the excitation is sampled there exactly. The
loop allocates nothing and releases the interpreter lock.
"""

from __future__ import annotations

from math import copysign, sqrt, tanh

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import ROUNDING, compiled
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.nonlinear.model import COORDINATES, Constants, NonLinear, Rubbing
from gearbench.lumped.nonlinear.tables import BACK, EXCESS, EXCESS_RATE, GAIN, POSITION, RIPPLE

Array = NDArray[np.float64]

OUTPUTS = ("u1", "y1", "y2", "u2", "w", "mesh_force", "load_force")


def integrate(
    model: NonLinear,
    table: Array,
    force: Array,
    state: Array,
    *,
    step: float,
    substeps: int,
    mesh_frequency: float,
    first_entry: int = 0,
) -> tuple[Array, Array]:
    """Run through the whole `table` (entries + 1, columns of `mesh_tables`) from `state` (2 COORDINATES,).

    `force` (n,) [N] is T1/rb1 on the half-step grid; it repeats, and `first_entry` of it belongs to the table's first.
    `mesh_frequency` [Hz]: that of the table, for the steady part of the sliding velocity.
    Returns the final state and OUTPUTS (samples, 7) at the start of each sample: coordinates [m], mesh force and force
    at the load's base circle [N]. Raises LumpedError for tables that do not fit and for overflow.
    """
    entries = len(table) - 1
    if entries % (2 * substeps) or force.size % 2 or first_entry % 2:
        raise LumpedError(f"{entries} entries do not hold whole samples of {substeps} steps")
    final = np.array(state, dtype=float)
    if final.shape != (2 * COORDINATES,):
        raise LumpedError(f"the state has shape {final.shape}, not ({2 * COORDINATES},)")
    out = np.empty((entries // (2 * substeps), len(OUTPUTS)))
    secant = np.ascontiguousarray(model.law.secant)
    free = 1.0 if model.free else 0.0
    rubbing = model.rubbing(mesh_frequency)
    _run(final, table, force, first_entry, secant, model.constants(), rubbing, free, step, substeps, out)
    if not np.isfinite(final).all():
        raise LumpedError(f"the integration overflowed: steps of {step:.3g} s are too long")
    return final, out


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
def _mesh(travel: float, rate: float, table: Array, i: int, secant: Array, p: Constants) -> float:
    """Mesh force [N] at dte `travel` [m] and its rate [m/s]; negative on the back flanks."""
    depth = travel + table[i, EXCESS]
    if depth > 0.0:
        return _pressed(depth, rate + table[i, EXCESS_RATE], table[i, POSITION], table[i, GAIN], secant, p)
    depth = table[i, BACK] - travel - p.backlash
    if depth > 0.0:
        rows = secant.shape[0] - 1
        position = p.mirror - table[i, POSITION]
        if position < 0.0:
            position += rows
        return -_pressed(depth, -rate, min(position, rows * (1.0 - 1e-16)), table[i, GAIN], secant, p)
    return 0.0


@compiled(fastmath=ROUNDING)
def _spring(y: float, stiffness: float, exponent: float, reference: float) -> float:
    """Force [N] of a support."""
    if exponent == 0.0:
        return stiffness * y
    return stiffness * reference * copysign((abs(y) / reference) ** (1.0 + exponent), y)


@compiled(fastmath=ROUNDING)
def _friction(va: float, vb: float, vc: float, vd: float, position: float, r: Rubbing) -> tuple[float, float, float]:
    """Friction on driver rotation, supports and driven rotation per normal force, at the rates of u1, y1, y2, u2."""
    row = int(position)
    weight = position - row
    cycle = position / (r.share.shape[0] - 1)
    # The sliding velocity is linear in the distance from the pitch point.
    middle = r.centre1 * va - r.centre2 * vd + r.slide * (vb - vc)
    slope = r.drift + r.pitch1 * va + r.pitch2 * vd
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
def _rates(a, b, c, d, e, va, vb, vc, vd, ve, table, i, force, secant, p, r, free):  # type: ignore[no-untyped-def]
    """Accelerations of u1, y1, y2, u2, w, the mesh force and the force at the load's base circle."""
    f = _mesh(a - d + p.factor * (b - c), va - vd + p.factor * (vb - vc), table, i, secant, p)
    pull, pull_y, pull2 = 0.0, 0.0, 0.0
    if r is not None and f > 0.0:  # without friction r is None, known to the compiler
        pull, pull_y, pull2 = _friction(va, vb, vc, vd, table[i, POSITION], r)
        pull, pull_y, pull2 = f * pull, f * pull_y, f * pull2
    shaft = p.shaft_stiffness * (e - a) + p.shaft_damping * (ve - va)
    drive = force + table[i, RIPPLE]
    load = free * (force - pull) + (1.0 - free) * f + pull2
    across = p.factor * f + pull_y
    return (
        p.inverse_u1 * (p.rigid * drive + shaft - f - pull),
        p.inverse_y1 * (-across - p.damping1 * vb - _spring(b, p.stiffness1, p.exponent1, p.reference1)),
        p.inverse_y2 * (across - p.damping2 * vc - _spring(c, p.stiffness2, p.exponent2, p.reference2)),
        p.inverse_u2 * (f + pull2 - load),
        p.inverse_w * (drive - shaft),
        f,
        load,
    )


@compiled(fastmath=ROUNDING)
def _run(
    state: Array, table: Array, force: Array, first: int, secant: Array, p: Constants, r: Rubbing | None, free: float,
    h: float, substeps: int, out: Array,
) -> None:  # fmt: skip
    """Advance `state` in place and fill `out`. Letters: a u1, b y1, c y2, d u2, e w; v their rates, k accelerations;
    1 to 4 the stages."""
    half, sixth = 0.5 * h, h / 6.0
    n = force.size
    i, j = 0, first % n
    a, b, c, d, e = state[0], state[1], state[2], state[3], state[4]
    va, vb, vc, vd, ve = state[5], state[6], state[7], state[8], state[9]
    for sample in range(out.shape[0]):
        out[sample, 0], out[sample, 1], out[sample, 2], out[sample, 3], out[sample, 4] = a, b, c, d, e
        for sub in range(substeps):
            ka1, kb1, kc1, kd1, ke1, f, load = _rates(
                a, b, c, d, e, va, vb, vc, vd, ve, table, i, force[j], secant, p, r, free
            )
            if sub == 0:
                out[sample, 5], out[sample, 6] = f, load
            va2, vb2, vc2 = va + half * ka1, vb + half * kb1, vc + half * kc1
            vd2, ve2 = vd + half * kd1, ve + half * ke1
            ka2, kb2, kc2, kd2, ke2, f, load = _rates(
                a + half * va, b + half * vb, c + half * vc, d + half * vd, e + half * ve,
                va2, vb2, vc2, vd2, ve2, table, i + 1, force[j + 1], secant, p, r, free,
            )  # fmt: skip
            va3, vb3, vc3 = va + half * ka2, vb + half * kb2, vc + half * kc2
            vd3, ve3 = vd + half * kd2, ve + half * ke2
            ka3, kb3, kc3, kd3, ke3, f, load = _rates(
                a + half * va2, b + half * vb2, c + half * vc2, d + half * vd2, e + half * ve2,
                va3, vb3, vc3, vd3, ve3, table, i + 1, force[j + 1], secant, p, r, free,
            )  # fmt: skip
            i += 2
            j = j + 2 if j + 2 < n else 0
            va4, vb4, vc4, vd4, ve4 = va + h * ka3, vb + h * kb3, vc + h * kc3, vd + h * kd3, ve + h * ke3
            ka4, kb4, kc4, kd4, ke4, f, load = _rates(
                a + h * va3, b + h * vb3, c + h * vc3, d + h * vd3, e + h * ve3,
                va4, vb4, vc4, vd4, ve4, table, i, force[j], secant, p, r, free,
            )  # fmt: skip
            a += sixth * (va + 2.0 * (va2 + va3) + va4)
            b += sixth * (vb + 2.0 * (vb2 + vb3) + vb4)
            c += sixth * (vc + 2.0 * (vc2 + vc3) + vc4)
            d += sixth * (vd + 2.0 * (vd2 + vd3) + vd4)
            e += sixth * (ve + 2.0 * (ve2 + ve3) + ve4)
            va += sixth * (ka1 + 2.0 * (ka2 + ka3) + ka4)
            vb += sixth * (kb1 + 2.0 * (kb2 + kb3) + kb4)
            vc += sixth * (kc1 + 2.0 * (kc2 + kc3) + kc4)
            vd += sixth * (kd1 + 2.0 * (kd2 + kd3) + kd4)
            ve += sixth * (ke1 + 2.0 * (ke2 + ke3) + ke4)
    state[0], state[1], state[2], state[3], state[4] = a, b, c, d, e
    state[5], state[6], state[7], state[8], state[9] = va, vb, vc, vd, ve
