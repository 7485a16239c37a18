"""A rig made ready for the reduced finite-element model, and its steps in time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.course import begun_with, check_course, drive_of, torque_of
from gearbench.bench.elastic.rest import check_rest
from gearbench.bench.elastic.rig import ElasticRig, choose_substeps, elastic_rig, machine_for, slowest_decay
from gearbench.bench.elastic.together import under_excitation, under_ripple
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.plan.settling import Keep
from gearbench.bench.protocol import Channels, Drive, Note
from gearbench.bench.record.attributes import turning_inertias
from gearbench.bench.record.channels import (
    PAIRS,
    Displacements,
    across_factor,
    displacements,
    dte_of,
    generalised_force,
    support_factor,
    turned_by,
)
from gearbench.fem.contact.static import ContactError
from gearbench.fem.motion.machine import Machine
from gearbench.fem.motion.scheme import Scheme, make_scheme
from gearbench.fem.motion.start import State as Step
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.transient import CHANNELS, PARTS, Samples, advance, columns
from gearbench.rig import Case

Array = NDArray[np.float64]


LIMITS = (
    "forces of unbalance, also of eccentric gears, are left out",
    "friction acts on the hubs: the flanks' displacement along their tangent is not followed",
    "a varying factor on the mesh force neither gives nor takes work through the rotation",
    "Coriolis and centrifugal forces of the elastic displacement relative to the hubs are left out",
)

HALVINGS = 6  # of the mean torque, to find a rest to begin from


class State(NamedTuple):
    """The integrator's state at a sample of the record, and the outputs (CHANNELS,) there, which it hands out at the
    end of a step; unknown (zeros) where a simulation begins."""

    sample: int
    step: Step
    here: Array
    begins: bool = False  # at rest, whatever the excitation


@dataclass(frozen=True)
class Elastic:
    """Equations of motion and time step of a rig, shared by all realisations. Every block is recorded."""

    elastic: ElasticRig
    machine: Machine
    scheme: Scheme
    substeps: int
    mean_torque: float
    sampling_rate: float
    samples_per_period: int
    teeth: bool = False  # whether a record holds tooth forces
    changes: bool = False  # whether the speed changes

    keep: ClassVar[Keep] = "every"
    piece: ClassVar[int] = 512
    absolute: ClassVar[bool] = True
    warnings: ClassVar[tuple[str, ...]] = ()

    @property
    def decay(self) -> float | None:
        # A record whose speed changes has no periods that could be compared.
        return self.settling if self.changes else None

    @property
    def slowest(self) -> float:
        """Slowest rate [1/s] at which free vibrations die out, about rest, whether samples show them or not."""
        return min(slowest_decay(self.machine, self.mean_torque, phase, inf) for phase in (0.0, 0.5))

    @property
    def settings(self) -> dict[str, Any]:
        one, two = self.elastic.gears
        return {
            "model": "reduced",
            "substeps": self.substeps,
            "modes_driver": len(one.omega),
            "modes_driven": len(two.omega),
            "unknowns_driver": one.unknowns,
            "unknowns_driven": two.unknowns,
        }

    @property
    def attributes(self) -> dict[str, Any]:
        one, two = turning_inertias(self.elastic.rig, self.elastic.pair)
        return {"limits": "\n".join(LIMITS), "inertia_driver": one, "inertia_driven": two}

    def drive(self, torque: Torque) -> Drive:
        return drive_of(torque, self.samples_per_period, self.substeps)

    def start(self, sample: int) -> State:
        step = rest_of(self.machine, self.mean_torque, sample / self.sampling_rate)
        return State(sample, under_ripple(self.machine, step), np.zeros(CHANNELS), begins=True)

    def resume(self, state: State) -> State:
        """A state of another speed at a whole mesh period, as the start of this one: the rotation stays, and with it
        which teeth meet and where their gears' modes stand."""
        return state._replace(step=state.step._replace(t=state.sample / self.sampling_rate))

    @property
    def settling(self) -> float:
        """Slowest rate [1/s] at which free vibrations that samples show die out, about rest."""
        highest = self.sampling_rate / 4
        return min(slowest_decay(self.machine, self.mean_torque, phase, highest) for phase in (0.0, 0.5))

    def mesh_force(self, outputs: Array) -> Array:
        """Force of the mesh (samples,) [N]: of working flanks less that of back flanks."""
        out = columns(outputs)
        return np.asarray(out.leaving + out.middle + out.entering - out.back)

    def advance(self, drive: Drive, state: State, samples: int) -> tuple[State, Array]:
        first, steps = state.sample * self.substeps, samples * self.substeps
        torque = torque_of(drive, first, steps)
        begin = state.step
        if state.begins:
            begin = under_excitation(self.machine, begin, drive.fine, self.scheme.step, first)
        step, outputs, run = advance(self.machine, self.scheme, begin, torque, self.substeps)
        lost = ""
        if run.failed >= 0:
            lost = (
                f"contact was not found at t = {step.t:.6g} s, in steps of {self.scheme.step / PARTS:.2g} s either:"
                " the motion diverges, or forces are far beyond what the flanks can carry"
            )
        check_course(step.t, lost, outputs)
        return State(state.sample + samples, step, outputs[-1]), begun_with(state.here, outputs)

    def dte(self, outputs: Array) -> Array:
        return self._dte(columns(outputs))

    def _dte(self, out: Samples) -> Array:
        turned = turned_by(self.elastic.pair, out.angle_driver, out.angle_driven)
        rig, meshing = self.elastic.rig, self.elastic.pair
        across = (out.x_driver, out.x_driven, across_factor(rig, meshing)) if rig.support.move_across else ()
        return dte_of(turned, out.y_driver, out.y_driven, support_factor(rig, meshing), *across)

    def channels(self, outputs: Array, torque: Array) -> Channels:
        out, rig = columns(outputs), self.elastic.rig
        across, held = rig.support.move_across, rig.drive.boundary == "speed"
        applied = out.torque_driver if held else torque
        centres = Displacements(out.y_driver, out.y_driven, out.x_driver, out.x_driven)
        shown = out._replace(**displacements(rig, centres, out.housing, out.rocking)._asdict())
        return Channels(
            torque_driven=out.torque_driven,
            angle_driver=out.angle_driver,
            angle_driven=out.angle_driven,
            y_driver=shown.y_driver,
            y_driven=shown.y_driven,
            dte=self._dte(shown),
            force=generalised_force(rig, self.elastic.pair, applied, out.torque_driven),
            x_driver=shown.x_driver if across else None,
            x_driven=shown.x_driven if across else None,
            torque_driver=applied if held else None,
            tooth_force={name: getattr(out, name) for name in (*PAIRS, "back")} if self.teeth else None,
        )

    def divided(self, outputs: Array) -> int:
        return int(columns(outputs).divided.sum())

    def apart(self, outputs: Array) -> NDArray[np.bool_]:
        return np.asarray(columns(outputs).loaded == 0)

    def strayed(self, outputs: Array) -> NDArray[np.bool_]:
        return np.asarray(columns(outputs).strayed > 0)


