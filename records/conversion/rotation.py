"""Angles from what encoders give: wrapped angles, counts, pulse times, tracks of a quadrature encoder."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.records.conversion.pulses import pulse_numbers
from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Array

# Steps of a quadrature encoder from state to state (2 A + B): forward with A leading B.
_FORWARD = {(0, 2): 1, (2, 3): 1, (3, 1): 1, (1, 0): 1}
# A logic level changes when the signal has crossed this part of its range around the middle.
_HYSTERESIS = 0.2


def unwrapped(angle: Array, name: str, notes: list[str]) -> Array:
    """Angle (runs, n) [rad] without the jumps of a sensor that starts again after a turn.

    Raises RecordError where an angle jumps by more than half a turn and is not such a sensor's.
    """
    steps = np.diff(angle, axis=1)
    usual = np.median(steps, axis=1, keepdims=True)
    jumps = np.abs(steps - usual) > pi
    if not jumps.any():
        return angle
    run, sample = np.argwhere(jumps)[0]
    inside = np.ptp(angle) <= 2 * pi * (1 + 1e-6)
    whole = np.abs(np.abs(steps[jumps] - np.broadcast_to(usual, steps.shape)[jumps]) / (2 * pi) - 1) < 0.1
    if not inside or not whole.all():
        raise RecordError(
            f"{name} jumps by {steps[run, sample]:.4g} rad after sample {sample} (run {run}), usual steps are"
            f" {usual[run, 0]:.3g} rad (limit pi)"
        )
    notes.append(f"{name} starts again after every turn: unwrapped")
    return np.unwrap(angle, axis=1)


def pulse_angle(times: Array, pulses: float, name: str, notes: list[str]) -> tuple[Array, Array]:
    """Times [s] and angles [rad] of the pulses of an encoder with that many a turn, NaN at the end ignored.

    Raises RecordError for times that do not rise, for fewer than 6 pulses, and for a pulse missing or too many.
    """
    finite = np.isfinite(times)
    known = times[finite]
    if not finite[: known.size].all():
        raise RecordError(
            f"{name} has pulse times that are not finite between others, first at pulse {int(np.argmin(finite))}"
        )
    if known.size < 6:
        raise RecordError(f"{name} has {known.size} pulses, at least 6 are needed")
    return known, pulse_numbers(known, pulses, name, notes) * (2 * pi / pulses)


def rising_edges(level: Array, clock_times: Array, name: str) -> Array:
    """Times [s] at which a sampled signal (n,) rises through the middle of its range, between samples linearly."""
    high = logic(level, name)
    crossing = np.flatnonzero(np.diff(high.astype(np.int8)) == 1) + 1
    middle = 0.5 * (level.max() + level.min())
    found = np.empty(crossing.size)
    for number, sample in enumerate(crossing):
        while level[sample - 1] > middle:
            sample -= 1  # hysteresis sees the edge late
        part = (middle - level[sample - 1]) / (level[sample] - level[sample - 1])
        found[number] = clock_times[sample - 1] + part * (clock_times[sample] - clock_times[sample - 1])
    return found


def quadrature_counts(a: Array, b: Array, name: str) -> Array:
    """Counts (n,), four a pulse, of two sampled tracks; rising where A leads B.

    Raises RecordError where both tracks change between two samples: then the direction is lost.
    """
    state = 2 * logic(a, f"{name}, track A").astype(int) + logic(b, f"{name}, track B").astype(int)
    steps = np.zeros(state.size)
    changed = np.flatnonzero(np.diff(state)) + 1
    for sample in changed:
        pair = (int(state[sample - 1]), int(state[sample]))
        step = _FORWARD.get(pair, -1 if pair[::-1] in _FORWARD else 0)
        if step == 0:
            raise RecordError(
                f"{name}: both tracks change at sample {sample}, so the direction is lost: they are sampled too slowly"
            )
        steps[sample] = step
    return np.cumsum(steps)


def logic(level: Array, name: str) -> NDArray[np.bool_]:
    """Logic level of a sampled signal (n,), with hysteresis about the middle of its range."""
    low, high = float(level.min()), float(level.max())
    if not high > low:
        raise RecordError(f"{name} is constant ({low:g}): there are no pulses")
    middle, band = 0.5 * (low + high), 0.5 * _HYSTERESIS * (high - low)
    sure = np.where(level > middle + band, 1, np.where(level < middle - band, 0, -1))
    sure[0] = int(level[0] > middle)
    last = np.maximum.accumulate(np.where(sure >= 0, np.arange(level.size), 0))
    return sure[last].astype(bool)
