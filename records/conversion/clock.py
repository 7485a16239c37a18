"""Clocks: when the samples of a column were taken, and how they come onto another clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Array

# Departure from a uniform clock [samples] that is none.
UNIFORM = 1e-3
# Coarsest digits [samples] within which a clock may be seen to be uniform: a missing sample is seen beside them.
COARSEST = 0.5
# Longest gap in a time vector [mean steps] that is bridged.
LONGEST_GAP = 4.0
# Half the width of the interpolation kernel [samples of the slower clock], and its Kaiser shape (100 dB).
HALF_WIDTH, KAISER = 32, 10.0
# What varies by less than this part of a signal's size is rounding.
ROUNDING = 1e-11
# Rounding of a decimal [its last digit] beyond which it tells nothing.
_SEEN = 0.3
_CHUNK = 8192
# So many samples of the way back tell the error.
_TRIED = 20_000


@dataclass(frozen=True, eq=False)
class Clock:
    """Times of a column's samples: uniform (`start` [s], `rate` [Hz]), or one by one in `time` [s]."""

    start: float
    rate: float
    samples: int
    time: Array | None = None

    @property
    def times(self) -> Array:
        """Times (samples,) [s]."""
        return self.time if self.time is not None else self.start + np.arange(self.samples) / self.rate

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1]) if self.time is not None else self.start + (self.samples - 1) / self.rate


def roundest(value: float, tolerance: float) -> float:
    """The number with the fewest digits within a relative tolerance of the value."""
    low, high = value * (1 - tolerance), value * (1 + tolerance)
    for power in range(12, -13, -1):
        step = 10.0**power
        rounded = ceil(low / step) * step if power >= 0 else ceil(low / step) / 10.0**-power
        if low <= rounded <= high:
            return rounded
    return value


def clock_of_times(time: Array, name: str, notes: list[str]) -> Clock:
    """The clock that a column of times [s] tells: uniform where it is so but for its printed digits.

    Raises RecordError for times that are not finite, do not rise, or have a gap beyond LONGEST_GAP.
    """
    if time.size < 2:
        raise RecordError(f"{name} has {time.size} time(s), at least 2 are needed")
    _all_finite(time, name)
    steps = np.diff(time)
    if steps.min() <= 0:
        bad = int(np.argmax(steps <= 0)) + 1
        raise RecordError(
            f"{name} does not rise at sample {bad}: {time[bad]:.9g} s after {time[bad - 1]:.9g} s (a clock must rise)"
        )
    span = float(time[-1] - time[0])
    quantum = _quantum(time)
    # The ends, between which the rate is taken, are rounded too.
    rate = roundest((time.size - 1) / span, max(2 * quantum / span, 1e-12))
    departure = float(np.abs(time - time[0] - np.arange(time.size) / rate).max())
    if departure * rate <= UNIFORM or departure <= 1.01 * quantum < COARSEST / rate:
        if departure * rate > UNIFORM:
            notes.append(f"{name} is uniform within its digits ({quantum:.3g} s): taken as {rate:.9g} Hz")
        return Clock(float(time[0]), rate, time.size)
    usual = float(np.median(steps))
    longest = int(steps.argmax())
    if steps[longest] > LONGEST_GAP * (1 + UNIFORM) * usual:
        raise RecordError(
            f"{name} has a gap of {steps[longest]:.4g} s after sample {longest}, {steps[longest] / usual:.3g} usual"
            f" steps of {usual:.4g} s (limit {LONGEST_GAP:g}): convert what lies before or after it"
        )
    missing = int(np.round(steps / usual - 1).clip(0).sum())
    notes.append(
        f"{name} is not uniform: steps of {steps.min():.4g} to {steps.max():.4g} s"
        + (f", about {missing} sample(s) missing" if missing else "")
    )
    return Clock(float(time[0]), roundest(1 / usual, 1e-3), time.size, np.asarray(time, dtype=np.float64))


