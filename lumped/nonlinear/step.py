"""Classical fourth-order Runge-Kutta for the non-linear lumped model, compiled.

What varies with time is tabulated on the half-step grid (`tables`); the excitation is sampled there exactly. The
loop allocates nothing and releases the interpreter lock.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import INLINED, ROUNDING, compiled
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.nonlinear.coordinates import Coordinates, Further, parted
from gearbench.lumped.nonlinear.equations import Answer, Equations, answer
from gearbench.lumped.nonlinear.forces import apart_of, entry
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.tables import Table

Array = NDArray[np.float64]


class Outputs(NamedTuple):
    """What is seen at the start of each sample; arrays (samples,), the last six empty for a rig without structure."""

    u1: Array  # coordinates [m]
    y1: Array
    y2: Array
    u2: Array
    w: Array
    mesh_force: Array  # [N]
    load_force: Array  # at the load's base circle [N]
    load: Array  # further coordinates [m]
    housing: Array
    rocking: Array
    x1: Array
    x2: Array
    drive_force: Array  # at the driver's base circle [N]


PLAIN = 7  # columns of a rig without structure


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
    load_forces: Array | None = None,
) -> tuple[Array, Array]:
    """Run through the whole `table` of entries + 1 from `state` (2 size,): coordinates [m] and their rates.

    `force` (n,) [N] is T1/rb1 on the half-step grid; it repeats, and `first_entry` of it belongs to the table's first.
    `mesh_frequency` [Hz]: that of the table, for the steady part of the sliding velocity. `load_forces` (steps,) takes
    the force at the load's base circle [N] at the start of every step.
    Returns the final state and the samples (samples, 7 or 12), named by `columns`. Raises LumpedError for tables
    that do not fit and for overflow.
    """
    entries = len(table.position) - 1
    if entries % (2 * substeps) or force.size % 2 or first_entry % 2:
        raise LumpedError(f"{entries} entries do not hold whole samples of {substeps} steps")
    state = np.asarray(state, dtype=float)
    size, structure = model.size, model.structure
    if state.shape != (2 * size,):
        raise LumpedError(f"the state has shape {state.shape}, not ({2 * size},)")
    width = PLAIN if structure is None else len(Outputs._fields)
    # Columns lie in one piece however many samples there are: the loop is compiled anew for every other layout.
    samples = np.empty((width, entries // (2 * substeps))).T
    equations = Equations(
        secant=np.ascontiguousarray(model.law.secant),
        apart=apart_of(table, model.law),
        constants=model.constants(),
        rubbing=model.rubbing(mesh_frequency),
        structure=structure or (),
        free=1.0 if model.free else 0.0,
        mean=float(force.mean()),
        drive_end=model.ends[0],
        load_end=model.ends[1],
    )
    place, further = parted(state[:size])
    rate, further_rate = parted(state[size:])
    end = _run(
        place, rate, further, further_rate, table, force, first_entry, equations, step, substeps, columns(samples),
        np.empty(0) if load_forces is None else load_forces,
    )  # fmt: skip
    final = np.array([*end[0], *end[2], *end[1], *end[3]])
    if not np.isfinite(final).all():
        raise LumpedError(f"the integration overflowed: steps of {step:.3g} s are too long")
    return final, samples


def columns(samples: Array) -> Outputs:
    """The columns of samples (..., 7 or 12) by their names."""
    found = [*np.moveaxis(samples, -1, 0)]
    return Outputs(*found, *(np.empty(0) for _ in range(len(Outputs._fields) - len(found))))


@compiled(fastmath=ROUNDING, **INLINED)
def _moved(q: Coordinates, h: float, v: Coordinates) -> Coordinates:
    """q + h v."""
    return Coordinates(q.u1 + h * v.u1, q.y1 + h * v.y1, q.y2 + h * v.y2, q.u2 + h * v.u2, q.w + h * v.w)


@compiled(fastmath=ROUNDING, **INLINED)
def _mean(h: float, one: float, two: float, three: float, four: float) -> float:
    """Change in a sixth h of a step by the rates at its four stages."""
    return h * (one + 2.0 * (two + three) + four)


@compiled(fastmath=ROUNDING, **INLINED)
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


@compiled(fastmath=ROUNDING, **INLINED)
def _moved_further(e: Any, h: float, r: Any) -> Any:
    """e + h r."""
    if len(e) == 0:
        return ()
    return Further(
        load=e.load + h * r.load,
        housing=e.housing + h * r.housing,
        rocking=e.rocking + h * r.rocking,
        x1=e.x1 + h * r.x1,
        x2=e.x2 + h * r.x2,
    )


@compiled(fastmath=ROUNDING, **INLINED)
def _stepped_further(e: Any, h: float, one: Any, two: Any, three: Any, four: Any) -> Any:
    """e after a step of which h is the sixth part."""
    if len(e) == 0:
        return ()
    return Further(
        e.load + _mean(h, one.load, two.load, three.load, four.load),
        e.housing + _mean(h, one.housing, two.housing, three.housing, four.housing),
        e.rocking + _mean(h, one.rocking, two.rocking, three.rocking, four.rocking),
        e.x1 + _mean(h, one.x1, two.x1, three.x1, four.x1),
        e.x2 + _mean(h, one.x2, two.x2, three.x2, four.x2),
    )


@compiled(**INLINED)
def _tell_further(out: Outputs, sample: int, e: Any, one: Answer) -> None:
    """Write what only a rig with structure has."""
    if len(e) != 0:
        out.load[sample], out.housing[sample], out.rocking[sample], out.x1[sample], out.x2[sample] = e
        out.drive_force[sample] = one.drive_force


@compiled(fastmath=ROUNDING)
def _run(
    q: Coordinates, v: Coordinates, e: Any, r: Any, table: Table, force: Array, first: int, of: Equations, h: float,
    substeps: int, out: Outputs, load_forces: Array,
) -> tuple[Coordinates, Coordinates, Any, Any]:  # fmt: skip
    """Fill `out` and `load_forces`, if it holds any, from the coordinates q, e and rates v, r; returns those at the
    end."""
    half, sixth = 0.5 * h, h / 6.0
    n = force.size
    i, j = 0, first % n
    for sample in range(len(out.u1)):
        out.u1[sample], out.y1[sample], out.y2[sample], out.u2[sample], out.w[sample] = q
        for sub in range(substeps):
            one = answer(q, v, e, r, entry(table, i), force[j], of)
            if sub == 0:
                out.mesh_force[sample], out.load_force[sample] = one.mesh_force, one.load_force
                _tell_further(out, sample, e, one)
            if len(load_forces) > 0:
                load_forces[i // 2] = one.load_force
            middle = entry(table, i + 1)
            v2, r2 = _moved(v, half, one.acceleration), _moved_further(r, half, one.further)
            two = answer(_moved(q, half, v), v2, _moved_further(e, half, r), r2, middle, force[j + 1], of)
            v3, r3 = _moved(v, half, two.acceleration), _moved_further(r, half, two.further)
            three = answer(_moved(q, half, v2), v3, _moved_further(e, half, r2), r3, middle, force[j + 1], of)
            i += 2
            j = j + 2 if j + 2 < n else 0
            v4, r4 = _moved(v, h, three.acceleration), _moved_further(r, h, three.further)
            four = answer(_moved(q, h, v3), v4, _moved_further(e, h, r3), r4, entry(table, i), force[j], of)
            q, e = _stepped(q, sixth, v, v2, v3, v4), _stepped_further(e, sixth, r, r2, r3, r4)
            v = _stepped(v, sixth, one.acceleration, two.acceleration, three.acceleration, four.acceleration)
            r = _stepped_further(r, sixth, one.further, two.further, three.further, four.further)
    return q, v, e, r
