"""The non-linear lumped model at rest: deflection under load over the mesh cycle, and its small vibrations."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.record.static import Loads, load_key, static_dataset
from gearbench.bench.refusals.effects import refuse_unknown
from gearbench.bench.refusals.load_range import check_dte
from gearbench.fem.contact.curve import LOAD_RANGE
from gearbench.geometry import Pair, pair
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.model import COORDINATES, NonLinear, nonlinear_model
from gearbench.lumped.nonlinear.tables import Motion, tables
from gearbench.rig import Case
from gearbench.rig.neutral import sound_gear

Array = NDArray[np.float64]

BISECTIONS = 60
STIFFEST = 20e9  # stiffness of the stiffest imaginable teeth per face width [N/m^2]


def deflection(law: MeshLaw, force: Array, phase: Array) -> Array:
    """Deflection [m] at which the law gives the forces > 0 [N] at the phases (shapes broadcast), by bisection."""
    force, phase = np.broadcast_arrays(force, phase)
    high = np.full(force.shape, law.approach[-1])
    while np.any(short := law.evaluate(high, phase)[0] < force):
        high = np.where(short, 2 * high, high)
    low = np.zeros_like(high)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = law.evaluate(middle, phase)[0] < force
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


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
    excess, gain = table.excess[:-1], table.gain[:-1]
    shape = (len(values), len(phase))
    if unit == "N m":
        force = np.broadcast_to(values[:, None] / radius, shape)
        dte = deflection(law, force / gain, phase) - excess
    else:
        dte = np.broadcast_to(values[:, None], shape)
        force = gain * law.evaluate(dte + excess, phase)[0]
    tangent = gain * law.evaluate(dte + excess, phase)[1]
    return static_dataset(
        loads,
        phase,
        transmission_error=dte,
        torque=force * radius,
        secant=force / dte,
        tangent=tangent,
        attributes={"model": "lumped", "mesh": "non-linear", "base_radius_driver": radius},
    )


def linearised_matrices(case: Case, meshing: Pair, phases: int) -> tuple[Array, Array, Array]:
    """A (phases, n, n), B (n,), C (n,) of small vibrations about rest under the mean torque: F to DTE, teeth sound.

    States: relative displacements that the rig's springs see, then their rates; the motion of both gears together,
    which changes nothing, is left out.
    """
    rig = case.rig.model_copy(update={"driver": sound_gear(case.rig.driver), "driven": sound_gear(case.rig.driven)})
    force = case.experiment.torque_mean / meshing.driver.base_radius
    law = mesh_law(rig, case.simulation, 2 * case.experiment.torque_mean)
    model = nonlinear_model(rig, meshing, law)
    gain = tables(model, Motion(cycles=1.0, entries=phases, step=1.0)).gain[:-1]
    phase = np.arange(phases) / phases
    tangent = gain * law.evaluate(deflection(law, force / gain, phase), phase)[1]
    seen = _relative(model)
    back = np.linalg.pinv(seen)
    size, n = COORDINATES, len(seen)
    a = np.zeros((phases, 2 * n, 2 * n))
    a[:, :n, n:] = np.eye(n)
    for row, stiffness in zip(a, tangent, strict=True):
        full = model.linearised(float(stiffness), force)
        row[n:, :n] = seen @ full[size:, :size] @ back
        row[n:, n:] = seen @ full[size:, size:] @ back
    c = model.constants()
    push = np.array([c.rigid * c.inverse_u1, 0.0, 0.0, -c.inverse_u2, c.inverse_w])
    g = model.factor
    dte = np.array([1.0, g, -g, -1.0, 0.0]) @ back
    return a, np.concatenate([np.zeros(n), seen @ push]), np.concatenate([dte, np.zeros(n)])


def _relative(model: NonLinear) -> Array:
    """Relative displacements (n, COORDINATES) of the coordinates that move."""
    rows = np.eye(COORDINATES)
    if model.free:
        seen = [rows[0] - rows[3], rows[1], rows[2]]
        return np.array([*seen, rows[4] - rows[0]] if model.elastic_shaft else seen)
    return rows[[0, 1, 2, 4]] if model.elastic_shaft else rows[:3]