def resampled(
    values: Array,
    clock: Clock,
    start: float,
    rate: float,
    samples: int,
    *,
    slope: float = 0.0,
    period: float | None = None,
    progress: Callable[[float], None] = lambda part: None,
) -> tuple[Array, float | None]:
    """Values (runs, n) of one clock at the times of another; and the relative rms error of that, or None for a copy.

    Uniform clocks: convolution with a Kaiser-windowed sinc that ends at the lower Nyquist frequency; the error is
    that of the way there and back. Single times: quintic splines; the error is their distance from cubic ones. `slope`
    per second is taken off before and put back (angles). Beyond its ends a signal goes on with `period` [s], where that
    is a whole number of samples, else mirrored.
    """
    if clock.time is not None:
        return _splined(values, clock, start + np.arange(samples) / rate)
    first = (start - clock.start) * clock.rate
    whole = round(first)
    same = abs(clock.rate / rate - 1) * samples < UNIFORM and abs(first - whole) < UNIFORM
    if same and whole >= 0 and whole + samples <= values.shape[1]:
        return values[:, whole : whole + samples].copy(), None
    swing = values - slope * np.arange(values.shape[1]) / clock.rate
    repeat = _whole_samples(period, clock.rate, values.shape[1])
    positions = first + np.arange(samples, dtype=np.float64) * (clock.rate / rate)
    cut = min(1.0, rate / clock.rate)
    out = _convolved(swing, positions, cut, repeat, progress)
    # There and back: positions of the old samples on the new clock.
    inside = np.arange(max(0, ceil(first)), min(values.shape[1], int(first + samples * clock.rate / rate)))
    edge = max(len(inside) // 20, (len(inside) - _TRIED) // 2)
    middle = inside[edge : len(inside) - edge]
    at = (middle - first) * rate / clock.rate
    back = _convolved(out, at, min(1.0, clock.rate / rate), None, lambda part: None)
    size = float(swing[:, middle].std())
    there = size > ROUNDING * float(np.abs(values).max())
    error = float(np.sqrt(np.mean((back - swing[:, middle]) ** 2))) / size if there else 0.0
    return out + slope * positions / clock.rate, error


def spline_at(times: Array, values: Array, wanted: Array) -> tuple[Array, float]:
    """Quintic spline through values (runs, n) at single times, and the relative rms distance of the cubic one."""
    from scipy.interpolate import make_interp_spline

    # A clock near 0 and 1 keeps the equations well scaled.
    origin, scale = times[0], (times.size - 1) / (times[-1] - times[0])
    at, to = (times - origin) * scale, (wanted - origin) * scale
    fine, coarse = (make_interp_spline(at, values, k=order, axis=1)(to) for order in (5, 3))
    trend = np.polynomial.Polynomial.fit(to, fine.mean(axis=0), 1)(to)
    size = float((fine - trend).std())
    return fine, float(np.sqrt(np.mean((fine - coarse) ** 2))) / size if size > 0 else 0.0


def _splined(values: Array, clock: Clock, wanted: Array) -> tuple[Array, float]:
    assert clock.time is not None
    if clock.samples < 6:
        raise RecordError(f"{clock.samples} samples at uneven times cannot be interpolated (at least 6)")
    return spline_at(clock.time, values, wanted)


def _convolved(
    values: Array, positions: Array, cut: float, repeat: int | None, progress: Callable[[float], None]
) -> Array:
    """Values (runs, n) between their samples, at positions in samples; `cut`: pass band over the Nyquist frequency."""
    from scipy.special import i0

    half = ceil(HALF_WIDTH / cut)
    taps = np.arange(-half + 1, half + 1)
    out = np.empty((values.shape[0], positions.size))
    for begin in range(0, positions.size, _CHUNK):
        part = positions[begin : begin + _CHUNK]
        base = np.floor(part).astype(np.int64)
        distance = (part - base)[:, np.newaxis] - taps
        window = i0(KAISER * np.sqrt(np.clip(1 - (distance / half) ** 2, 0.0, None)))
        weights = np.sinc(cut * distance) * window
        weights /= weights.sum(axis=1, keepdims=True)
        index = base[:, np.newaxis] + taps
        out[:, begin : begin + part.size] = np.einsum("rkt,kt->rk", _extended(values, index, repeat), weights)
        progress((begin + part.size) / positions.size)
    return out


def _extended(values: Array, index: NDArray[np.int64], repeat: int | None) -> Array:
    """Values at sample numbers that may lie beyond either end: repeated, or mirrored about the end samples."""
    last = values.shape[1] - 1
    if repeat is not None:
        inside = np.where(index < 0, index % repeat, index)
        inside = np.where(inside > last, last + 1 - repeat + (inside - last - 1) % repeat, inside)
        return values[:, inside]
    mirrored = np.clip(np.where(index < 0, -index, np.where(index > last, 2 * last - index, index)), 0, last)
    found = values[:, mirrored]
    found = np.where(index < 0, 2 * values[:, :1, np.newaxis] - found, found)
    return np.where(index > last, 2 * values[:, -1:, np.newaxis] - found, found)


def _whole_samples(period: float | None, rate: float, samples: int) -> int | None:
    if period is None:
        return None
    count = round(period * rate)
    return count if 0 < count <= samples and abs(period * rate - count) < UNIFORM else None


def _quantum(time: Array) -> float:
    """What times (n,) [s] are rounded to at most: by single or double precision, by printed decimals or digits."""
    largest = float(np.abs(time).max())
    double = float(np.spacing(largest))
    steps = [0.0]
    for scale in (1.0, 1e3, 1e6):  # of s, ms, us
        scaled = time * scale
        single = scaled.astype(np.float32)
        if np.isfinite(single).all() and (np.abs(single - scaled) <= 4 * np.spacing(np.abs(scaled))).all():
            steps.append(float(np.spacing(np.abs(single).max())) / scale)
    elapsed = time - time[0]
    for digits in range(10):
        # Beside the epoch of a computer's clock double precision is no exact decimal.
        tolerance = 1e-4 + 10.0**digits * double
        if tolerance > _SEEN:
            break
        scaled = elapsed * 10.0**digits
        if np.abs(scaled - np.round(scaled)).max() < tolerance:
            steps.append(10.0**-digits)
            break
    usual = float(np.median(np.diff(time)))
    return max(step for step in (*steps, *_significant(time, usual)) if step < usual) + double


def _significant(time: Array, step: float) -> list[float]:
    """The last digit of the largest of times, if all are printed with so many significant ones, 4 to 9, that it is less
    than a `step`."""
    known = np.abs(time[time != 0.0])
    power = np.floor(np.log10(known) + 1e-12)
    found = []
    for digits in range(4, 10):
        last = 10.0 ** (power - digits + 1)
        if last.max() < step and np.abs(known / last - np.round(known / last)).max() < 1e-4:
            found.append(float(last.max()))
    return found[:1]


def _all_finite(values: Array, name: str) -> None:
    if not np.isfinite(values).all():
        bad = np.flatnonzero(~np.isfinite(values))
        raise RecordError(f"{name} has {bad.size} value(s) that are not finite, first at sample {bad[0]}")
