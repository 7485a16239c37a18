"""The forces that a simulated rig lacks, by place: its records and the measured ones through the same equations.

The force residuals (`forces.residuals`) of the measured motion less those of the simulated one are what is missing from
each equation of motion of the simulated rig, whatever structure it has: a housing that both have cancels. As in
`forces.covariance` each equation errs on its own and the mesh in all of them, beyond floors that are parts of the force
in the mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.forces.covariance import expected_squares, floors, missing
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.residuals import Residuals, residuals
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.intake.signals import bands
from gearbench.rig import Case

Array = NDArray[np.float64]

ROUNDS = 40
# What sound rigs leave at most [nats a line], in the simulated rig and after the fit of the force residuals. From rigs
# without an effect: development family, housing with cross-coupling, the finite-element model; the latter limits are
# those of the calibration family over the lines of its records (benchmarks/diagnosis_log.md). At the drive 84 of
# 85 drawn sound rigs leave 0.7 of this at most.
OUTSTANDING: Mapping[str, float] = {
    "drive": 0.3, "driver-support": 1.2, "load": 1.2, "driven-support": 1.2, "mesh": 2.5,
}  # fmt: skip
SILENT: Mapping[str, float] = {
    "drive": 0.12, "driver-support": 0.35, "load": 2.8, "driven-support": 0.35, "mesh": 1.8,
}  # fmt: skip


@dataclass(frozen=True)
class Missing:
    """What is missing at each place, in the order of `PLACES`: `excess` (places,), the mean over lines of the logarithm
    of what is missing over the floor of a sound rig [nats]; `bands` [Hz] with `force` (bands, places) rms [N]; `silent`
    (places,) the same mean after the fit of the force residuals, which have a filter of their own in each equation but
    know no structure (infinite: not known); `factors` (places,): what sound rigs of this kind leave over that."""

    excess: Array
    bands: tuple[tuple[float, float], ...]
    force: Array
    silent: Array = field(default_factory=lambda: np.full(len(PLACES), np.inf))
    factors: Array = field(default_factory=lambda: np.ones(len(PLACES)))

    @property
    def over(self) -> Array:
        """How far each place (places,) stands out over what sound rigs leave there: only as far as both say so, the
        simulated rig, which has structure, and the force residuals, which have filters."""
        return np.minimum(self.excess / _of(OUTSTANDING), self.silent / _of(SILENT)) / self.factors

    @property
    def shares(self) -> Array:
        """Parts (places,) of all that is missing, by how far it stands out."""
        whole = float(self.excess.sum())
        return self.excess / whole if whole > 0.0 else np.zeros(len(PLACES))

    def in_band(self, band: tuple[float, float]) -> Array:
        """Rms (places,) [N] of the missing forces in the bands inside another one."""
        inside = [low >= band[0] - 1e-9 and high <= band[1] + 1e-9 for low, high in self.bands]
        return np.asarray(np.sqrt((self.force[inside] ** 2).sum(axis=0)))


def _of(limits: Mapping[str, float]) -> Array:
    return np.array([limits[place] for place in PLACES])


def nothing_missing() -> Missing:
    """Where nothing can be said of the forces."""
    return Missing(np.zeros(len(PLACES)), (), np.zeros((0, len(PLACES))))


def missing_forces(
    problem: Problem,
    nominal: Case,
    measurements: Sequence[Measurement],
    replayed: Callable[[Measurement], xr.Dataset],
) -> Missing:
    """The forces that the rig behind `replayed` lacks in these measurements, all of them among the problem's records.

    Raises what `replayed` raises, and DiagnosisError for a replay that is no record of this rig.
    """
    names = [condition.name for condition in problem.conditions]
    edges = bands(measurements[0])
    nats, lines = np.zeros(len(PLACES)), np.zeros(len(PLACES))
    energy = np.zeros((len(edges), len(PLACES)))
    for one in measurements:
        number = names.index(one.name)
        condition, blocks = problem.conditions[number], problem.blocks[number]
        nothing = problem.unknowns.departures(np.zeros(problem.unknowns.size), condition)
        real = residuals(problem.model, condition, nothing)
        own = prepare(measurement(replayed(one), one.name, nominal), problem.model, condition.band)
        made = residuals(problem.model, own, nothing)
        left = Residuals(real.left - made.left, real.mesh_factor, real.mesh_force, 0.0).at(blocks.used)
        factor, _ = missing(blocks, left, np.ones((len(blocks.with_mesh), len(blocks.count))), ROUNDS)
        nats[blocks.with_mesh] += (np.log(factor) * blocks.count).sum(axis=1)
        lines[blocks.with_mesh] += blocks.count.sum()
        use, floor = blocks.equations, floors(blocks, left)
        squares = expected_squares(left.left[use], left.mesh_factor[use], floor * factor[:, blocks.of_bin])
        more = np.where(factor[:, blocks.of_bin] > 1.0, squares, 0.0)
        frequency = condition.omega[blocks.used] / (2 * np.pi)
        for band, (low, high) in enumerate(edges):
            inside = (frequency > low) & (frequency <= high)
            energy[band, blocks.with_mesh] += 2 * more[:, inside].sum(axis=1)
    return Missing(nats / np.maximum(lines, 1.0), edges, np.sqrt(energy / len(measurements)))
