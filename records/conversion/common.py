"""The clock that all channels of a record share: its rate, its start, its whole excitation periods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor

import numpy as np

from gearbench.records.conversion.clock import UNIFORM, Clock, roundest
from gearbench.records.conversion.signals import Signal, replace_start
from gearbench.records.errors import RecordError

# What a delayed channel lacks at an end may be taken from one excitation period further up to this part of a period.
BORROWED = 0.1

# A record sampled so much finer or coarser than its fastest channel has another unit of time.
FINER = 100.0


@dataclass(frozen=True)
class Common:
    """The clock of the record: start [s], rate [Hz], samples of a period, periods."""

    start: float
    rate: float
    samples: int
    periods: int

    @property
    def total(self) -> int:
        """Samples of the record."""
        return self.samples * self.periods

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return self.total / self.rate


def common_clock(signals: Sequence[Signal], attributes: Mapping[str, float | str], notes: list[str]) -> Common:
    """The clock on which all channels have the most whole periods, on the samples of those that share its rate.

    Its rate is the declared one, else the highest of a uniform channel. Raises RecordError where the channels do not
    share the periods that are asked for, or not one.
    """
    rate, samples = _rate(signals, attributes, notes)
    clocks = [signal.clock for signal in signals]
    fastest = max(clock.rate for clock in clocks)
    if not 1 / FINER < fastest / rate < FINER:
        unit = "ms" if fastest < rate else "s"
        raise RecordError(
            f"the fastest channel has {fastest:.6g} Hz, where sampling_rate_hz = {rate:.6g} is declared (limit a factor"
            f" {FINER:g}): is the time in {unit}, or the rate of another measurement?"
        )
    reference = _reference(clocks, rate)
    skipped = float(attributes.get("start", 0.0))
    begin, end = max(clock.start for clock in clocks), min(clock.end for clock in clocks)
    begin, held = _span(begin + skipped, end, rate, reference)
    asked = attributes.get("periods")
    if reference is not None and (asked is None or held < int(asked) * samples):
        first, more = _span(reference.start + skipped, reference.end, rate, reference)
        whole = more // samples > held // samples
        if whole and all(_repeats(clock, first, more, rate, samples / rate) for clock in clocks):
            notes.append("channels that begin later or end earlier go on with the excitation period")
            begin, held = first, more
    wanted = int(asked) if asked is not None else max(held // samples, 1)
    if held < wanted * samples:
        raise RecordError(
            f"the channels share {held} samples at {rate:.9g} Hz, less than the {wanted} x {samples} that {wanted}"
            f" excitation period(s) of {samples / rate:.6g} s need: {_ends_in_words(signals)}"
        )
    left = held - wanted * samples
    if left:
        notes.append(
            f"the last {left} samples ({left / rate:.4g} s) are left out: {wanted} whole excitation period(s) remain"
        )
    return Common(begin, rate, samples, wanted)


def _ends_in_words(signals: Sequence[Signal]) -> str:
    """Which channel begins last and which ends first."""
    late, short = max(signals, key=lambda one: one.clock.start), min(signals, key=lambda one: one.clock.end)
    return f"{late.name} begins at {late.clock.start:.6g} s, {short.name} ends at {short.clock.end:.6g} s"


def _rate(signals: Sequence[Signal], attributes: Mapping[str, float | str], notes: list[str]) -> tuple[float, int]:
    """Sampling rate [Hz] and samples of an excitation period, which are whole."""
    uniform = [signal.clock.rate for signal in signals if signal.clock.time is None]
    rate = float(attributes.get("sampling_rate", max(uniform or [signal.clock.rate for signal in signals])))
    if "samples_per_period" in attributes:
        # Samples of which clock? Where there are several, only a declared rate tells.
        one_clock = bool(uniform) and max(uniform) - min(uniform) <= 1e-9 * rate
        if "sampling_rate" not in attributes and not one_clock:
            _refuse_uneven([signal.clock for signal in signals])
            given = ", ".join(f"{name} {clock}" for name, clock in _clocks_in_words(signals))
            raise RecordError(
                f"the channels have different clocks ({given}): say sampling_rate_hz beside samples_per_period, or"
                " excitation_period_s in its place"
            )
        return rate, int(attributes["samples_per_period"])
    period = float(attributes["excitation_period"])
    samples = round(period * rate)
    if samples < 1:
        raise RecordError(f"excitation_period_s = {period:g} is shorter than a sample of {1 / rate:.4g} s")
    exact = roundest(samples / period, 1e-12)
    if abs(exact / rate - 1) * samples < 1e-6:
        return rate, samples
    notes.append(f"the clock is {exact:.9g} Hz, so that an excitation period has {samples} samples")
    return exact, samples


def _refuse_uneven(clocks: Sequence[Clock]) -> None:
    """Raise RecordError where all clocks are the same single times: then these are what is wrong."""
    time = clocks[0].time
    if time is None:
        return
    for other in clocks[1:]:
        if other.time is None or other.samples != time.size or np.ptp(other.time - time) * other.rate > UNIFORM:
            return
    rate = (time.size - 1) / (time[-1] - time[0])
    departure = np.abs((time - time[0]) * rate - np.arange(time.size))
    worst = int(departure.argmax())
    raise RecordError(
        f"the times are not uniform: sample {worst} departs by {departure[worst] / rate:.4g} s, {departure[worst]:.3g}"
        f" samples, from an even clock of {rate:.6g} Hz (limit {UNIFORM:g}): say sampling_rate_hz beside"
        " samples_per_period, or excitation_period_s in its place"
    )


def from_a_near_origin(signals: Sequence[Signal], notes: list[str]) -> list[Signal]:
    """The signals on clocks that begin near 0, where times are so large that their digits no longer tell samples."""
    first = min(signal.clock.start for signal in signals)
    if max(float(np.spacing(abs(first))) * signal.clock.rate for signal in signals) < UNIFORM / 10:
        return list(signals)
    notes.append(f"times are counted from the first one, {first:.6f} s")
    return [replace(signal, clock=replace_start(signal.clock, -first)) for signal in signals]


def _clocks_in_words(signals: Sequence[Signal]) -> list[tuple[str, str]]:
    return [(one.name, f"{one.clock.rate:.9g} Hz" if one.clock.time is None else "single times") for one in signals]


def _reference(clocks: Sequence[Clock], rate: float) -> Clock | None:
    """The clock of that rate which most channels share."""
    fitting = [clock for clock in clocks if clock.time is None and abs(clock.rate / rate - 1) < 1e-9]
    return max(fitting, key=lambda one: sum(abs(other.start - one.start) < 1e-12 for other in fitting), default=None)


def _span(begin: float, end: float, rate: float, reference: Clock | None) -> tuple[float, int]:
    """First time on the samples of the reference, and samples from there to the end."""
    if reference is not None:
        begin = reference.start + ceil((begin - reference.start) * rate - UNIFORM) / rate
    return begin, max(0, floor((end - begin) * rate + UNIFORM) + 1)


def _repeats(clock: Clock, begin: float, samples: int, rate: float, period: float) -> bool:
    """Whether a channel covers a span, or lacks little and holds a whole period to take that from."""
    lacking = max(clock.start - begin, begin + (samples - 1) / rate - clock.end)
    if lacking * rate <= UNIFORM:
        return True
    count = period * clock.rate
    whole = clock.time is None and abs(count - round(count)) < UNIFORM and clock.samples >= round(count)
    return whole and lacking <= BORROWED * period
