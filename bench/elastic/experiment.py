"""A whole experiment on the reduced finite-element model: settle, record, and say how steady it was."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import cos

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig, choose_substeps, elastic_rig, machine_for
from gearbench.bench.errors import BenchError
from gearbench.bench.plan.excitation import Torque, torque_realisation
from gearbench.bench.plan.schedule import ProgressReport, Schedule, schedule
from gearbench.bench.plan.workers import realisations
from gearbench.bench.record.attributes import lost_contact, rig_attributes
from gearbench.bench.refusals.effects import ELASTIC_KEYS, cycles_to_repeat, refuse_effects
from gearbench.fem.contact.curve import EDGE_SEPARATION
from gearbench.fem.motion.machine import Machine
from gearbench.fem.motion.transient import CHANNELS, Scheme, State, advance, initial_state, make_scheme
from gearbench.geometry import Pair
from gearbench.records import make_record, provenance
from gearbench.rig import Case, Experiment, dump_case

Array = NDArray[np.float64]

CHUNK = 512  # samples between two looks at progress and interruption


@dataclass(frozen=True)
class Run:
    """Recorded blocks of one realisation.

    samples (n, CHANNELS); torque (n,) [N m]; start [s] of the record, the simulation having begun one block
    before 0; residual: period-to-period change of the DTE over its standard deviation (see `_long_run` for a rig that
    does not repeat within the record); settling: excitation periods before the record.
    """

    samples: Array
    torque: Array
    start: float
    residual: float
    settling: int


def simulate_reduced(case: Case, progress: ProgressReport | None = None) -> xr.Dataset:
    """Record of the case's experiment on the reduced finite-element model, all recorded periods kept.

    Raises GeometryError, BenchError or ContactError (each one sentence) for what cannot be simulated.
    """
    report = progress or (lambda fraction, note: None)
    refuse_effects(case.rig, "reduced finite-element model", represented=ELASTIC_KEYS)
    plan = schedule(case.experiment, case.rig, cycles_to_repeat(case.rig))
    elastic = elastic_rig(case.rig, case.simulation, lambda note: report(0.0, note))
    machine = machine_for(elastic, plan.mesh_frequency)
    substeps = choose_substeps(machine, case, plan)
    scheme = make_scheme(1.0 / (plan.sampling_rate * substeps), case.simulation.spectral_radius)
    report(0.0, f"integrating with {substeps} steps a sample")
    start = initial_state(machine, case.experiment.torque_mean, -plan.block_samples / plan.sampling_rate)
    total = case.experiment.realisations
    done = np.zeros(total)
    lock = threading.Lock()
    stop = threading.Event()

    def run(number: int) -> Run:
        def tell(fraction: float) -> None:
            if stop.is_set():
                raise InterruptedError("another realisation has failed, or the run was interrupted")
            with lock:
                done[number] = fraction
                report(float(done.mean()), f"realisation {number + 1} of {total}")

        torque = torque_realisation(case.experiment, number, case.rig)
        if not plan.repeats:
            return _long_run(machine, scheme, plan, case.experiment, torque, substeps, tell)
        return _run(machine, scheme, start, plan, case.experiment, torque, substeps, tell)

    runs = realisations(run, total, stop)
    return _record(case, elastic, plan, runs, substeps)


def _run(
    machine: Machine,
    scheme: Scheme,
    state: State,
    plan: Schedule,
    experiment: Experiment,
    torque: Torque,
    substeps: int,
    tell: Callable[[float], None],
) -> Run:
    """Settle for one block, then record until the wanted blocks follow one another without change."""
    period = torque.sample(plan.samples_per_period * substeps)
    # Entry k of the shifted signal is the torque at the end of step k.
    fine = np.roll(np.tile(period, plan.block_periods), -1)
    coarse = np.tile(period[::substeps], plan.block_periods)
    # One block more than recorded shows the change from block to block where only one is wanted.
    wanted = max(plan.blocks, 2)
    blocks: list[Array] = []
    residual = np.inf
    finished = 0
    last = np.zeros(CHANNELS)  # belongs to the first block, which only settles
    while len(blocks) < wanted:
        state, samples = _block(machine, scheme, state, fine, substeps, partial(_tell_part, tell, finished, wanted))
        # The last sample of a block is the first one of the next.
        block, last = np.vstack([last[None], samples[:-1]]), samples[-1]
        finished += 1
        if finished == 1:
            continue
        blocks.append(block)
        if len(blocks) == 2:
            residual = _change(machine, blocks[0], blocks[1])
            if residual > experiment.settling_tolerance:
                settling = (finished - 1) * plan.block_periods
                if settling >= experiment.settling_periods_max:
                    raise BenchError(
                        f"no steady state: after {settling} excitation periods the DTE still changes by"
                        f" {residual:.3g} of its standard deviation from period to period"
                        f" (experiment.settling_tolerance = {experiment.settling_tolerance:g}); raise"
                        f" settling_periods_max = {experiment.settling_periods_max} or the damping"
                    )
                blocks.pop(0)
    kept = blocks[len(blocks) - plan.blocks :]
    duration = plan.block_samples / plan.sampling_rate
    start = (finished - len(kept) - 1) * duration
    settling = (finished - len(kept)) * plan.block_periods
    return Run(np.vstack(kept), np.tile(coarse, plan.blocks), start, residual, settling)


def _long_run(
    machine: Machine,
    scheme: Scheme,
    plan: Schedule,
    experiment: Experiment,
    torque: Torque,
    substeps: int,
    tell: Callable[[float], None],
) -> Run:
    """A record shorter than what repeats, from mesh phase 0 on.

    No period is like the one before, so the steady state shows in another way: two histories, one begun an excitation
    period before the other, must agree over the first recorded period.
    """
    period = torque.sample(plan.samples_per_period * substeps)
    fine = np.roll(period, -1)
    duration = plan.samples_per_period / plan.sampling_rate
    total = plan.block_periods + 2 * experiment.settling_periods_max

    def first_period(settling: int) -> tuple[State, Array, Array]:
        state = initial_state(machine, experiment.torque_mean, -settling * duration)
        last = np.zeros(CHANNELS)
        for part in range(settling + 1):
            state, samples = _block(
                machine, scheme, state, fine, substeps, partial(_tell_part, tell, settling + part, total)
            )
            block, last = np.vstack([last[None], samples[:-1]]), samples[-1]
        return state, block, last

    _, before, _ = first_period(1)
    settling = 2
    while True:
        state, block, last = first_period(settling)
        residual = _change(machine, before, block)
        if residual <= experiment.settling_tolerance:
            break
        if settling >= experiment.settling_periods_max:
            raise BenchError(
                f"no steady state: after {settling} excitation periods the DTE still depends by {residual:.3g} of its"
                " standard deviation on when the simulation began (experiment.settling_tolerance ="
                f" {experiment.settling_tolerance:g}); raise settling_periods_max ="
                f" {experiment.settling_periods_max} or the damping"
            )
        before, settling = block, settling + 1
    blocks = [block]
    for part in range(1, plan.block_periods):
        state, samples = _block(machine, scheme, state, fine, substeps, partial(_tell_part, tell, part, total))
        block, last = np.vstack([last[None], samples[:-1]]), samples[-1]
        blocks.append(block)
    return Run(np.vstack(blocks), np.tile(period[::substeps], plan.block_periods), 0.0, residual, settling)


def _tell_part(tell: Callable[[float], None], finished: int, wanted: int, fraction: float) -> None:
    """Progress while block number `finished` runs; further settling blocks leave it at the end."""
    tell(min((finished + fraction) / (1 + wanted), 1.0))


def _block(
    machine: Machine,
    scheme: Scheme,
    state: State,
    torque: Array,
    substeps: int,
    tell: Callable[[float], None],
) -> tuple[State, Array]:
    """One block, in chunks between which progress is told and an interruption takes effect."""
    parts = []
    for at in range(0, len(torque), CHUNK * substeps):
        piece = torque[at : at + CHUNK * substeps]
        state, samples, failed = advance(machine, scheme, state, piece, substeps)
        if failed < -1:
            raise BenchError(
                f"at t = {state.t:.6g} s the teeth overlap where contact leaves the modelled flanks: lower"
                " experiment.torque_mean_nm or the multisine"
            )
        if failed >= 0:
            raise BenchError(
                f"contact was not found at t = {state.t:.6g} s; more simulation.substeps than {substeps} may help"
            )
        if not np.isfinite(samples).all():
            raise BenchError(f"the integration diverged before t = {state.t:.6g} s")
        parts.append(samples)
        tell((at + len(piece)) / len(torque))
    return state, np.vstack(parts)


def _dte(case: Case, meshing: Pair, samples: Array) -> Array:
    """DTE [m] of samples (..., CHANNELS), see docs/physics.md, "Axes, signs, zeros"."""
    along = 1.0 if case.rig.support.direction == "line-of-action" else cos(meshing.working_pressure_angle)
    turned = meshing.driver.base_radius * samples[..., 0] - meshing.driven.base_radius * samples[..., 1]
    return np.asarray(turned + along * (samples[..., 2] - samples[..., 3]))


def _check_reach(elastic: ElasticRig, dte: Array) -> None:
    """Refuse a record in which the flanks overlapped further than tip edges are followed."""
    most = EDGE_SEPARATION * elastic.pair.driver.module
    if dte.max() > most:
        raise BenchError(
            f"the DTE reaches {1e6 * dte.max():.4g} um, beyond the {1e6 * most:.4g} um to which contact off the line of"
            " action is modelled for this module: lower experiment.torque_mean_nm or the multisine"
        )


def _rolled(machine: Machine, samples: Array) -> Array:
    """What the angles alone contribute to the DTE [m]."""
    law = machine.law
    return np.asarray(law.driver.rb * samples[:, 0] - law.driven.rb * samples[:, 1])


def _change(machine: Machine, before: Array, after: Array) -> float:
    first, second = _rolled(machine, before), _rolled(machine, after)
    scale = max(float(second.std()), 1e-6 * abs(float(second.mean())), np.finfo(float).tiny)
    return float(np.abs(second - first).max()) / scale


def _record(case: Case, elastic: ElasticRig, plan: Schedule, runs: list[Run], substeps: int) -> xr.Dataset:
    samples = np.stack([run.samples for run in runs])
    starts = {run.start for run in runs}
    if len(starts) > 1:
        # Later starts are whole blocks later: bring every record to the latest one's angles.
        samples = _aligned(samples, runs, plan)
    start = max(starts)
    count = samples.shape[1]
    phase = (start + np.arange(count) / plan.sampling_rate) * plan.mesh_frequency
    torque = np.stack([run.torque for run in runs])
    lost = int(np.sum(samples[:, :, 5] == 0))
    dte = _dte(case, elastic.pair, samples)
    _check_reach(elastic, dte)
    channels = {
        "torque_driver": torque,
        "torque_driven": samples[:, :, 4],
        "angle_driver": samples[:, :, 0],
        "angle_driven": samples[:, :, 1],
        "y_driver": samples[:, :, 2],
        "y_driven": samples[:, :, 3],
        "mesh_phase": np.broadcast_to(phase, samples.shape[:2]),
        "dte": dte,
        # Also where both gears turn freely, since the driven torque then balances the driver's.
        "force": torque / elastic.pair.driver.base_radius,
    }
    repeat = cycles_to_repeat(case.rig)
    warnings = [lost_contact(lost, samples.shape[0] * samples.shape[1]), _unlike_periods(plan, repeat)]
    settings = {
        "model": "reduced",
        "substeps": substeps,
        "modes_driver": len(elastic.gears[0].omega),
        "modes_driven": len(elastic.gears[1].omega),
        "unknowns_driver": elastic.gears[0].unknowns,
        "unknowns_driven": elastic.gears[1].unknowns,
    }
    attributes = {
        **rig_attributes(case.rig, elastic.pair, elastic.bodies),
        "sampling_rate": plan.sampling_rate,
        "samples_per_period": plan.samples_per_period,
        "periods": plan.blocks * plan.block_periods,
        "mesh_period": plan.mesh_period,
        "mesh_phase_origin": "geometry",
        "torque_mean": case.experiment.torque_mean,
        "settling_residual": max(run.residual for run in runs),
        "settling_periods": max(run.settling for run in runs),
        "repeats_after_mesh_cycles": repeat,
        "hunting_period": repeat * plan.mesh_period,
        "contact_lost_samples": lost,
        "warnings": "; ".join(filter(None, warnings)) or None,
        "model": "reduced",
        "substeps": substeps,
        "provenance": provenance(dump_case(case), case.experiment.seed, settings),
    }
    return make_record(channels, attributes, start=start)


def _unlike_periods(plan: Schedule, repeat: int) -> str | None:
    """Warning where the mesh period is not the period of what happens."""
    if repeat == 1:
        return None
    after = f"the teeth differ, so the rig repeats after {repeat} mesh periods ({repeat * plan.mesh_period:.4g} s)"
    return after if plan.repeats else f"{after}, longer than the record: none of its excitation periods is like another"


def _aligned(samples: Array, runs: list[Run], plan: Schedule) -> Array:
    latest = max(run.start for run in runs)
    out = samples.copy()
    for row, run in enumerate(runs):
        out[row, :, 0] += (latest - run.start) * plan.speed_driver
        out[row, :, 1] += (latest - run.start) * plan.speed_driven
    return out
