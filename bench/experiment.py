"""One experiment, whatever the model: made ready, run, and the record of it, in memory or straight into its file."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.finish import begin_of, channel_attributes, record_attributes, shown
from gearbench.bench.models import model_for
from gearbench.bench.plan.damping import damping_advice
from gearbench.bench.plan.memory import Work, check_disk, check_held, check_memory, check_work
from gearbench.bench.plan.schedule import ProgressReport, schedule
from gearbench.bench.plan.settling import check_decay, check_settling, kept_samples
from gearbench.bench.plan.workers import READY, processors
from gearbench.bench.realisations import Ready, Realisation, raw_channels, realise, stretches
from gearbench.bench.record.channels import Stretch
from gearbench.bench.record.sensors import CHANNELS, Noise, check_delays, needs_whole
from gearbench.bench.refusals.effects import is_nonlinear
from gearbench.bench.refusals.gears import check_gears
from gearbench.bench.refusals.stated import check_stated
from gearbench.bench.tape import End, Shelf
from gearbench.files import FileError, fingerprint
from gearbench.geometry import pair
from gearbench.records import make_record
from gearbench.records.pieces import Head, Piece, write_pieces
from gearbench.records.provenance import source_digest
from gearbench.records.tally import Tally
from gearbench.rig import Case, dump_case

Array = NDArray[np.float64]


def simulate(
    case: Case,
    model: str | None = None,
    progress: ProgressReport | None = None,
    *,
    checkpoints: str | Path | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """Record of the case's experiment, simulated with `model` (absent: the case's own), in memory: `simulate_to` makes
    one of any size.

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
    ready = _ready(case, model, progress, workers)
    shape = _check_memory(ready, workers)
    shelf = None if checkpoints is None else Shelf(Path(checkpoints), _identity(ready.case))
    # Filled row by row as realisations end: a hundred long ones are large, and must not be in memory twice.
    channels: dict[str, Array] = {}
    lock = threading.Lock()

    def take(number: int, end: End) -> None:
        for name, values in raw_channels(ready.prepared, end, 0, shape[1]).items():
            with lock:
                rows = channels[name] if name in channels else channels.setdefault(name, np.empty(shape))
            rows[number] = values

    runs = realise(ready, take, shelf, workers)
    meshing, begin = pair(ready.case.rig), begin_of(runs)
    channels = shown(ready, meshing, channels, runs, begin, ready.samples)
    attributes = record_attributes(ready, meshing, runs)
    about = channel_attributes(ready, runs, channels)
    return make_record(channels, attributes, channel_attributes=about, start=begin / ready.plan.sampling_rate)


def simulate_to(
    case: Case,
    path: str | Path,
    model: str | None = None,
    progress: ProgressReport | None = None,
    *,
    checkpoints: str | Path | None = None,
    workers: int | None = None,
) -> dict[str, Any]:
    """The record that `simulate` makes, straight into the file `path`, and its size in numbers.

    Memory holds what is at work, not the record: realisations that have ended wait in the folder `checkpoints` (absent:
    `path` with .part behind it, removed in the end), and a long one goes there stretch by stretch; the file is made of
    them when all have settled. Raises what `simulate` raises, and FileError.

    >>> import gearbench as gb
    >>> made = gb.simulate_to(gb.read_case("quick_lumped", ["experiment.realisations=2"]), "record.nc")
    >>> made["realisations"], made["duration_s"]
    (2, 0.5)
    """
    ready, target = _ready(case, model, progress, workers), Path(path)
    total, kept = _check_memory(ready, workers, streamed=True)
    check_disk(ready.samples, total, kept, target)
    folder = Path(checkpoints) if checkpoints is not None else target.with_name(f"{target.name}.part")
    shelf = Shelf(folder, _identity(ready.case), needed=True)
    runs = realise(ready, lambda number, end: None, shelf, workers, streamed=True)
    meshing, begin = pair(ready.case.rig), begin_of(runs)
    head = Head(
        realisations=len(runs),
        samples=ready.samples,
        attributes=record_attributes(ready, meshing, runs),
        channel_attributes=channel_attributes(ready, runs, CHANNELS),
        start=begin / ready.plan.sampling_rate,
    )
    tallies = {name: Tally() for name in ("dte", "torque_driver")}
    try:
        write_pieces(target, head, _counted(_pieces(ready, runs, shelf), tallies))
    except BaseException:
        with suppress(OSError):
            shelf.flush()
        raise
    if checkpoints is None:
        shelf.clear()
    return _size(target, head, tallies)


