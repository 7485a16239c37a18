"""Pulses of an encoder track, counted: none may be missing or double, but for the gap of an index."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Array

# Steps on either side whose median is the usual one at a pulse: speed may change over more of them.
AROUND = 8
# A step of more usual ones lacks a pulse; two successive steps of together less have a pulse too many.
LACKS, TWICE = 1.8, 1.25
# Departure of an index from a whole number of usual steps.
WHOLE = 0.3


def pulse_numbers(times: Array, pulses: float, name: str, notes: list[str]) -> Array:
    """Number of each pulse (n,), from 0, at rising `times` [s] of an encoder with places for so many `pulses` a turn.

    A gap that comes once a turn is an index, its missing pulses are counted, and `notes` say so. Raises RecordError
    for times that do not rise, for a pulse that is missing, and for one too many.
    """
    steps = np.diff(times)
    if steps.min() <= 0:
        bad = int(np.argmax(steps <= 0)) + 1
        raise RecordError(
            f"{name}: pulse {bad} at {times[bad]:.9g} s does not come after the one before, at {times[bad - 1]:.9g} s"
            " (times of pulses must rise): if the counter starts again, add its range from there on"
        )
    relative = steps / _usual(steps)
    gaps = np.flatnonzero(relative > LACKS)
    width = _index(relative, gaps, pulses)
    if gaps.size and width is None:
        bad = int(relative.argmax())
        raise RecordError(
            f"{name}: {relative[bad]:.3g} usual steps pass after pulse {bad} (limit {LACKS:g}): pulses are missing"
            f" ({gaps.size} such gap(s)), and it is no index, which is a gap once in {pulses:g} places"
        )
    pairs = relative[1:] + relative[:-1]
    bad = int(pairs.argmin())
    if pairs[bad] < TWICE:
        raise RecordError(
            f"{name}: pulses {bad}, {bad + 1} and {bad + 2} lie within {pairs[bad]:.3g} usual steps (limit {TWICE:g}):"
            " one of them is too many, as of a contact that bounces"
        )
    moves = np.ones(steps.size)
    if width is not None:
        moves[gaps] = width
        notes.append(f"{name} has a gap of {width} steps once a turn: taken for its index")
    return np.concatenate([[0.0], np.cumsum(moves)])


def _usual(steps: Array) -> Array:
    """Median (n,) of the steps around each."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(steps, size=2 * AROUND + 1, mode="mirror"))


def _index(relative: Array, gaps: NDArray[np.int64], pulses: float) -> int | None:
    """Usual steps that the gap of an index takes, or None where the gaps are none: at least two, once a turn."""
    if gaps.size < 2:
        return None
    width = round(float(np.median(relative[gaps])))
    even = bool(np.abs(relative[gaps] - width).max() < WHOLE)
    turn = pulses - width + 1
    ends = gaps[0] < turn and relative.size - gaps[-1] <= turn
    return width if even and ends and bool((np.diff(gaps) == turn).all()) else None
