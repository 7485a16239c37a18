"""From measurements and a nominal case to the problem that all hypotheses share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.fit import Problem
from gearbench.diagnosis.forces.condition import Condition, prepare
from gearbench.diagnosis.forces.covariance import EXCITED, cut
from gearbench.diagnosis.forces.nominal import Machine, machine
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.residuals import assemble, carried, corrected, mesh
from gearbench.diagnosis.forces.unknowns import ROWS, unknowns
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.replay.replays import table_load
from gearbench.rig import Case

Array = NDArray[np.float64]

# Errors that a sound rig's rows and mesh have because the model is simpler than the rig, as parts of the mesh force.
ROW_FLOOR = 0.03
MESH_FLOOR = 0.08
# Part of the time beyond which flanks count as separating.
SEPARATED = 0.03
OFF_COMB = 1.02  # how far beyond the highest excited line bins are used


def problem_of(measurements: Sequence[Measurement], nominal: Case) -> Problem:
    """The problem that the measurements pose to the nominal case."""
    mean = float(np.mean([measured.mean("torque_driver").mean() for measured in measurements]))
    made = machine(nominal, table_load(measurements), mean)
    band = max(excited_band(measured) for measured in measurements)
    conditions = tuple(prepare(measured, made, band) for measured in measurements)
    where = unknowns(made, conditions)
    blocks = []
    for condition in conditions:
        level, separates = _levels(made, condition, where)
        relative = np.full((len(ROWS) + 1, condition.bins), ROW_FLOOR)
        relative[-1] = MESH_FLOOR
        blocks.append(cut(made, condition, level, relative, separates))
    return Problem(made, conditions, where, tuple(blocks))


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


def _levels(made: Machine, condition: Condition, where: Layout) -> tuple[Array, bool]:
    """The mesh force (rows + 1, K) [N] as each row and the nominal mesh law have it, and whether flanks separate."""
    nothing = np.zeros(where.size)
    spectra = corrected(condition, where, nothing)
    state = mesh(made, condition, where, nothing, spectra)
    found = assemble(made, condition, where, nothing, spectra, state)
    forces = carried(made, condition, where, nothing, state.force)
    rows = found.left + found.share * forces[[0, 1, 2, 1]]
    return np.vstack([np.abs(rows), np.abs(found.force)[None]]), bool((~state.touching).mean() > SEPARATED)