def check_record_held(case: Case) -> None:
    """Raise BenchError where the record of a case is larger than the memory that is free."""
    case, solver = model_for(case)
    plan = schedule(case.experiment, case.rig)
    mean = not solver.elastic and not is_nonlinear(case)  # the record is a mean of blocks
    check_held(kept_samples(plan, "mean") if mean else plan.record_samples, case.experiment.realisations)


def _ready(case: Case, model: str | None, progress: ProgressReport | None, workers: int | None) -> Ready:
    """The experiment made ready, whatever cannot be asked for refused."""
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
    if not plan.repeats and prepared.decay is not None:
        check_decay(plan, case.experiment, prepared.decay, damping_advice(case))
    else:
        linear = prepared.keep == "mean"
        check_settling(plan, case.experiment, prepared.slowest, damping_advice(case), linear)
    report(0.0, f"integrating with {prepared.substeps} steps a sample")
    return Ready(case, plan, prepared, report)


def _check_memory(ready: Ready, workers: int | None, streamed: bool = False) -> tuple[int, int]:
    """Realisations and samples that are simulated. Raises BenchError where they take more memory than there is."""
    plan, total = ready.plan, ready.case.experiment.realisations
    kept = kept_samples(plan, ready.prepared.keep)
    at_once = min(workers or processors(), total)
    if streamed:
        compared = plan.block_samples if plan.repeats else plan.samples_per_period
        block = compared if plan.repeats or ready.prepared.decay is None else 0
        whole = needs_whole(ready.case.rig)
        period = plan.samples_per_period if ready.case.experiment.multisine else 1
        work = Work(kept, block, period, ready.prepared.substeps, ready.samples if whole else 0)
        check_work(work, at_once)
    else:
        check_memory(ready.samples, kept, ready.prepared.substeps, total, at_once)
    return total, kept


def _identity(case: Case) -> str:
    return fingerprint(dump_case(case), source_digest())


def _pieces(ready: Ready, runs: list[Realisation], shelf: Shelf) -> Iterator[Piece]:
    """The record's samples, of one realisation after the other as the shelf keeps them. Raises FileError."""
    case, plan, meshing, begin = ready.case, ready.plan, pair(ready.case.rig), begin_of(runs)
    whole = needs_whole(case.rig)
    for number, run in enumerate(runs):
        end = shelf.ended(number)
        if end is None:
            raise FileError(f"{shelf.folder} has lost a realisation: it must stay as it is until the record is written")
        noise = Noise(case.experiment.seed, plan.samples_per_period, number)
        length = len(end.steady.outputs)
        for at, within, count in [(0, 0, length)] if whole else stretches(ready.samples, length):
            raw = {name: values[None] for name, values in raw_channels(ready.prepared, end, within, count).items()}
            samples = ready.samples if whole else count
            found = shown(ready, meshing, raw, [run], begin, samples, Stretch(at, within, noise))
            yield Piece(number, at, {name: values[0] for name, values in found.items()})
            del raw, found  # before the next ones are made
            ready.report(1.0, f"writing realisation {number + 1} of {len(runs)}")


def _counted(pieces: Iterable[Piece], tallies: Mapping[str, Tally]) -> Iterator[Piece]:
    for piece in pieces:
        for name, tally in tallies.items():
            tally.add(piece.channels[name])
        yield piece
        del piece


def _size(path: Path, head: Head, tallies: Mapping[str, Tally]) -> dict[str, Any]:
    """Size of a record and of its transmission error."""
    rate = float(head.attributes["sampling_rate"])
    return {
        "file": str(path),
        "model": head.attributes["model"],
        "realisations": head.realisations,
        "duration_s": head.samples / rate,
        "sampling_rate_hz": rate,
        "dte_peak_to_peak_um": float(tallies["dte"].most - tallies["dte"].least) * 1e6,
        "torque_rms_nm": tallies["torque_driver"].deviation,
        "settling_residual": head.attributes["settling_residual"],
        "warnings": head.attributes["warnings"] or "",
    }
