"""When a simulation has settled, and what of its steady state becomes the record.

A course is one realisation on its way: `course(first, lengths)` begins at rest at sample `first` of the record and
yields the outputs (samples, n) of one stretch of that many samples after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, islice, repeat
from math import ceil, exp, inf, log
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.plan.stored import Gather, Stored, in_memory, lengths_of
from gearbench.rig import Experiment

Array = NDArray[np.float64]

Course = Callable[[int, Iterable[int]], Iterator[Array]]
Dte = Callable[[Array], Array]

# What is kept of the steady state: every block of the record; the mean of those blocks and their scatter; one block,
# which stands for them all. A mean and a block that stands for others have no time of their own: they begin at 0.
Keep = Literal["every", "mean", "one"]

# Excitation periods that are waited for: at least, where a case leaves it open how many, and at most; how many times as
# long as free vibrations need.
FEW = 4
MOST = 10_000
PATIENCE = 2
ENDLESS = 1e8  # periods beyond which a rate is the rounding of a rig without damping


@dataclass(frozen=True)
class Steady:
    """What is kept: outputs (samples, n) from sample `first` of the record's clock on.

    residual: change of the DTE to the block before, largest value over its standard deviation, beyond the tolerance
    where free vibrations have died out and the motion yet does not repeat; settling_periods: excitation periods before
    what is kept; scatter (n,): rms departure of single blocks from their mean.
    """

    outputs: Array | Stored
    residual: float
    settling_periods: int
    first: int = 0
    scatter: Array | None = None


class Wait(NamedTuple):
    """How many excitation periods a motion may take to settle, and whether what still changes by then is the answer
    itself: free vibrations have died out, or nothing damps them. Else it is an error, with the keys that `damping`
    names."""

    most: int
    ends: bool
    damping: str = ""


class Settled(NamedTuple):
    """Two blocks that follow one another, alike to within `residual`, and the number of blocks run before them."""

    before: Array
    after: Array
    residual: float
    earlier: int


def change(before: Array, after: Array) -> float:
    """Largest change of a DTE over its standard deviation, or over a millionth of its mean if it hardly varies."""
    scale = max(float(after.std()), 1e-6 * abs(float(after.mean())), np.finfo(float).tiny)
    return float(np.abs(after - before).max()) / scale


def waiting(plan: Schedule, experiment: Experiment, slowest: float | None, damping: str = "") -> Wait:
    """How long a motion is waited for whose free vibrations die out at that slowest rate [1/s] (None: unknown);
    `damping`: the keys that damp them, for an error to name."""
    if experiment.settling_periods_max:
        return Wait(experiment.settling_periods_max, False, damping)
    if slowest is None:
        return Wait(FEW, False, damping)
    if not slowest > 0.0:
        return Wait(FEW, True)
    needed = _periods_of_decay(plan, experiment, slowest)
    if needed > MOST:
        return Wait(FEW, True)
    return Wait(min(max(FEW, ceil(PATIENCE * needed)), MOST), True)


def _periods_of_decay(plan: Schedule, experiment: Experiment, rate: float) -> float:
    """Excitation periods until free vibrations that die out at a rate [1/s] are as small as the tolerance."""
    return log(1 / experiment.settling_tolerance) / rate / (plan.samples_per_period / plan.sampling_rate)


def check_settling(
    plan: Schedule, experiment: Experiment, slowest: float | None, damping: str = "", linear: bool = False
) -> None:
    """Raise BenchError for a rig whose free vibrations die out, at that slowest rate [1/s], but later than is waited
    for, unless the case says how long; of one that is not damped at all, where it is linear: else its record tells."""
    if experiment.settling_periods_max or slowest is None:
        return
    needed = _periods_of_decay(plan, experiment, slowest) if slowest > 0.0 else inf
    if linear and needed >= ENDLESS:
        raise BenchError(f"no steady state: free vibrations do not die out: damp the rig (raise one of {damping})")
    if MOST < needed < ENDLESS:
        raise BenchError(
            f"no steady state: free vibrations take about {needed:.3g} excitation periods to die out to"
            f" experiment.settling_tolerance = {experiment.settling_tolerance:g} of their size, and at most {MOST} are"
            f" waited for: damp the rig (raise one of {damping}), or set experiment.settling_periods_max"
        )


def check_decay(plan: Schedule, experiment: Experiment, decay: float, damping: str = "") -> None:
    """Raise BenchError for a record that does not repeat, and so waits until free vibrations have died out at their
    slowest rate [1/s], where that takes too long or for ever."""
    most = experiment.settling_periods_max or MOST
    wait = Wait(most, False, damping)
    if not decay > 0:
        raise _no_steady_state("free vibrations do not die out: they grow or keep their size", experiment, wait)
    period = plan.samples_per_period / plan.sampling_rate
    periods = ceil(_periods_of_decay(plan, experiment, decay))
    if periods > most:
        raise _no_steady_state(
            f"free vibrations take {periods} excitation periods to die out: after {most} they still have"
            f" {exp(-decay * most * period):.3g} of their size",
            experiment,
            wait,
        )


def steady_state(
    course: Course,
    plan: Schedule,
    experiment: Experiment,
    dte: Dte,
    keep: Keep,
    decay: float | None,
    wait: Wait | None = None,
    gather: Gather = in_memory,
    piece: int = 0,
) -> Steady:
    """Run one realisation until it is steady, and on to the end of the record.

    decay: slowest rate [1/s] of free vibrations, where a record that does not repeat is to wait for it; wait: how long
    (absent: as where that rate is unknown); gather: where the stretches of a record of more than one block go; piece:
    as in `Prepared`. Raises BenchError if settling takes longer.
    """
    wait = wait or waiting(plan, experiment, None)
    if not plan.repeats:
        if decay is None:
            return _from_two_starts(course, plan, experiment, dte, wait, gather)
        return _after_decay(course, plan, experiment, decay, gather, piece)
    if keep == "every":
        return _every_block(course, plan, experiment, dte, wait, gather)
    blocks = course(0, repeat(plan.block_samples))
    settled = _settle(blocks, plan, experiment, dte, wait)
    periods = (settled.earlier + 1) * plan.block_periods
    if keep == "one":
        return Steady(settled.after, settled.residual, periods)
    mean, scatter = _average(settled.after, blocks, plan.blocks)
    return Steady(mean, settled.residual, periods, scatter=scatter)


def samples_to_run(plan: Schedule, keep: Keep) -> int:
    """Samples of a realisation that settles at the first look, by which progress is told."""
    if not plan.repeats:
        return (plan.periods + 4) * plan.samples_per_period
    return {"every": 1 + max(plan.blocks, 2), "mean": 1 + plan.blocks, "one": 2}[keep] * plan.block_samples


def kept_samples(plan: Schedule, keep: Keep) -> int:
    """Samples that are kept."""
    return plan.block_samples if plan.repeats and keep != "every" else plan.record_samples


def _settle(
    blocks: Iterator[Array], plan: Schedule, experiment: Experiment, dte: Dte, wait: Wait, earlier: int = 0
) -> Settled:
    """The first two blocks that are alike, `earlier` blocks having been run; the last two of a wait that ends."""
    before = next(blocks)
    while True:
        after = next(blocks)
        residual = change(dte(before), dte(after))
        if residual <= experiment.settling_tolerance:
            return Settled(before, after, residual, earlier)
        earlier += 1
        periods = (earlier + 1) * plan.block_periods
        if periods > wait.most and wait.ends:
            return Settled(before, after, residual, earlier - 1)
        if periods > wait.most:
            raise _no_steady_state(
                f"after {periods} excitation periods the DTE still changes by {residual:.3g} of its standard deviation"
                " from one repetition to the next",
                experiment,
                wait,
            )
        before = after


def _every_block(
    course: Course, plan: Schedule, experiment: Experiment, dte: Dte, wait: Wait, gather: Gather
) -> Steady:
    """Settle for one block, then keep those that follow one another without change."""
    blocks = course(-plan.block_samples, repeat(plan.block_samples))
    next(blocks)
    # One block more than recorded shows the change from block to block where only one is wanted.
    settled = _settle(blocks, plan, experiment, dte, wait, earlier=1)
    kept, earlier = [settled.before, settled.after], settled.earlier
    if plan.blocks == 1:
        kept, earlier = [settled.after], earlier + 1
    rest = plan.blocks - len(kept)
    return Steady(
        gather(chain(kept, islice(blocks, rest)), plan.record_samples),
        settled.residual,
        earlier * plan.block_periods,
        first=(earlier - 1) * plan.block_samples,
    )


def _average(first: Array, blocks: Iterator[Array], count: int) -> tuple[Array, Array]:
    """Mean over `count` blocks, of which `first` has been run, and the rms departure (n,) from it."""
    # Departures from the first block are small: their sums lose no digits.
    total, squares = np.zeros_like(first), np.zeros_like(first)
    for _ in range(count - 1):
        block = next(blocks)
        block -= first
        total += block
        block *= block
        squares += block
    total /= count
    variance = squares / count - total**2
    return first + total, np.sqrt(np.maximum(variance, 0.0).mean(axis=0))


def _after_decay(
    course: Course,
    plan: Schedule,
    experiment: Experiment,
    decay: float,
    gather: Gather,
    piece: int,
) -> Steady:
    """A record shorter than what repeats: it begins when free vibrations have died out by their slowest rate."""
    check_decay(plan, experiment, decay)
    wanted = log(1 / experiment.settling_tolerance) * plan.sampling_rate / plan.samples_per_period
    periods = ceil(wanted / decay)
    settling = periods * plan.samples_per_period
    if plan.rotation:  # an excitation period may be the whole record: the part of it that is needed is enough
        settling = max(ceil(wanted / decay * plan.samples_per_period), 1)
    before = list(lengths_of(settling, piece))
    stretches = course(-settling, chain(before, lengths_of(plan.record_samples, piece)))
    for _ in before:
        next(stretches)
    return Steady(gather(stretches, plan.record_samples), experiment.settling_tolerance, periods)


def _from_two_starts(
    course: Course, plan: Schedule, experiment: Experiment, dte: Dte, wait: Wait, gather: Gather
) -> Steady:
    """A record shorter than what repeats, of a model that does not know how fast its vibrations die out.

    No period is like the one before, so the steady state shows in another way: two histories, one begun an excitation
    period before the other, later twice as long before, must agree over the first recorded period.
    """

    def history(settling: int) -> tuple[Iterator[Array], Array]:
        periods = course(-settling * plan.samples_per_period, repeat(plan.samples_per_period))
        for _ in range(settling):
            next(periods)
        return periods, next(periods)

    before = history(1)[1]
    settling = 2
    while True:
        periods, first = history(settling)
        residual = change(dte(before), dte(first))
        if residual <= experiment.settling_tolerance or (wait.ends and settling >= wait.most):
            break
        if settling >= wait.most:
            raise _no_steady_state(
                f"after {settling} excitation periods the DTE still depends by {residual:.3g} of its standard deviation"
                " on when the simulation began",
                experiment,
                wait,
            )
        further = settling + 1 if settling < FEW or experiment.settling_periods_max else 2 * settling
        before, settling = first, min(further, wait.most)
    kept = chain([first], islice(periods, plan.periods - 1))
    return Steady(gather(kept, plan.record_samples), residual, settling)


def _no_steady_state(found: str, experiment: Experiment, wait: Wait) -> BenchError:
    longer = f"set experiment.settling_periods_max above {wait.most}"
    damping = f" (raise one of {wait.damping})" if "," in wait.damping else f" ({wait.damping})" if wait.damping else ""
    return BenchError(
        f"no steady state: {found}, which experiment.settling_tolerance limits to {experiment.settling_tolerance:g};"
        f" {longer} or damp the rig{damping}"
    )
