"""The non-linear lumped model at rest: deflection under load over the mesh cycle, and its small vibrations."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.record.attributes import turning_inertias
from gearbench.bench.record.static import Loads, load_key, static_dataset
from gearbench.bench.refusals.effects import refuse_unknown
from gearbench.bench.refusals.load_range import check_dte
from gearbench.fem.limits import LOAD_RANGE
from gearbench.geometry import Pair, pair
from gearbench.lumped.nonlinear.coordinates import HOUSING, LOAD, U1, U2, Y1, Y2, W
from gearbench.lumped.nonlinear.model import NonLinear, nonlinear_model
from gearbench.lumped.nonlinear.pressing import alike, pressed, travel_under, turning
from gearbench.lumped.nonlinear.rest import inverse_masses, mesh_direction
from gearbench.lumped.nonlinear.tables import Motion, instants, tables
from gearbench.rig import Case
from gearbench.rig.neutral import even_gear

Array = NDArray[np.float64]

STIFFEST = 20e9  # stiffness of the stiffest imaginable teeth per face width [N/m^2]


def static_nonlinear(case: Case, loads: Loads, phase: Array) -> xr.Dataset:
    """Static response with errors and cracks as the first pairs have them, from mesh phase 0; no friction."""
    refuse_unknown(case.rig)
    meshing = pair(case.rig)
    radius = meshing.driver.base_radius
    unit, values = loads
    most = float(values.max())
    if unit == "m":
        if case.simulation.mesh_stiffness == "finite-element":
            check_dte(meshing, most, load_key(unit)[0], LOAD_RANGE[1] / STIFFEST)
        # The torque that this deflection needs at most.
        most *= STIFFEST * meshing.face_width * radius
    law = mesh_law(case.rig, case.simulation, most)
    model = nonlinear_model(case.rig, meshing, law)
    table = tables(model, Motion(cycles=1.0, entries=len(phase), step=1.0))
    at = instants(model, table, -1)
    shape = (len(values), len(phase))
    if unit == "N m":
        dte = travel_under(model.law, at, np.broadcast_to(values[:, None] / radius, shape))
    else:
        dte = np.broadcast_to(values[:, None], shape)
    force, tangent = pressed(model.law, at, dte)
    return static_dataset(
        loads,
        phase,
        transmission_error=dte,
        torque=force * radius,
        secant=force / dte,
        tangent=tangent,
        attributes={"model": "lumped", "mesh": "non-linear", "base_radius_driver": radius},
    )


def linearised_matrices(
    case: Case, meshing: Pair, phases: int, first: float = 0.0
) -> tuple[Array, Array, Array]:
    """A (phases, n, n), B (n,), C (n,) of small vibrations about rest under the mean torque: F to DTE, teeth sound, at
    phases that are evenly spread from the `first` [cycles].

    States: relative displacements that the rig's springs see, then their rates; the motion of both gears together,
    which changes nothing, is left out.
    """
    gears = {"driver": even_gear(case.rig.driver), "driven": even_gear(case.rig.driven)}
    rig = case.rig.model_copy(update=gears)
    force = case.experiment.torque_mean / meshing.driver.base_radius
    law = mesh_law(rig, case.simulation, 2 * case.experiment.torque_mean)
    model = nonlinear_model(rig, meshing, law)
    rest = model.equilibrium(force, alike(np.zeros(1)))[: model.size]
    first += model.twisted_on(force) + float(model.turned_on(rest))
    table = tables(model, Motion(cycles=1.0, entries=phases, step=1.0, first_phase=first))
    at = instants(model, table, -1)
    travel = travel_under(model.law, at, np.array(force))
    tangent = pressed(model.law, at, travel).tangent
    onward = turning(model.law, at, lambda there: pressed(model.law, there, travel).force)
    seen = _relative(model)
    back = np.linalg.pinv(seen)
    size, n = model.size, len(seen)
    a = np.zeros((phases, 2 * n, 2 * n))
    a[:, :n, n:] = np.eye(n)
    for row, stiffness, slope in zip(a, tangent, onward, strict=True):
        full = model.linearised(float(stiffness), force, float(slope))
        row[n:, :n] = seen @ full[size:, :size] @ back
        row[n:, n:] = seen @ full[size:, size:] @ back
    dte = mesh_direction(model.constants(), model.structure) @ back
    return a, np.concatenate([np.zeros(n), seen @ _push(model)]), np.concatenate([dte, np.zeros(n)])


def _push(model: NonLinear) -> Array:
    """Accelerations of the coordinates per generalised force [1/kg]: the driver's torque, and the load's where it
    balances that."""
    c, s = model.constants(), model.structure
    push = np.zeros(model.size)
    push[U1], push[W] = c.rigid * c.inverse_u1, c.inverse_w
    if s is None:
        push[U2] = -c.inverse_u2
    else:
        push[U2], push[LOAD] = -s.follow * s.rigid_load * c.inverse_u2, -s.follow * s.inverse_load
    if model.rig.load.boundary == "inertia":
        # The force then is less than that of the driver's torque alone: the load's does not help it.
        one, two = turning_inertias(model.rig, pair(model.rig))
        (r1, r2) = model.base_radii
        push *= 1 + (one / r1**2) / (two / r2**2)
    return push


def _relative(model: NonLinear) -> Array:
    """Relative displacements (n, size) of the coordinates that move: of what turns, and of the centres."""
    rows, moves = np.eye(model.size), inverse_masses(model.constants(), model.structure) > 0
    if not model.free:
        return np.asarray(rows[moves])
    seen = [rows[U1] - rows[U2], rows[Y1], rows[Y2]]
    if moves[W]:
        seen.append(rows[W] - rows[U1])
    if model.structure is not None:
        if moves[LOAD]:
            seen.append(rows[U2] - rows[LOAD])
        seen += [rows[i] for i in range(HOUSING, model.size) if moves[i]]
    return np.array(seen)
