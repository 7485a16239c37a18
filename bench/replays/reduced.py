"""A record's own torque and driven rotation on the reduced finite-element model of a rig: what that rig would have
answered."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, inf, log, pi
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.elastic.model import Reduced
from gearbench.bench.elastic.run import Elastic, State, prepare_unseen, rest_of
from gearbench.bench.elastic.together import under_ripple
from gearbench.bench.errors import BenchError
from gearbench.bench.nonlinear.followed import Followed
from gearbench.bench.nonlinear.replay import PERIODS_MAX, TOLERANCE, TRANSIENT, Given, answer, given_by, resampled
from gearbench.bench.plan.workers import READY
from gearbench.bench.protocol import Drive
from gearbench.bench.record.remarks import beyond_model
from gearbench.bench.record.sensors import repeated
from gearbench.fem.motion.machine import STEADY, Course, Machine, make_machine
from gearbench.fem.motion.transient import CHANNELS
from gearbench.rig import Case

Array = NDArray[np.float64]


class Start(NamedTuple):
    """Where a replay begins: its equations of motion, the state, and samples until the record's first one."""

    machine: Machine
    state: State
    early: int


def replay(case: Case, record: xr.Dataset, realisation: int = 0) -> xr.Dataset:
    """One steady repetition of the case's rig, by finite elements, under the record's torque, rotation of the driven
    gear, sampling and starting mesh phase; all as in `bench.nonlinear.replay.replay`, but that a stiffness that drifts
    is refused: nothing repeats then.

    Raises BenchError for a record that says too little and for a rig that the model does not represent, GeometryError
    and ContactError, one sentence each.
    """
    # Steps and table sizes are those that the model chooses for itself.
    chosen = case.simulation.model_copy(update={"model": "reduced", "contact": "law", "outputs": "motion",
                                                "substeps": 0})  # fmt: skip
    given = given_by(case.model_copy(update={"simulation": chosen}), record, realisation)
    Reduced().refuse(given.case)
    with READY:
        prepared = prepare_unseen(given.case, given.plan, lambda note: None)
    start = _start(prepared, given)
    prepared = replace(prepared, machine=start.machine)
    torque, substeps = given.torque, prepared.substeps
    fine = resampled(torque, substeps * torque.size)
    # An entry is the torque at the end of its step.
    outputs, residual = _settled(prepared, Drive(torque, np.roll(fine, -1)), given, start)
    samples, rig = len(outputs), given.case.rig
    applied = repeated(torque, samples)
    channels = prepared.channels(outputs, applied)
    cycles = given.phase + np.arange(samples) * given.plan.cycles_per_sample
    channels = channels._replace(
        torque_driver=applied,
        angle_driver=channels.angle_driver - 2 * pi * cycles / rig.driver.teeth,
        angle_driven=channels.angle_driven - 2 * pi * cycles / rig.driven.teeth,
    )
    strayed = prepared.strayed(outputs)
    told = beyond_model(int(strayed.sum()), samples, float(np.argmax(strayed)) / given.plan.sampling_rate)
    if told:
        raise BenchError(told)
    lost = int(prepared.apart(outputs).sum())
    return answer(given, channels, residual, lost, {"model": "reduced", "substeps": substeps})


def _start(prepared: Elastic, given: Given) -> Start:
    """The rig at rest under the mean torque, as long before the record as free vibrations take to die out."""
    plan, mean = given.plan, prepared.mean_torque
    decay = max(prepared.settling, 1e-9)
    early = min(ceil(log(1 / TRANSIENT) / decay * plan.sampling_rate), plan.block_samples)
    machine, time = prepared.machine, given.phase / plan.mesh_frequency - early / plan.sampling_rate
    if given.turning is None:
        step = rest_of(machine, mean, time)
        if not given.nominal and machine.load_shaft[0]:
            # What the record tells is how the gear stands, not the far end of its shaft.
            step = rest_of(machine, mean, time - float(step.d[machine.at.driven]) / machine.speed2)
        return Start(machine, State(-early, under_ripple(machine, step), np.zeros(CHANNELS), begins=True), early)
    course, begin = _course(given, given.turning, early, prepared.substeps)
    phase = float(given.turning.cycles(np.array([-early / plan.sampling_rate]))[0])
    # At rest there is no course yet: it begins where the nominal rotation has that phase.
    step = rest_of(machine, mean, phase / plan.mesh_frequency)._replace(t=begin)
    e = prepared.elastic
    following = make_machine(e.rig, e.pair, e.law, e.gears, e.bodies, plan.mesh_frequency, mean, course=course)
    return Start(following, State(-early, under_ripple(following, step), np.zeros(CHANNELS), begins=True), early)


def _course(given: Given, turning: Followed, early: int, substeps: int) -> tuple[Course, float]:
    """The recorded rotation from `early` samples before the record on, for as long as a motion may take to settle, and
    the time [s] at which it begins.

    Steps end halfway between its instants, so that speeds, linear between them, have the acceleration of the step's
    end to second order.
    """
    plan, teeth = given.plan, given.case.rig.driver.teeth
    half = 0.5 / (plan.sampling_rate * substeps)
    samples = early + (PERIODS_MAX + 2) * plan.block_samples + 1
    time = -early / plan.sampling_rate + half * np.arange(-2.0, 2 * substeps * samples)
    cycles, frequency = turning.cycles(time)[1::2], turning.frequency(time)[1::2]
    clock = half * np.arange(1.0, 2 * len(cycles), 2)
    return STEADY._replace(time=clock, speed=2 * pi / teeth * frequency, angle=2 * pi / teeth * cycles), 2 * half


def _settled(prepared: Elastic, drive: Drive, given: Given, start: Start) -> tuple[Array, float]:
    """Outputs (samples, n) of one repetition after free vibrations have died out, and how steady it is: the change of
    the DTE over its standard deviation, in the mesh period in which the next repetition begins."""
    block = given.plan.block_samples
    again = min(ceil(given.plan.mesh_period * given.plan.sampling_rate), block)
    state, _ = prepared.advance(drive, start.state, start.early)
    state, outputs = prepared.advance(drive, state, block)
    residual = inf
    for number in range(PERIODS_MAX):
        state, more = prepared.advance(drive, state, again)
        dte, later = prepared.dte(outputs), prepared.dte(more)
        residual = float(np.abs(later - dte[:again]).max() / max(dte.std(), 1e-6 * abs(dte.mean())))
        if residual <= TOLERANCE or number == PERIODS_MAX - 1:
            break
        state, rest = prepared.advance(drive, state, block - again)
        outputs = np.concatenate([more, rest])
    return outputs, residual
