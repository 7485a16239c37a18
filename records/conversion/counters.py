"""Counters that start again: where they do so is seen in their steps, and taken back where their range is known."""

from __future__ import annotations

import numpy as np

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Array

# Ranges of counters in bits; counts of a pulse: with an index a counter starts again after a turn of them.
BITS, A_PULSE = (16, 32), (1, 2, 4)
# Usual is how far this part of the steps is from their median: fewer than the rest are jumps.
QUANTILE = 0.9
# Of a range, a jump departs by no more than so many usual departures, and so many counts.
AGREES, ROUNDING = 3.0, 2.0
# Without a known range, a step so many times as far off as usual, or by half of all counts, is a jump: at least LEAST.
STANDS_OUT, LEAST = 20.0, 8.0


def counted_on(counts: Array, pulses: float, name: str, notes: list[str]) -> Array:
    """Counts (runs, n) of an encoder with so many `pulses` a turn, without the jumps of a counter that starts again.

    Raises RecordError where counts jump by what is neither the range of 16 or 32 bits nor a turn.
    """
    if counts.shape[1] < 2:
        return counts
    steps = np.diff(counts, axis=1)
    off = steps - np.median(steps, axis=1, keepdims=True)
    usual = float(np.quantile(np.abs(off), QUANTILE))
    tolerance = AGREES * usual + ROUNDING
    for size in sorted([*(2.0**bits for bits in BITS), *(times * pulses for times in A_PULSE)]):
        jumps = np.abs(off) > size / 2
        # All that goes so far must go the whole range, and what is usual must be far from that.
        if tolerance < size / 4 and jumps.any() and (np.abs(np.abs(off[jumps]) - size) <= tolerance).all():
            notes.append(
                f"{name} starts again {np.count_nonzero(jumps)} time(s): its range of {size:.0f} counts is added"
            )
            back = np.cumsum(np.where(jumps, -size * np.sign(off), 0.0), axis=1)
            return counts + np.concatenate([np.zeros((len(counts), 1)), back], axis=1)
    jumps = np.abs(off) > max(min(STANDS_OUT * usual, float(np.ptp(counts)) / 2), LEAST)
    if jumps.any():
        run, sample = np.argwhere(jumps)[0]
        raise RecordError(
            f"{name} jumps by {steps[run, sample]:.6g} counts after sample {sample} (run {run}), and"
            f" {np.count_nonzero(jumps)} time(s) in all (limit 2^16, 2^32 or a turn of {pulses:g} pulses within"
            f" {tolerance:.3g} counts): if the counter starts again, add its range from there on"
        )
    return counts
