"""All realisations of an experiment, side by side, each on its way to the steady state."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.damping import damping_advice
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.schedule import ProgressReport, Schedule
from gearbench.bench.plan.settling import Course, Steady, kept_samples, samples_to_run, steady_state, waiting
from gearbench.bench.plan.stored import PIECE, in_memory
from gearbench.bench.plan.workers import realisations
from gearbench.bench.protocol import Channels, Drive, Prepared
from gearbench.bench.record.channels import tooth_channels
from gearbench.bench.tape import End, Shelf, Tape
from gearbench.rig import Case

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Realisation:
    """What one realisation leaves beside its channels: `lost` samples without contact, None where the model has no such
    thing, likewise steps that were `divided` and samples beyond what is modelled (`strayed`, the first of them
    `strayed_first`, None where there is none); the rest as in `Steady`."""

    lost: int | None
    divided: int | None
    strayed: int | None
    strayed_first: int | None
    residual: float
    settling_periods: int
    first: int
    scatter: Array | None


@dataclass(frozen=True)
class Ready:
    """An experiment made ready, and who is told how far it is."""

    case: Case
    plan: Schedule
    prepared: Prepared[Any]
    report: ProgressReport

    @property
    def samples(self) -> int:
        """Samples of the record: a mean over blocks is as long as one of them."""
        return kept_samples(self.plan, "mean") if self.prepared.keep == "mean" else self.plan.record_samples


def realise(
    ready: Ready,
    take: Callable[[int, End], None],
    shelf: Shelf | None,
    workers: int | None,
    streamed: bool = False,
) -> list[Realisation]:
    """All realisations, told about and interrupted between their pieces; each is handed to `take(number, end)` when it
    has ended. `streamed`: long outputs go into files of the shelf."""
    case, plan, prepared = ready.case, ready.plan, ready.prepared
    total = case.experiment.realisations
    done = np.zeros(total)
    lock, stop = threading.Lock(), threading.Event()
    decay = None if plan.repeats else prepared.decay
    slowest = None if case.experiment.settling_periods_max else prepared.slowest
    wait = waiting(plan, case.experiment, slowest, damping_advice(case))
    expected = samples_to_run(plan, prepared.keep)

    def run(number: int) -> Realisation:
        def tell(fraction: float) -> None:
            if stop.is_set():
                raise InterruptedError("another realisation has failed, or the run was interrupted")
            with lock:
                done[number] = fraction
                ready.report(float(done.mean()), f"realisation {number + 1} of {total}")

        end = shelf.ended(number) if shelf else None
        if end is None:
            drive = prepared.drive(torque_realisation(case.experiment, number, case.rig))
            # A realisation that takes longer to settle than expected stays close to its end.
            tape = partial(_tape, shelf, number) if shelf else None
            course = course_of(prepared, drive, lambda samples: tell(min(samples / expected, 0.99)), tape)
            gather = shelf.gather(number) if shelf and streamed else in_memory
            settle = partial(steady_state, gather=gather, piece=prepared.piece)
            steady = settle(course, plan, case.experiment, prepared.dte, prepared.keep, decay, wait)
            end = End(steady, drive.torque)
            if shelf:
                shelf.end(number, end)
        take(number, end)
        found = _realisation(ready, end.steady)
        tell(1.0)
        return found

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


def raw_channels(prepared: Prepared[Any], end: End, within: int, samples: int) -> dict[str, Array]:
    """Channels (samples,) of a realisation from sample `within` of what was run on, before any sensor."""
    outputs = end.steady.outputs[within : within + samples]
    torque = end.torque
    if len(torque) != samples or within:
        torque = np.take(torque, np.arange(within, within + samples) % len(torque))
    found: Channels = prepared.channels(outputs, torque)
    teeth = tooth_channels(found.tooth_force) if found.tooth_force is not None else {}
    given = {**found._asdict(), "tooth_force": None, **teeth}
    return {"torque_driver": torque, **{name: values for name, values in given.items() if values is not None}}


def stretches(samples: int, length: int) -> Iterator[tuple[int, int, int]]:
    """Where the stretches of a record begin, in it and in the `length` samples that it repeats, and their samples: none
    is longer than PIECE or goes beyond the end of what repeats."""
    at = 0
    while at < samples:
        within = at % length
        count = min(PIECE, length - within, samples - at)
        yield at, within, count
        at += count


def _realisation(ready: Ready, steady: Steady) -> Realisation:
    prepared, outputs = ready.prepared, steady.outputs

    def lost(within: int, count: int) -> int | None:
        apart = prepared.apart(outputs[within : within + count])
        return None if apart is None else int(apart.sum())

    def divided(within: int, count: int) -> int | None:
        return prepared.divided(outputs[within : within + count])

    first_strayed: list[int] = []

    def strayed(within: int, count: int) -> int | None:
        beyond = prepared.strayed(outputs[within : within + count])
        if beyond is None:
            return None
        if beyond.any() and not first_strayed:
            first_strayed.append(within + int(beyond.argmax()))
        return int(beyond.sum())

    return Realisation(
        strayed=_summed(strayed, ready.samples, len(outputs)),
        strayed_first=first_strayed[0] if first_strayed else None,
        divided=_summed(divided, len(outputs), len(outputs)),
        lost=_summed(lost, ready.samples, len(outputs)),
        residual=steady.residual,
        settling_periods=steady.settling_periods,
        first=steady.first,
        scatter=steady.scatter,
    )


def _summed(number: Callable[[int, int], int | None], samples: int, length: int) -> int | None:
    """A number of each stretch, summed; None where there is no such thing."""
    total = 0
    for _, within, count in stretches(samples, length):
        if (found := number(within, count)) is None:
            return None
        total += found
    return total
