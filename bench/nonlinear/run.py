"""A rig made ready for the non-linear lumped model, and its steps through tables of what varies with rotation.

Channels are what sensors on the rig would show: torque_driver is the commanded torque, without ripple. All excitation
periods are recorded, since their noise differs. What the model leaves out is listed in `NonLinear.limits`
and in the record's attribute `limits`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.nonlinear.followed import Followed
from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.nonlinear.together import under_excitation, under_ripple
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.rotation import Rotation
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.plan.settling import Keep
from gearbench.bench.plan.substeps import runge_kutta_substeps
from gearbench.bench.protocol import Channels, Drive
from gearbench.bench.record.attributes import turning_inertias
from gearbench.bench.record.channels import Displacements, displacements, dte_of, generalised_force, turned_by
from gearbench.bench.record.sensors import repeated
from gearbench.bench.refusals.effects import refuse_unknown
from gearbench.geometry import Pair, pair
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.model import NonLinear, nonlinear_model
from gearbench.lumped.nonlinear.step import Outputs, columns, integrate
from gearbench.lumped.nonlinear.tables import Motion, Table, Varied, instants, tables
from gearbench.lumped.stiffness.potential_energy import outside_foundation_fit
from gearbench.rig import Case, Experiment

Array = NDArray[np.float64]

MOST_ENTRIES = 2**20  # half steps tabulated at once
HEADROOM = 2.0  # largest tabulated over largest applied load: resonances load the flanks more than the torque does


class State(NamedTuple):
    """The integrator's state (2 size,) at a sample of the record."""

    sample: int
    values: Array
    begins: bool = False  # at rest, whatever the excitation


