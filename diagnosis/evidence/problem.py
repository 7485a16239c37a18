"""From measurements and a nominal case to the problem that all hypotheses share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.library import all_unknowns
from gearbench.diagnosis.forces.condition import Condition, prepare
from gearbench.diagnosis.forces.covariance import EXCITED, Blocks, cut
from gearbench.diagnosis.forces.equations import MESH, PLACES
from gearbench.diagnosis.forces.mesh import corrected, mesh
from gearbench.diagnosis.forces.nominal import NominalModel, model_for
from gearbench.diagnosis.forces.residuals import assemble, carried_force
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.rig import Case

Array = NDArray[np.float64]

# Errors that a sound rig's equations and mesh have because the model is simpler than the rig, as parts of the mesh
# force.
EQUATION_FLOOR = 0.03
MESH_FLOOR = 0.08
# Part of the time beyond which flanks count as separating.
SEPARATED = 0.03
OFF_COMB = 1.02  # how far beyond the highest excited line bins are used


@dataclass(frozen=True)
class Problem:
    """Everything that the hypotheses have in common."""

    model: NominalModel
    conditions: tuple[Condition, ...]
    unknowns: Unknowns
    blocks: tuple[Blocks, ...]


def problem_of(measurements: Sequence[Measurement], nominal: Case) -> Problem:
    """The problem that the measurements pose to the nominal case."""
    model = model_for(nominal, measurements)
    band = max(excited_band(measured) for measured in measurements)
    conditions = tuple(prepare(measured, model, band) for measured in measurements)
    unknowns = all_unknowns(model, conditions)
    blocks = []
    for condition in conditions:
        level, separates = _levels(model, condition, unknowns)
        relative = np.full((len(PLACES), condition.bins), EQUATION_FLOOR)
        relative[MESH] = MESH_FLOOR
        blocks.append(cut(model, condition, level, relative, separates))
    return Problem(model, conditions, unknowns, tuple(blocks))


def excited_band(measured: Measurement) -> float:
    """Highest frequency [Hz] that is worth a look: just beyond the highest excited line, or a third of the sampling
    rate for constant torque."""
    torque = measured.mean("torque_driver")
    lines = np.abs(np.fft.rfft(torque - torque.mean()))
    spacing = measured.sampling_rate / torque.size
    noise = measured.noise.get("torque_driver", 0.0) * np.sqrt(torque.size)
    loud = np.flatnonzero(lines > max(EXCITED * lines.max(), 6 * noise))
    if not loud.size:
        return measured.sampling_rate / 3
    return float(min(OFF_COMB * loud[-1] * spacing, measured.sampling_rate / 2.2))


def _levels(model: NominalModel, condition: Condition, unknowns: Unknowns) -> tuple[Array, bool]:
    """The mesh force (equations + 1, K) [N] as each equation and the nominal mesh law have it, and whether flanks
    separate."""
    nothing = unknowns.departures(np.zeros(unknowns.size), condition)
    spectra = corrected(condition, nothing)
    state = mesh(model, condition, nothing, spectra)
    residuals = assemble(model, condition, nothing, spectra, state)
    forces = carried_force(model, condition, nothing, state.force)
    each = residuals.left + residuals.mesh_factor * forces
    lost = bool((~state.touching).mean() > SEPARATED)
    return np.vstack([np.abs(each), np.abs(residuals.mesh_force)[None]]), lost
