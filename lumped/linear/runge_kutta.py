"""Classical fourth-order Runge-Kutta for the three-degree-of-freedom model, compiled.

Everything that varies with time is tabulated beforehand on the half-step grid, because the method looks
at the start, the middle and the end of a step: the mesh over the smallest number of mesh periods that
holds a whole number of steps, the excitation over its own period. Nothing is interpolated, so a
band-limited excitation stays exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import ROUNDING, compiled
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.linear.model import STATES, Lumped

Array = NDArray[np.float64]

OUTPUTS = ("x", "y1", "y2", "mesh_force")


@dataclass(frozen=True)
class Tables:
    """What the integrator reads, on the half-step grid: entry 2 n belongs to the start of step n.

    `mesh` (entries, 3) holds stiffness [N/m], damping [N s/m] and the force k e + c e' [N] of the static
    transmission error, and repeats; `parameters` are those of `Lumped.parameters`; `step` is in s.
    """

    mesh: Array
    parameters: Array
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
    mesh = np.stack([k, c, k * error + c * slope * frequency], axis=1)
    return Tables(np.ascontiguousarray(mesh), model.parameters, step)


def integrate(
    tables: Tables, force: Array, state: Array, *, samples: int, substeps: int, first_step: int = 0
) -> tuple[Array, Array]:
    """Run `samples` x `substeps` steps from step number `first_step` and `state` (6,).

    `force` (entries,) [N] is the generalised force on the half-step grid; it repeats. Returns the final
    state and the outputs (samples, 4) = x, y1, y2 [m] and mesh force [N] at the start of each sample.
    Pure: inputs stay as they are. Releases the GIL. Raises LumpedError for odd or empty tables and states
    that have overflowed.
    """
    for name, size in (("mesh", tables.mesh.shape[0]), ("force", force.size)):
        if size == 0 or size % 2:
            raise LumpedError(f"the {name} table has {size} entries; the half-step grid needs an even number")
    final = np.array(state, dtype=float)
    if final.shape != (STATES,):
        raise LumpedError(f"the state has shape {final.shape}, not ({STATES},)")
    out = np.empty((samples, len(OUTPUTS)))
    excitation = np.ascontiguousarray(force, dtype=float)
    _run(final, tables.mesh, excitation, tables.parameters, tables.step, substeps, first_step, out)
    if not np.isfinite(final).all():
        raise LumpedError(f"the integration overflowed: steps of {tables.step:.3g} s are too long")
    return final, out


@compiled(fastmath=ROUNDING)
def _run(
    state: Array,
    mesh: Array,
    force: Array,
    parameters: Array,
    h: float,
    substeps: int,
    first: int,
    out: Array,
) -> None:
    """Advance `state` in place and fill `out`; x, y, z are the coordinates, u, v, w their rates."""
    a, g = 1.0 / parameters[0], parameters[1]
    g1, g2 = g / parameters[2], g / parameters[3]
    s1, s2 = parameters[4] / parameters[2], parameters[5] / parameters[3]
    d1, d2 = parameters[6] / parameters[2], parameters[7] / parameters[3]
    half, sixth = 0.5 * h, h / 6.0
    last_mesh, last_force = mesh.shape[0], force.size
    i, j = (2 * first) % last_mesh, (2 * first) % last_force
    x, y, z, u, v, w = state[0], state[1], state[2], state[3], state[4], state[5]
    for sample in range(out.shape[0]):
        out[sample, 0], out[sample, 1], out[sample, 2] = x, y, z
        out[sample, 3] = mesh[i, 0] * (x + g * (y - z)) + mesh[i, 1] * (u + g * (v - w)) - mesh[i, 2]
        for _ in range(substeps):
            # Stage a, start of the step: accelerations au, av, aw from the mesh force fm.
            fm = mesh[i, 0] * (x + g * (y - z)) + mesh[i, 1] * (u + g * (v - w)) - mesh[i, 2]
            au, av, aw = a * (force[j] - fm), -g1 * fm - d1 * v - s1 * y, g2 * fm - d2 * w - s2 * z
            # Stages b and c, middle of the step.
            k, c, e, f = mesh[i + 1, 0], mesh[i + 1, 1], mesh[i + 1, 2], force[j + 1]
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
            fm = mesh[i, 0] * (xd + g * (yd - zd)) + mesh[i, 1] * (ud + g * (vd - wd)) - mesh[i, 2]
            du, dv, dw = a * (force[j] - fm), -g1 * fm - d1 * vd - s1 * yd, g2 * fm - d2 * wd - s2 * zd
            x += sixth * (u + 2.0 * (ub + uc) + ud)
            y += sixth * (v + 2.0 * (vb + vc) + vd)
            z += sixth * (w + 2.0 * (wb + wc) + wd)
            u += sixth * (au + 2.0 * (bu + cu) + du)
            v += sixth * (av + 2.0 * (bv + cv) + dv)
            w += sixth * (aw + 2.0 * (bw + cw) + dw)
    state[0], state[1], state[2], state[3], state[4], state[5] = x, y, z, u, v, w