@dataclass(frozen=True)
class Setup:
    """What all realisations share. The rig repeats after `block_samples` samples; `table` covers them from sample
    0 at `first_phase` [cycles], unless they are too many to keep."""

    model: NonLinear
    meshing: Pair
    substeps: int
    mean_torque: float
    sampling_rate: float
    samples_per_period: int
    cycles_per_sample: float
    block_samples: int
    warnings: tuple[str, ...]
    table: Table | None = None
    first_phase: float = 0.0
    twisted_on: float = 0.0  # cycles by which the driven gear stands beyond the nominal rotation at rest
    record_samples: int = 1  # over which the mesh stiffness drifts
    rotation: Rotation | Followed | None = None  # where the speed changes
    guide: Followed | None = None  # motion that the driver is nudged towards

    keep: ClassVar[Keep] = "one"
    absolute: ClassVar[bool] = False

    @property
    def piece(self) -> int:
        """Samples that are tabulated at once; 0 where one table serves all."""
        return 0 if self.table is not None else max(MOST_ENTRIES // (2 * self.substeps), 1)

    @property
    def step(self) -> float:
        """Integration step [s]."""
        return 1.0 / (self.sampling_rate * self.substeps)

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz], before the record where the speed changes."""
        return self.cycles_per_sample * self.sampling_rate

    @property
    def mean_force(self) -> float:
        """Generalised force [N] of the mean torque."""
        return self.mean_torque / self.meshing.driver.base_radius

    @property
    def decay(self) -> float:
        return self.model.slowest_decay(self.mean_force)

    @property
    def slowest(self) -> float:
        """That rate."""
        return self.decay

    @property
    def settling(self) -> float:
        """That rate as a sweep asks for it."""
        return self.decay

    @property
    def settings(self) -> dict[str, Any]:
        return {"model": "lumped", "mesh": "non-linear", "substeps": self.substeps}

    @property
    def attributes(self) -> dict[str, Any]:
        about = {"mesh": "non-linear", "limits": "\n".join(self.model.limits)}
        one, two = turning_inertias(self.model.rig, self.meshing)
        return {**about, "inertia_driver": one, "inertia_driven": two}

    def phase_at(self, sample: int) -> float:
        """Mesh phase [cycles] of a sample."""
        return float(self.phases(sample, 1)[0])

    def table_for(self, start: int, samples: int) -> Table:
        """Table of `samples` samples from sample `start`."""
        entries = 2 * self.substeps * samples
        table = tables(
            self.model,
            Motion(
                cycles=samples * self.cycles_per_sample,
                entries=entries,
                step=self.step,
                first_phase=self.phase_at(start),
                varied=self._varied(start, entries),
            ),
        )
        table = table._replace(led=self.led(start, entries + 1))
        drift = self.model.rig.mesh.stiffness_drift
        if not drift:
            return table
        passed = (start + np.arange(entries + 1) / (2 * self.substeps)) / max(self.record_samples - 1, 1)
        return table._replace(gain=table.gain * (1.0 + drift * np.clip(passed, 0.0, 1.0)))

    def led(self, start: int, entries: int) -> Array:
        """Velocity (entries,) [m/s] that the driver is nudged towards at half steps from sample `start` on; empty where
        it is not."""
        if self.guide is None:
            return np.empty(0)
        time = start / self.sampling_rate + np.arange(float(entries)) * (self.step / 2)
        return self.model.law.base_pitch * self.guide.velocity(time)

    def phases(self, start: int, entries: int) -> Array:
        """Mesh phase (entries,) [cycles] at half steps from sample `start` on."""
        if self.rotation is None:
            turned = np.arange(entries) * (self.cycles_per_sample / (2 * self.substeps))
            return np.asarray(self.first_phase + self.twisted_on + start * self.cycles_per_sample + turned)
        time = start / self.sampling_rate + np.arange(float(entries)) * (self.step / 2)
        return self.rotation.cycles(np.asarray(time, dtype=np.float64)) + self.twisted_on

    def departures(self, samples: int) -> Array:
        """How far (samples,) [cycles] the rotation of a record that is followed departs from a steady one, from sample
        0 on; nothing for another."""
        turning = self.rotation
        return repeated(turning.departures, samples) if isinstance(turning, Followed) else np.zeros(samples)

    def _varied(self, start: int, entries: int) -> Varied | None:
        """The rotation from sample `start` on, where its speed changes."""
        turning = self.rotation
        if turning is None:
            return None
        time = start / self.sampling_rate + np.arange(-1.0, entries + 2) * (self.step / 2)
        along = self.meshing.driver.base_radius * turning.acceleration(time[1:-1])
        cycles, pace = turning.cycles(time) + self.twisted_on, turning.frequency(time[1:-1]) / self.mesh_frequency
        return Varied(cycles, pace, along)

    def drive(self, torque: Torque) -> Drive:
        period = torque.samples_of(self.samples_per_period)
        fine = torque.sample(2 * self.substeps * period)
        return Drive(torque.sample(period), fine / self.meshing.driver.base_radius)

    def start(self, sample: int) -> State:
        return self.at_rest(self.mean_force, sample)

    def resume(self, state: State) -> State:
        """A state of another speed at a whole repetition of the mesh, as the start of this one."""
        return State(0, state.values)

    def mesh_force(self, outputs: Array) -> Array:
        """Force of the mesh (samples,) [N]."""
        return columns(outputs).mesh_force

    def advance(
        self, drive: Drive, state: State, samples: int, load_forces: Array | None = None
    ) -> tuple[State, Array]:
        """As the protocol's; `load_forces` (steps,) takes the force at the load's base circle [N] at every step."""
        start, values = state.sample, state.values
        stop = start + samples
        if state.begins and self.model.rig.load.boundary == "inertia":
            entry = 2 * self.substeps * start
            values = values + under_excitation(self.model, drive.fine, self.step / 2, entry % drive.fine.size)
        # Whole repetitions are counted from 0 again, so that they all read the same table.
        after = stop if stop < 0 else stop % self.block_samples
        if self.table is not None and start == 0 and samples == self.block_samples:
            values, outputs = self._integrate(self.table, drive.fine, values, 0, load_forces)
            return State(after, values), outputs
        if self.table is not None and -self.block_samples <= start < 0 and stop == 0:
            # What comes before sample 0 is the end of the repetition before.
            table = self.table.part(2 * self.substeps * start - 1)
            values, outputs = self._integrate(table, drive.fine, values, 2 * self.substeps * start % drive.fine.size)
            return State(after, values), outputs
        parts = []
        most = max(MOST_ENTRIES // (2 * self.substeps), 1)
        for at in range(start, stop, most):
            table, first = self.table_for(at, min(most, stop - at)), 2 * self.substeps * at % drive.fine.size
            steps = slice((at - start) * self.substeps, (at - start + most) * self.substeps)
            part = None if load_forces is None else load_forces[steps]
            values, out = self._integrate(table, drive.fine, values, first, part)
            parts.append(out)
        return State(after, values), np.concatenate(parts)

    def _integrate(
        self, table: Table, force: Array, state: Array, first_entry: int, load_forces: Array | None = None
    ) -> tuple[Array, Array]:
        return integrate(
            self.model,
            table,
            force,
            state,
            step=self.step,
            substeps=self.substeps,
            mesh_frequency=self.mesh_frequency,
            first_entry=first_entry,
            load_forces=load_forces,
        )

    def dte(self, outputs: Array) -> Array:
        out = columns(outputs)
        return self._dte(out.u1 - out.u2, out)

    def _dte(self, turned: Array, out: Outputs) -> Array:
        across = (out.x1, out.x2, self.model.slide) if self.model.rig.support.move_across else ()
        return dte_of(turned, out.y1, out.y2, self.model.factor, *across)

    def channels(self, outputs: Array, torque: Array) -> Channels:
        out = columns(outputs)
        r1, r2 = self.model.base_radii
        one, two = out.u1 / r1, out.u2 / r2
        across, held = self.model.rig.support.move_across, self.model.rig.drive.boundary == "speed"
        seen = displacements(
            self.model.rig, Displacements(out.y1, out.y2, out.x1, out.x2), out.housing, out.rocking
        )
        shown = out._replace(y1=seen.y_driver, y2=seen.y_driven, x1=seen.x_driver, x2=seen.x_driven)
        load, applied = out.load_force * r2, out.drive_force * r1 if held else torque
        return Channels(
            torque_driven=load,
            angle_driver=one,
            angle_driven=two,
            y_driver=shown.y1,
            y_driven=shown.y2,
            dte=self._dte(turned_by(self.meshing, one, two), shown),
            force=generalised_force(self.model.rig, self.meshing, applied, load),
            x_driver=shown.x1 if across else None,
            x_driven=shown.x2 if across else None,
            torque_driver=applied if held else None,
        )

    def apart(self, outputs: Array) -> NDArray[np.bool_]:
        return np.asarray(columns(outputs).mesh_force == 0)

    def unloaded(self, outputs: Array) -> NDArray[np.bool_]:
        """Samples at which the working flanks carry nothing: they are apart, or the back flanks touch."""
        return np.asarray(columns(outputs).mesh_force <= 0)

    def strayed(self, outputs: Array) -> None:
        """Springs know no flanks to leave."""

    def divided(self, outputs: Array) -> None:
        """All steps are alike."""

    def at_rest(self, mean_force: float, sample: int) -> State:
        """Static equilibrium under the mean force [N] at a sample."""
        table = self.table_for(sample, 1)
        phase = self.phase_at(sample)
        state = self.model.equilibrium(mean_force, instants(self.model, table, 1))
        return State(sample, state + under_ripple(self.model, self.mesh_frequency, phase), begins=True)


def largest_load(experiment: Experiment) -> float:
    """Driver torque [N m] up to which the mesh law of an experiment is tabulated."""
    wanted = experiment.multisine
    peak = 0.0
    if wanted is not None:
        peak = wanted.amplitude if wanted.amplitude is not None else (wanted.rms or 0.0) * wanted.crest
    return HEADROOM * (experiment.torque_mean + peak)


def make_setup(
    case: Case, plan: Schedule, law: MeshLaw | None = None, first_phase: float = 0.0, followed: Followed | None = None,
    nominal: bool = True, guide: Followed | None = None, nudge: float = 0.0, coarser: float = 1.0,
) -> Setup:  # fmt: skip
    """Model, step and tables of an experiment that begins at `first_phase` [cycles] of the `nominal` rotation, else of
    the driven gear's own, with the mesh law given or solved, and the rotation of a record in place of a constant
    speed's; steps may be `coarser` by that factor.

    Raises LumpedError, BenchError, GeometryError or ContactError.
    """
    rig, experiment, simulation, meshing = case.rig, case.experiment, case.simulation, pair(case.rig)
    refuse_unknown(rig)
    law = law or mesh_law(rig, simulation, largest_load(experiment))
    model = replace(nonlinear_model(rig, meshing, law), nudge=nudge)
    force = experiment.torque_mean / meshing.driver.base_radius
    fastest = model.fastest_rate(force, np.pi * plan.sampling_rate, coarser)
    tabled = simulation.mesh_stiffness == "potential-energy"
    setup = Setup(
        model=model,
        meshing=meshing,
        substeps=runge_kutta_substeps(fastest, experiment, simulation, plan, coarser),
        mean_torque=experiment.torque_mean,
        sampling_rate=plan.sampling_rate,
        samples_per_period=plan.samples_per_period,
        cycles_per_sample=plan.cycles_per_sample,
        block_samples=(plan.periods if plan.drifts or plan.rotation else plan.repeat_periods) * plan.samples_per_period,
        warnings=tuple(outside_foundation_fit(rig, meshing)) if tabled else (),
        first_phase=first_phase,
        twisted_on=model.twisted_on(force) if nominal else 0.0,
        record_samples=plan.record_samples,
        rotation=plan.rotation or followed,
        guide=guide,
    )
    if not plan.repeats or 2 * setup.substeps * setup.block_samples > MOST_ENTRIES:
        return setup
    return replace(setup, table=setup.table_for(0, setup.block_samples))