def rest_of(machine: Machine, torque: float, t: float) -> Step:
    """Where a motion begins: at rest under the mean torque [N m], or, at a position where the flanks do not bear that,
    under the largest of its halves that they do bear. Raises ContactError where there is none."""
    for halved in range(HALVINGS):
        try:
            return initial_state(machine, torque / 2**halved, t)
        except ContactError:
            continue
    return initial_state(machine, torque / 2**HALVINGS, t)


def prepare(case: Case, plan: Schedule, note: Note) -> Elastic:
    """Gears condensed, contact tabulated, step chosen, and a look at rest. Raises GeometryError, ContactError or
    BenchError."""
    prepared = prepare_unseen(case, plan, note)
    note("looking at rest")
    check_rest(prepared.machine, prepared.dte, case.experiment.torque_mean, plan)
    return prepared


def prepare_unseen(case: Case, plan: Schedule, note: Note) -> Elastic:
    """The same without the look at rest, which takes longer than all else once gears are condensed: for a rig close to
    one that has been looked at."""
    elastic = elastic_rig(case.rig, case.simulation, note)
    duration = (plan.record_samples - 1) / plan.sampling_rate
    machine = machine_for(elastic, plan.mesh_frequency, case.experiment.torque_mean, duration, plan.rotation)
    substeps = choose_substeps(machine, case, plan)
    return Elastic(
        elastic=elastic,
        machine=machine,
        scheme=make_scheme(1.0 / (plan.sampling_rate * substeps), case.simulation.spectral_radius),
        substeps=substeps,
        mean_torque=case.experiment.torque_mean,
        sampling_rate=plan.sampling_rate,
        samples_per_period=plan.samples_per_period,
        teeth=case.simulation.outputs == "teeth",
        changes=plan.rotation is not None,
    )
