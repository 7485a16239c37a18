"""A rig made ready for the linear lumped model, and its steps from block to block."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, gcd, log
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.plan.settling import Keep
from gearbench.bench.plan.substeps import runge_kutta_substeps
from gearbench.bench.protocol import Channels, Drive
from gearbench.bench.record.attributes import bodies_of
from gearbench.bench.record.channels import dte_of
from gearbench.geometry import Pair, pair
from gearbench.lumped import Lumped, lumped_model
from gearbench.lumped.linear.model import STATES
from gearbench.lumped.linear.runge_kutta import Tables, integrate, tabulate
from gearbench.lumped.stiffness.potential_energy import outside_foundation_fit
from gearbench.rig import Case

Array = NDArray[np.float64]

GROWTH = 1e-6  # from one mesh period to the next, that rounding may make


@dataclass(frozen=True)
class LinearRig:
    """Model and mesh tables for `substeps` steps a sample; states are those of the integrator, (6,), outputs
    (samples, 4): x, y1, y2 [m] and mesh force [N].

    The rig repeats itself with every block, so the record is the mean of all blocks: a hundred realisations of four
    periods stay within a gigabyte.
    """

    model: Lumped
    tables: Tables
    substeps: int
    meshing: Pair
    mean_torque: float
    inertias: tuple[float, float]
    free: bool  # the driven gear's speed is not imposed
    samples_per_period: int
    warnings: tuple[str, ...]
    slowest: float  # rate [1/s] at which free vibrations die out at the mesh frequency

    keep: ClassVar[Keep] = "mean"
    piece: ClassVar[int] = 0
    absolute: ClassVar[bool] = False
    decay: ClassVar[float | None] = None

    @property
    def force_per_torque(self) -> float:
        """Generalised force per driver torque [1/m]."""
        return 1.0 / self.meshing.driver.base_radius

    @property
    def settings(self) -> dict[str, Any]:
        return {"model": "lumped", "substeps": self.substeps}

    @property
    def attributes(self) -> dict[str, Any]:
        return {}

    def drive(self, torque: Torque) -> Drive:
        fine = torque.sample(2 * self.substeps * torque.samples_of(self.samples_per_period))
        return Drive(fine[:: 2 * self.substeps].copy(), self.force_per_torque * fine)

    def start(self, sample: int) -> Array:
        """At mesh phase 0, where every block begins."""
        return self.model.equilibrium(self.force_per_torque * self.mean_torque)

    def advance(self, drive: Drive, state: Array, samples: int) -> tuple[Array, Array]:
        """One block from its start: both tables repeat with it, so every block begins at their first entry."""
        return integrate(self.tables, drive.fine, state, samples=samples, substeps=self.substeps)

    def dte(self, outputs: Array) -> Array:
        return dte_of(outputs[:, 0], outputs[:, 1], outputs[:, 2], self.model.support_factor)

    def channels(self, outputs: Array, torque: Array) -> Channels:
        x, y1, y2, mesh_force = outputs.T
        r1, r2 = self.meshing.driver.base_radius, self.meshing.driven.base_radius
        mass = self.model.mesh_mass
        # Angle per x: 1/r1 and 0 if the driven gear turns steadily, else shared as the inertias are.
        share1 = mass * r1 / self.inertias[0]
        share2 = mass * r2 / self.inertias[1] if self.free else 0.0
        return Channels(
            torque_driven=torque * (r2 / r1) if self.free else mesh_force * r2,
            angle_driver=share1 * x,
            angle_driven=-share2 * x,
            y_driver=y1,
            y_driven=y2,
            dte=self.dte(outputs),
            force=torque * self.force_per_torque,
        )

    def apart(self, outputs: Array) -> None:
        """A heavily loaded mesh: the model has no backlash."""

    def strayed(self, outputs: Array) -> None:
        """Springs know no flanks to leave."""

    def divided(self, outputs: Array) -> None:
        """All steps are alike."""


def tables_for(model: Lumped, plan: Schedule, substeps: int) -> Tables:
    """Mesh tables of the shortest run that holds whole numbers of steps and of mesh periods."""
    steps = substeps * plan.block_samples
    common = gcd(steps, plan.mesh_cycles)
    step = 1.0 / (plan.sampling_rate * substeps)
    return tabulate(model, cycles=plan.mesh_cycles // common, steps=steps // common, step=step)


def slowest_decay(model: Lumped, mesh_period: float, step: float) -> float:
    """Slowest rate [1/s] at which free vibrations die out, the mesh held or turning with that period [s], in steps of
    `step` [s] or less. Raises BenchError where they grow: nothing in a linear model limits them."""
    steps = ceil(mesh_period / step)
    cycle = tabulate(model, cycles=1, steps=steps, step=mesh_period / steps)
    cycle = replace(cycle, mesh=cycle.mesh._replace(force=np.zeros(2 * steps)))
    ends = [integrate(cycle, np.zeros(2), state, samples=1, substeps=steps)[0] for state in np.eye(STATES)]
    # Floquet's multipliers: by how much vibrations grow in a mesh period.
    factor = float(np.abs(np.linalg.eigvals(np.array(ends).T)).max())
    if factor > 1.0 + GROWTH:
        raise BenchError(
            f"no steady state: at {1 / mesh_period:g} Hz mesh frequency (experiment.mesh_frequency_hz or"
            f" speed_driver_rpm) the varying mesh stiffness makes vibrations grow {factor:.4g} times from one mesh"
            " period to the next, and this linear model never parts the teeth, which would end that: change the speed,"
            ' raise rig.damping.mesh_ratio, or set simulation.mesh_stiffness = "finite-element"'
        )
    return min(model.slowest_decay(), -log(max(factor, np.finfo(float).tiny)) / mesh_period)


def prepare(case: Case, plan: Schedule) -> LinearRig:
    """Model, step and tables of an experiment. Raises LumpedError, GeometryError or BenchError."""
    rig, meshing = case.rig, pair(case.rig)
    model = lumped_model(rig, meshing, case.simulation)
    substeps = runge_kutta_substeps(model.fastest_rate(), case.experiment, case.simulation, plan)
    one, two = bodies_of(rig, meshing)
    tabled = case.simulation.mesh_stiffness == "potential-energy"
    return LinearRig(
        model=model,
        tables=tables_for(model, plan, substeps),
        substeps=substeps,
        meshing=meshing,
        mean_torque=case.experiment.torque_mean,
        inertias=(one.inertia, two.inertia),
        free=rig.load.boundary == "torque",
        samples_per_period=plan.samples_per_period,
        slowest=slowest_decay(model, plan.mesh_period, 1.0 / (plan.sampling_rate * substeps)),
        warnings=tuple(outside_foundation_fit(rig, meshing)) if tabled else (),
    )
