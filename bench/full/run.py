"""A rig made ready for the unreduced finite-element model, and its steps in time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.course import begun_with, check_course, drive_of, torque_of
from gearbench.bench.elastic.rig import ElasticRig, choose_substeps, elastic_rig, machine_for, slowest_decay
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.rotation import Rotation
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.plan.settling import Keep
from gearbench.bench.protocol import Channels, Drive, Note
from gearbench.bench.record.channels import PAIRS, dte_of, force_of, support_factor, turned_by
from gearbench.fem.full.gear import FullGear, make_gear
from gearbench.fem.full.machine import Machine, make_machine
from gearbench.fem.full.record import CHANNELS, advance, columns
from gearbench.fem.full.start import initial_state
from gearbench.fem.full.transient import Integrator, make_integrator
from gearbench.fem.full.transient import State as Step
from gearbench.fem.motion.machine import STEADY
from gearbench.fem.motion.scheme import make_scheme
from gearbench.rig import Case, Rig, Simulation

Array = NDArray[np.float64]


class State(NamedTuple):
    """The integrator's state at a sample of the record, and the outputs (CHANNELS,) there, which it hands out at the
    end of a step; unknown (zeros) where a simulation begins."""

    sample: int
    step: Step
    here: Array


@dataclass(frozen=True)
class Full:
    """Equations of motion of a rig under one time scheme, shared by all realisations. Every block is recorded."""

    elastic: ElasticRig
    integrator: Integrator
    substeps: int
    mean_torque: float
    sampling_rate: float
    samples_per_period: int
    teeth: bool = False  # whether a record holds tooth forces
    decay: float | None = None  # where the speed changes: no periods could be compared
    slowest: float | None = None  # rate [1/s] at which free vibrations die out, of the reduced model

    keep: ClassVar[Keep] = "every"
    piece: ClassVar[int] = 8
    absolute: ClassVar[bool] = True
    warnings: ClassVar[tuple[str, ...]] = ()

    @property
    def settings(self) -> dict[str, Any]:
        one, two = self.integrator.machine.gears
        return {
            "model": "full",
            "substeps": self.substeps,
            "contact": "penalty" if self.integrator.machine.surfaces else "law",
            "unknowns_driver": one.free,
            "unknowns_driven": two.free,
        }

    @property
    def attributes(self) -> dict[str, Any]:
        return {}

    def drive(self, torque: Torque) -> Drive:
        return drive_of(torque, self.samples_per_period, self.substeps)

    def start(self, sample: int) -> State:
        step = initial_state(self.integrator.machine, self.mean_torque, sample / self.sampling_rate)
        return State(sample, step, np.zeros(CHANNELS))

    def advance(self, drive: Drive, state: State, samples: int) -> tuple[State, Array]:
        first, steps = state.sample * self.substeps, samples * self.substeps
        torque = torque_of(drive, first, steps)
        run = advance(self.integrator, state.step, torque, self.substeps)
        lost = f"the full model found no contact forces at t = {run.state.t:.6g} s" if run.lost else ""
        check_course(run.state.t, lost, run.samples)
        return State(state.sample + samples, run.state, run.samples[-1]), begun_with(state.here, run.samples)

    def dte(self, outputs: Array) -> Array:
        out = columns(outputs)
        turned = turned_by(self.elastic.pair, out.angle_driver, out.angle_driven)
        return dte_of(turned, out.y_driver, out.y_driven, support_factor(self.elastic.rig, self.elastic.pair))

    def channels(self, outputs: Array, torque: Array) -> Channels:
        dte, out = self.dte(outputs), columns(outputs)
        return Channels(
            torque_driven=out.torque_driven,
            angle_driver=out.angle_driver,
            angle_driven=out.angle_driven,
            y_driver=out.y_driver,
            y_driven=out.y_driven,
            dte=dte,
            force=force_of(torque, self.elastic.pair),
            tooth_force={name: getattr(out, name) for name in (*PAIRS, "back")} if self.teeth else None,
        )

    def apart(self, outputs: Array) -> NDArray[np.bool_]:
        return np.asarray(columns(outputs).loaded == 0)

    def strayed(self, outputs: Array) -> NDArray[np.bool_]:
        return np.asarray(columns(outputs).strayed > 0)

    def divided(self, outputs: Array) -> None:
        """All steps are alike."""


def full_gears(rig: Rig, simulation: Simulation, note: Note) -> tuple[FullGear, FullGear]:
    """Both gears meshed, assembled and factorised. Raises GeometryError."""
    note("assembling the driver")
    driver = make_gear(rig.driver, rig.material, simulation.element_size)
    if rig.driven == rig.driver:
        return driver, driver
    note("assembling the driven gear")
    return driver, make_gear(rig.driven, rig.material, simulation.element_size)


def full_machine(
    elastic: ElasticRig,
    gears: tuple[FullGear, FullGear],
    mesh_frequency: float,
    surfaces: bool = False,
    rotation: Rotation | None = None,
) -> Machine:
    """Equations of motion at a mesh frequency [Hz]; surfaces: whether the meshes' own surfaces touch; `rotation`: where
    the speed changes."""
    e, course = elastic, STEADY
    if rotation is not None:
        course = course._replace(time=rotation.time, speed=rotation.speed, angle=rotation.angle)
    return make_machine(e.rig, e.pair, e.law, gears, e.bodies, mesh_frequency, surfaces, course)


def prepare(case: Case, plan: Schedule, note: Note) -> Full:
    """Contact tabulated, gears assembled, step chosen, effective matrices factorised. Raises GeometryError,
    ContactError or BenchError."""
    elastic = elastic_rig(case.rig, case.simulation, note)
    small, decay = machine_for(elastic, plan.mesh_frequency), None
    substeps = choose_substeps(small, case, plan)
    if plan.rotation is not None:
        highest = plan.sampling_rate / 4
        decay = min(slowest_decay(small, case.experiment.torque_mean, phase, highest) for phase in (0.0, 0.5))
    slowest = min(slowest_decay(small, case.experiment.torque_mean, phase, inf) for phase in (0.0, 0.5))
    gears = full_gears(case.rig, case.simulation, note)
    machine = full_machine(
        elastic, gears, plan.mesh_frequency, case.simulation.contact == "penalty", plan.rotation
    )
    note("factorising the effective matrices")
    scheme = make_scheme(1.0 / (plan.sampling_rate * substeps), case.simulation.spectral_radius)
    return Full(
        elastic=elastic,
        integrator=make_integrator(machine, scheme),
        substeps=substeps,
        mean_torque=case.experiment.torque_mean,
        sampling_rate=plan.sampling_rate,
        samples_per_period=plan.samples_per_period,
        teeth=case.simulation.outputs == "teeth",
        decay=decay,
        slowest=slowest,
    )
