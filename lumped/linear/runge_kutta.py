"""Classical fourth-order Runge-Kutta for the three-degree-of-freedom model, compiled.

Everything that varies with time is tabulated beforehand on the half-step grid, because the method looks
at the start, the middle and the end of a step: the mesh over the smallest number of mesh periods that
holds a whole number of steps, the excitation over its own period. Nothing is interpolated, so a
band-limited excitation stays exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import ROUNDING, compiled
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.linear.model import STATES, Lumped, Parameters

Array = NDArray[np.float64]


class Mesh(NamedTuple):
    """The mesh on the half-step grid, arrays (entries,): entry 2 n belongs to the start of step n; it repeats."""

    stiffness: Array  # [N/m]
    damping: Array  # [N s/m]
    force: Array  # k e + c e' [N] of the static transmission error


class Outputs(NamedTuple):
    """What is seen at the start of each sample; arrays (samples,)."""

    x: Array  # coordinates [m]
    y1: Array
    y2: Array
    mesh_force: Array  # [N]


class Coordinates(NamedTuple):
    """The coordinates [m] of the model, or their rates or accelerations."""

    x: float
    y1: float
    y2: float


@dataclass(frozen=True)
class Tables:
    """What the integrator reads; `step` is in s."""

    mesh: Mesh
    parameters: Parameters
    step: float


def tabulate(model: Lumped, *, cycles: int, steps: int, step: float) -> Tables:
    """Tables of a model whose mesh runs through `cycles` periods in `steps` steps of `step` [s], from
    phase 0.

    Switches of the stiffness narrower than two steps are widened to that, so that their instants are kept.
    """
    numbers = np.arange(2 * steps)
    # Whole numbers until the last division: the phase does not drift.
    phase = (cycles * numbers % (2 * steps)) / (2 * steps)
    k = model.stiffness.at(phase, finest=2 * cycles / steps)
    c = model.mesh_damping(k)
    error, slope = model.transmission_error(phase)
    frequency = cycles / (steps * step)
    return Tables(Mesh(k, c, k * error + c * slope * frequency), model.parameters, step)


def integrate(
    tables: Tables, force: Array, state: Array, *, samples: int, substeps: int, first_step: int = 0
) -> tuple[Array, Array]:
    """Run `samples` x `substeps` steps from step number `first_step` and `state` (6,).

    `force` (entries,) [N] is the generalised force on the half-step grid; it repeats. Returns the final
    state and the samples (samples, 4), named by `columns`.
    Pure: inputs stay as they are. Releases the GIL. Raises LumpedError for odd or empty tables and states
    that have overflowed.
    """
    for name, size in (("mesh", tables.mesh.stiffness.size), ("force", force.size)):
        if size == 0 or size % 2:
            raise LumpedError(f"the {name} table has {size} entries; the half-step grid needs an even number")
    state = np.asarray(state, dtype=float)
    if state.shape != (STATES,):
        raise LumpedError(f"the state has shape {state.shape}, not ({STATES},)")
    out = np.empty((samples, len(Outputs._fields)))
    excitation = np.ascontiguousarray(force, dtype=float)
    place, rate = Coordinates(*state[: STATES // 2]), Coordinates(*state[STATES // 2 :])
    place, rate = _run(
        place, rate, tables.mesh, excitation, tables.parameters, tables.step, substeps, first_step,
        columns(out),
    )  # fmt: skip
    final = np.array([*place, *rate])
    if not np.isfinite(final).all():
        raise LumpedError(f"the integration overflowed: steps of {tables.step:.3g} s are too long")
    return final, out


def columns(samples: Array) -> Outputs:
    """The columns of samples (..., 4) by their names."""
    return Outputs(*np.moveaxis(samples, -1, 0))


@compiled(fastmath=ROUNDING)
def _run(
    q: Coordinates,
    rate: Coordinates,
    mesh: Mesh,
    force: Array,
    p: Parameters,
    h: float,
    substeps: int,
    first: int,
    out: Outputs,
) -> tuple[Coordinates, Coordinates]:
    """Fill `out` from the coordinates q and their rates; returns those at the end. In the loop x, y, z are the
    coordinates, u, v, w their rates."""
    a, g = 1.0 / p.mesh_mass, p.support_factor
    g1, g2 = g / p.mass1, g / p.mass2
    s1, s2 = p.stiffness1 / p.mass1, p.stiffness2 / p.mass2
    d1, d2 = p.damping1 / p.mass1, p.damping2 / p.mass2
    half, sixth = 0.5 * h, h / 6.0
    stiffness, damping, rest = mesh.stiffness, mesh.damping, mesh.force
    last_mesh, last_force = len(stiffness), force.size
    i, j = (2 * first) % last_mesh, (2 * first) % last_force
    x, y, z, u, v, w = q.x, q.y1, q.y2, rate.x, rate.y1, rate.y2
    for sample in range(len(out.x)):
        out.x[sample], out.y1[sample], out.y2[sample] = x, y, z
        out.mesh_force[sample] = stiffness[i] * (x + g * (y - z)) + damping[i] * (u + g * (v - w)) - rest[i]
        for _ in range(substeps):
            # Stage a, start of the step: accelerations au, av, aw from the mesh force fm.
            fm = stiffness[i] * (x + g * (y - z)) + damping[i] * (u + g * (v - w)) - rest[i]
            au, av, aw = a * (force[j] - fm), -g1 * fm - d1 * v - s1 * y, g2 * fm - d2 * w - s2 * z
            # Stages b and c, middle of the step.
            k, c, e, f = stiffness[i + 1], damping[i + 1], rest[i + 1], force[j + 1]
            xb, yb, zb = x + half * u, y + half * v, z + half * w
            ub, vb, wb = u + half * au, v + half * av, w + half * aw
            fm = k * (xb + g * (yb - zb)) + c * (ub + g * (vb - wb)) - e
            bu, bv, bw = a * (f - fm), -g1 * fm - d1 * vb - s1 * yb, g2 * fm - d2 * wb - s2 * zb
            xc, yc, zc = x + half * ub, y + half * vb, z + half * wb
            uc, vc, wc = u + half * bu, v + half * bv, w + half * bw
            fm = k * (xc + g * (yc - zc)) + c * (uc + g * (vc - wc)) - e
            cu, cv, cw = a * (f - fm), -g1 * fm - d1 * vc - s1 * yc, g2 * fm - d2 * wc - s2 * zc
            # Stage d, end of the step.
            i = i + 2 if i + 2 < last_mesh else 0
            j = j + 2 if j + 2 < last_force else 0
            xd, yd, zd = x + h * uc, y + h * vc, z + h * wc
            ud, vd, wd = u + h * cu, v + h * cv, w + h * cw
            fm = stiffness[i] * (xd + g * (yd - zd)) + damping[i] * (ud + g * (vd - wd)) - rest[i]
            du, dv, dw = a * (force[j] - fm), -g1 * fm - d1 * vd - s1 * yd, g2 * fm - d2 * wd - s2 * zd
            x += sixth * (u + 2.0 * (ub + uc) + ud)
            y += sixth * (v + 2.0 * (vb + vc) + vd)
            z += sixth * (w + 2.0 * (wb + wc) + wd)
            u += sixth * (au + 2.0 * (bu + cu) + du)
            v += sixth * (av + 2.0 * (bv + cv) + dv)
            w += sixth * (aw + 2.0 * (bw + cw) + dw)
    return Coordinates(x, y, z), Coordinates(u, v, w)
