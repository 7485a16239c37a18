"""One experiment, whatever the model: periods, realisations side by side, settling, and the record of it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.models import model_for
from gearbench.bench.plan.damping import damping_advice
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.memory import check_memory
from gearbench.bench.plan.schedule import ProgressReport, Schedule, schedule
from gearbench.bench.plan.settling import Course, Steady, kept_samples, samples_to_run, steady_state, waiting
from gearbench.bench.plan.workers import READY, processors, realisations
from gearbench.bench.protocol import Drive, Prepared
from gearbench.bench.record.attributes import (
    divided_steps,
    experiment_attributes,
    joined,
    lost_contact,
    rig_attributes,
    shown_mean,
    unlike_periods,
    unsettled,
)
from gearbench.bench.record.channels import mesh_phases, sensed, tooth_channels, with_rotation
from gearbench.bench.record.sensors import check_delays, repeated, sensor_attributes
from gearbench.bench.refusals.gears import check_gears
from gearbench.bench.refusals.stated import check_stated
from gearbench.bench.tape import Shelf, Tape
from gearbench.files import fingerprint
from gearbench.geometry import pair
from gearbench.records import make_record, provenance
from gearbench.records.provenance import source_digest
from gearbench.rig import Case, dump_case
from gearbench.rig.neutral import has_sensors

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Realisation:
    """What one realisation leaves beside its channels: `lost` samples without contact, None where the model has no such
    thing, likewise steps that were `divided`; the rest as in `Steady`."""

    lost: int | None
    divided: int | None
    residual: float
    settling_periods: int
    first: int
    scatter: Array | None


def simulate(
    case: Case,
    model: str | None = None,
    progress: ProgressReport | None = None,
    *,
    checkpoints: str | Path | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """Record of the case's experiment, simulated with `model` (absent: the case's own).

    `checkpoints` is a folder for what is done so far: a simulation that was interrupted, or killed, goes on from there
    when the same one is asked for again, and gives the same record to the last bit. Who has written the record removes
    the folder.

    `progress(fraction, note)` is called now and then, from any thread. A case with conditions has one experiment for
    each: simulate each of `case.experiments()`. The realisations run on `workers` threads (absent: as many as this
    process may use processors); the result does not depend on their number. Raises BenchError for an unknown model and
    for a motion that does not settle, and what the solver raises, one sentence each.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=2"]))
    >>> record["angle_driver"].sizes["realisation"], record["angle_driver"].attrs["units"]
    (2, 'rad')
    """
    report = progress or (lambda fraction, note: None)
    check_stated(case, "a simulation")
    case, solver = model_for(case, model)
    check_gears(case.rig)
    solver.refuse(case)
    if workers is not None and workers < 1:
        raise BenchError(f"workers = {workers} must be at least 1")
    plan = schedule(case.experiment, case.rig)
    check_delays(case.rig, plan.wraps, plan.repeat_time, case.experiment.changes_speed)
    with READY:
        prepared = solver.prepare(case, plan, lambda note: report(0.0, note))
    report(0.0, f"integrating with {prepared.substeps} steps a sample")
    shape = (case.experiment.realisations, kept_samples(plan, prepared.keep))
    at_once = min(workers or processors(), shape[0])
    check_memory(_recorded(plan, prepared), shape[1], prepared.substeps, shape[0], at_once)
    # Filled row by row as realisations end: a hundred long ones are large, and must not be in memory twice.
    channels = {"torque_driver": np.empty(shape)}
    shelf = None if checkpoints is None else Shelf(Path(checkpoints), fingerprint(dump_case(case), source_digest()))
    runs = _realise(case, plan, prepared, channels, report, shelf, workers)
    return _record(case, plan, prepared, channels, runs)


def _realise(
    case: Case,
    plan: Schedule,
    prepared: Prepared[Any],
    channels: dict[str, Array],
    report: ProgressReport,
    shelf: Shelf | None,
    workers: int | None,
) -> list[Realisation]:
    """All realisations of an experiment, told about and interrupted between their pieces; each fills its row of the
    channels (realisations, n), before any sensor. Those beside torque_driver are added as the model has them."""
    total = case.experiment.realisations
    done = np.zeros(total)
    lock, stop = threading.Lock(), threading.Event()
    decay = None if plan.repeats else prepared.decay
    slowest = None if case.experiment.settling_periods_max else prepared.slowest
    wait = waiting(plan, case.experiment, slowest, damping_advice(case))
    if prepared.keep == "mean":
        # A linear rig answers what repeats by what repeats: what still changes in the end grows for ever.
        wait = wait._replace(ends=False)
    expected = samples_to_run(plan, prepared.keep)

    def run(number: int) -> Realisation:
        def tell(fraction: float) -> None:
            if stop.is_set():
                raise InterruptedError("another realisation has failed, or the run was interrupted")
            with lock:
                done[number] = fraction
                report(float(done.mean()), f"realisation {number + 1} of {total}")

        drive = prepared.drive(torque_realisation(case.experiment, number, case.rig))
        steady = shelf.ended(number) if shelf else None
        if steady is None:
            # A realisation that takes longer to settle than expected stays close to its end.
            tape = partial(_tape, shelf, number) if shelf else None
            course = course_of(prepared, drive, lambda samples: tell(min(samples / expected, 0.99)), tape)
            steady = steady_state(course, plan, case.experiment, prepared.dte, prepared.keep, decay, wait)
            if shelf:
                shelf.end(number, steady)
        torque = repeated(drive.torque, len(steady.outputs))
        channels["torque_driver"][number] = torque
        found = prepared.channels(steady.outputs, torque)
        teeth = tooth_channels(found.tooth_force) if found.tooth_force is not None else {}
        for name, values in {**found._asdict(), "tooth_force": None, **teeth}.items():
            if values is not None:
                with lock:
                    rows = channels.setdefault(name, np.empty_like(channels["torque_driver"]))
                rows[number] = values
        tell(1.0)
        return _realisation(prepared, plan, steady)

    try:
        return realisations(run, total, stop, workers)
    except BaseException:
        if shelf:
            shelf.flush()
        raise


def _tape(shelf: Shelf, number: int, course: int, start: Any) -> Tape:
    return shelf.tape(f"{number}-{course}", start)


def course_of(
    prepared: Prepared[Any],
    drive: Drive,
    ran: Callable[[int], None],
    tape: Callable[[int, Any], Tape] | None = None,
) -> Course:
    """The course of one realisation; `ran(samples)` is told between its pieces how far it has come, and may raise.

    `tape(n, start)` gives the tape of the realisation's n-th course, on which it plays and is kept.
    """
    run, begun = 0, 0

    def course(first: int, lengths: Iterable[int]) -> Iterator[Array]:
        nonlocal run, begun
        state = prepared.start(first)
        kept = tape(begun, state) if tape else None
        begun += 1
        try:
            for length in lengths:
                parts = []
                for at in range(0, length, prepared.piece or length):
                    count = min(prepared.piece or length, length - at)
                    outputs = kept.take(count) if kept else None
                    if outputs is None:
                        state, outputs = prepared.advance(drive, kept.state if kept else state, count)
                        if kept:
                            kept.put(state, outputs)
                    parts.append(outputs)
                    run += count
                    ran(run)
                yield parts[0] if len(parts) == 1 else np.vstack(parts)
        except Exception:
            if kept:
                kept.flush()
            raise

    return course


def _realisation(prepared: Prepared[Any], plan: Schedule, steady: Steady) -> Realisation:
    apart = prepared.apart(steady.outputs)
    return Realisation(
        divided=prepared.divided(steady.outputs),
        lost=None if apart is None else int(repeated(apart, _recorded(plan, prepared)).sum()),
        residual=steady.residual,
        settling_periods=steady.settling_periods,
        first=steady.first,
        scatter=steady.scatter,
    )


def _recorded(plan: Schedule, prepared: Prepared[Any]) -> int:
    """Samples of the record: a mean over blocks is as long as one of them."""
    return kept_samples(plan, "mean") if prepared.keep == "mean" else plan.record_samples


def _record(
    case: Case, plan: Schedule, prepared: Prepared[Any], channels: dict[str, Array], runs: list[Realisation]
) -> xr.Dataset:
    meshing = pair(case.rig)
    samples = _recorded(plan, prepared)
    averaged = prepared.keep == "mean"
    first = max(run.first for run in runs)
    begin = first * plan.cycles_per_sample
    absolute = prepared.absolute
    if absolute:
        channels = _aligned(channels, runs, plan)
    elif plan.rotation is not None:
        channels, absolute = with_rotation(channels, plan), True
    if has_sensors(case.rig):
        seed, ramps = case.experiment.seed, absolute and plan.rotation is None
        swings = with_rotation(channels, plan, begin, -1.0) if ramps else channels
        teeth = {name: values for name, values in channels.items() if name.startswith(("tooth_force_", "load_share_"))}
        channels = sensed(swings, case.rig, meshing, plan, samples=samples, seed=seed, first=begin)
        channels = with_rotation(channels, plan, begin) if ramps else channels
        channels |= teeth  # no sensor sees them
    channels = {name: repeated(values, samples) for name, values in channels.items()}
    channels = channels if absolute else with_rotation(channels, plan)
    phase = mesh_phases(plan, samples, begin)
    channels["mesh_phase"] = np.broadcast_to(phase, channels["dte"].shape)
    lost = None if runs[0].lost is None else sum(run.lost or 0 for run in runs)
    divided = None if runs[0].divided is None else sum(run.divided or 0 for run in runs)
    told = (
        lost_contact(lost or 0, len(runs) * samples),
        divided_steps(divided or 0, len(runs) * samples * prepared.substeps),
        unlike_periods(plan),
        unsettled(max(run.residual for run in runs), case.experiment.settling_tolerance),
    )
    periods = samples // plan.samples_per_period
    attributes = {
        **rig_attributes(case.rig, meshing),
        **experiment_attributes(plan, periods, shown_mean(case.rig, case.experiment.torque_mean)),
        "periods_averaged": plan.blocks if averaged else None,
        "settling_residual": max(run.residual for run in runs),
        "settling_periods": max(run.settling_periods for run in runs),
        "repeats_after_mesh_cycles": plan.repeat_cycles,
        "hunting_period": None if plan.rotation else plan.repeat_cycles * plan.mesh_period,
        "contact_lost_samples": lost,
        "divided_steps": divided,
        "warnings": joined(*told, *prepared.warnings),
        "model": case.simulation.model,
        "substeps": prepared.substeps,
        **prepared.attributes,
        "provenance": provenance(dump_case(case), case.experiment.seed, prepared.settings),
    }
    about = _about(case, prepared, runs, channels)
    return make_record(channels, attributes, channel_attributes=about, start=first / plan.sampling_rate)


def _aligned(channels: dict[str, Array], runs: list[Realisation], plan: Schedule) -> dict[str, Array]:
    """Absolute angles brought to the latest start: others are whole blocks earlier."""
    late = np.array([max(run.first for run in runs) - run.first for run in runs])[:, None] / plan.sampling_rate
    if not late.any():
        return channels
    speeds = {"angle_driver": plan.speed_driver, "angle_driven": plan.speed_driven}
    return {**channels, **{name: channels[name] + late * speed for name, speed in speeds.items()}}


def _about(
    case: Case, prepared: Prepared[Any], runs: list[Realisation], channels: dict[str, Array]
) -> Mapping[str, Mapping[str, Any]]:
    """Attributes of channels: those of their sensors, and their scatter."""
    about = sensor_attributes(case.rig, channels)
    for name, scatter in _scatter(prepared, runs).items():
        about[name] = {**about.get(name, {}), **scatter}
    return about


def _scatter(prepared: Prepared[Any], runs: list[Realisation]) -> Mapping[str, Mapping[str, float]]:
    """Attribute period_scatter of the channels, the rms over all realisations; none where nothing is averaged."""
    scatters = [run.scatter for run in runs if run.scatter is not None]
    if not scatters:
        return {}
    rms = np.sqrt((np.stack(scatters) ** 2).mean(axis=0))
    spread = prepared.channels(rms[None], np.zeros(1))._asdict()
    measured = ("torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven")
    return {name: {"period_scatter": abs(float(spread[name][0]))} for name in measured}
