"""What the measuring chain makes of a rig's motions, channel by channel: delay, anti-alias filter, gain, white noise
and quantisation. Encoder run-out, which needs to know the rotation, comes before them (`encoder_error`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.records.antialias import about_filter, butterworth, butterworth_delay
from gearbench.rig import Rig, Sensors

Array = NDArray[np.float64]
Scalar = TypeVar("Scalar", bound=np.generic)

# Channels in the order of their noise streams, and the kind of their noise and quantisation.
CHANNELS = {
    "torque_driver": "torque",
    "torque_driven": "torque",
    "angle_driver": "angle",
    "angle_driven": "angle",
    "y_driver": "displacement",
    "y_driven": "displacement",
    "x_driver": "displacement",
    "x_driven": "displacement",
}

FILTER_ORDER = 8
LEFT = 0.05


@dataclass(frozen=True)
class Signal:
    """A channel: `ramp` per second times time, plus `swing` (realisations, samples) that repeats after it."""

    swing: Array
    ramp: float = 0.0


def delayed(signal: Signal, delay: float, sampling_rate: float) -> Signal:
    """The signal of a sensor that lags by `delay` [s]: its spectrum turned, exact below half the sampling rate."""
    if delay == 0.0:
        return signal
    frequency = np.fft.rfftfreq(signal.swing.shape[-1], 1 / sampling_rate)
    return Signal(answered(signal.swing, np.exp(-2j * np.pi * frequency * delay)) - signal.ramp * delay, signal.ramp)


def filtered(signal: Signal, corner: float | None, sampling_rate: float) -> Signal:
    """The signal behind the anti-alias filter: its steady state, so that no sample is ahead of its cause, and a ramp
    lags by the filter's delay. What was folded in sampling stays."""
    if corner is None:
        return signal
    frequency = np.fft.rfftfreq(signal.swing.shape[-1], 1 / sampling_rate)
    swing = answered(signal.swing, filter_response(frequency, corner))
    return Signal(swing - signal.ramp * filter_delay(corner), signal.ramp)


def answered(swing: Array, response: NDArray[np.complex128]) -> Array:
    """What repeats (..., n), its spectrum times the response (n // 2 + 1,)."""
    samples = swing.shape[-1]
    response = response.copy()
    if samples % 2 == 0:
        response[-1] = response[-1].real  # what is sampled of the highest line
    return np.asarray(np.fft.irfft(np.fft.rfft(swing, axis=-1) * response, n=samples, axis=-1))


def filter_response(frequency: NDArray[np.floating[Any]], corner: float) -> NDArray[np.complex128]:
    """Response (n,) of the anti-alias filter at frequencies (n,) [Hz], its corner in Hz."""
    return butterworth(frequency, corner, FILTER_ORDER)


def filter_delay(corner: float) -> float:
    """Delay [s] of the anti-alias filter far below its corner [Hz]."""
    return butterworth_delay(corner, FILTER_ORDER)


def lag(sensors: Sensors, channel: str) -> float:
    """By how much [s] a channel shows a steady motion late: its delay and that of the anti-alias filter."""
    delay = float(getattr(sensors, f"delay_{channel}"))
    return delay + (filter_delay(sensors.filter) if sensors.filter is not None else 0.0)


def imposed(recorded: Array, sensors: Sensors, sampling_rate: float) -> Array:
    """The driver torque (..., n) on the rig, which repeats, from what its sensor recorded: gain, delay and filter taken
    back. Where the filter leaves less than LEFT of a line, the line stays as it is."""
    gain = sensors.gain_torque_driver
    torque = recorded / gain if gain != 1.0 else recorded
    return taken_back(torque, sensors, sensors.delay_torque_driver, sampling_rate)


def shown_by(sensors: Sensors, channel: str, frequency: Array) -> NDArray[np.complex128]:
    """What a channel's sensor multiplies changes of frequencies (n,) [Hz] by: late, behind the filter, by its gain."""
    gain, delay = getattr(sensors, f"gain_{channel}", 1.0), getattr(sensors, f"delay_{channel}")
    response = gain * np.exp(-2j * np.pi * frequency * delay)
    return response if sensors.filter is None else response * filter_response(frequency, sensors.filter)


def taken_back(recorded: Array, sensors: Sensors, delay: float, sampling_rate: float) -> Array:
    """What a sensor with this delay [s] saw (..., n), which repeats, from what it recorded: delay and filter taken
    back. Where the filter leaves less than LEFT of a line, the line stays as it is."""
    seen = delayed(Signal(recorded), -delay, sampling_rate).swing
    if sensors.filter is None:
        return seen
    response = filter_response(np.fft.rfftfreq(seen.shape[-1], 1 / sampling_rate), sensors.filter)
    response[np.abs(response) < LEFT] = 1.0
    return answered(seen, np.reciprocal(response))


def encoder_error(sensors: Sensors, gear: str, rotation: Array) -> Array:
    """Error (n,) [rad] of the encoder of "driver" or "driven" at rotations (n,) [rad] of that gear."""
    size = getattr(sensors, f"encoder_runout_{gear}")
    return np.asarray(size * np.cos(rotation - getattr(sensors, f"encoder_runout_{gear}_phase")))


def measured(
    signals: Mapping[str, Signal],
    rig: Rig,
    sampling_rate: float,
    *,
    seed: int,
    samples: int,
    samples_per_period: int,
    block: int = 0,
    start: float = 0.0,
    at: int = 0,
    noise: Noise | None = None,
) -> dict[str, Signal]:
    """Signals as the rig's sensors give them, `samples` long: delayed, filtered, repeated, with their gain, then noise
    of its own for every channel, realisation and excitation period, then in steps.

    block: samples after which swings repeat (0: their length). start [s]: time of the record's first sample, since
    ramps began. A stretch of a record begins at its sample `at`, with `noise` that goes on from one to the next; delays
    and filters need the whole.
    """
    sensors, out = rig.sensors, {}
    noise = noise or Noise(seed, samples_per_period)
    time = start + np.arange(at, at + samples) / sampling_rate
    for number, (name, kind) in enumerate(CHANNELS.items()):
        if name not in signals:
            continue
        delay = getattr(sensors, f"delay_{name}", 0.0)
        late = _periodically(partial(delayed, delay=delay, sampling_rate=sampling_rate), signals[name], block)
        signal = _periodically(partial(filtered, corner=sensors.filter, sampling_rate=sampling_rate), late, block)
        swing, ramp = repeated(signal.swing, samples), signal.ramp
        gain = getattr(sensors, f"gain_{name}", 1.0)
        if gain != 1.0:
            swing = gain * swing
        level, step = getattr(sensors, f"noise_{kind}"), getattr(sensors, f"quantisation_{kind}")
        if level > 0.0:
            swing = swing + level * noise.take(number, swing.shape, at)
        if step > 0.0:
            swing = step * np.round((swing + ramp * time) / step) - ramp * time
        out[name] = Signal(swing, ramp)
    return out


def _periodically(change: Callable[[Signal], Signal], signal: Signal, block: int) -> Signal:
    """A change of what repeats after `block` samples, in a signal that need not hold whole blocks: what is left over is
    taken from as many blocks at its end."""
    samples = signal.swing.shape[-1]
    whole = samples // block * block if block else samples
    rest = samples - whole if whole else 0
    if not rest:
        return change(signal)
    first, last = (change(Signal(part, signal.ramp)) for part in (signal.swing[..., :whole], signal.swing[..., rest:]))
    return Signal(np.concatenate([first.swing, last.swing[..., -rest:]], axis=-1), signal.ramp)


def repeated(values: NDArray[Scalar], samples: int) -> NDArray[Scalar]:
    """What repeats (..., n) over `samples` samples; the same array where that is its length."""
    length = values.shape[-1]
    return values if length == samples else np.take(values, np.arange(samples) % length, axis=-1)


def resampled(period: Array, points: int) -> Array:
    """The trigonometric sums through the samples (..., n) of one period, at `points` instants, no fewer."""
    samples = period.shape[-1]
    spectrum = np.fft.rfft(period, axis=-1)
    if samples % 2 == 0 and points > samples:
        spectrum[..., -1] *= 0.5  # the highest line and its mirror image share it
    return np.asarray(np.fft.irfft(spectrum, points, axis=-1) * (points / samples))


class Noise:
    """Standard white noise, a stream of its own for every channel, realisation and excitation period; they differ from
    those of the excitation. The first row is that of `realisation`.

    Mutable: streams stay where a stretch has ended, so that the next one need not draw it again.
    """

    def __init__(self, seed: int, samples_per_period: int, realisation: int = 0) -> None:
        self._seed, self._length, self._first = seed, samples_per_period, realisation
        self._streams: dict[tuple[int, int], tuple[int, np.random.Generator]] = {}

    def take(self, channel: int, shape: tuple[int, int], at: int = 0) -> Array:
        """Noise (realisations, samples) of a channel from sample `at` on."""
        out = np.empty(shape)
        for row, values in enumerate(out):
            done = 0
            while done < len(values):
                count = min(self._length - (at + done) % self._length, len(values) - done)
                stream = self._stream(self._first + row, channel, at + done)
                values[done : done + count] = stream.standard_normal(count)
                done += count
                self._streams[self._first + row, channel] = at + done, stream
        return out

    def _stream(self, realisation: int, channel: int, at: int) -> np.random.Generator:
        """The stream of the period of sample `at`, at that sample."""
        period, inside = divmod(at, self._length)
        there, stream = self._streams.get((realisation, channel), (-1, None))
        if inside and stream is not None and there == at:
            return stream
        stream = np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(realisation, channel, period)))
        stream.standard_normal(inside)
        return stream


def sensor_attributes(rig: Rig, names: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Attributes of the named channels that a data sheet of the measuring chain would state."""
    corner = rig.sensors.filter
    if corner is None:
        return {}
    return {name: about_filter(corner, FILTER_ORDER) for name in names if name in CHANNELS}


def needs_whole(rig: Rig) -> bool:
    """Whether a sensor's sample depends on all of the record: one that lags, or is filtered."""
    delays = any(getattr(rig.sensors, f"delay_{name}", 0.0) for name in CHANNELS)
    return delays or rig.sensors.filter is not None


def check_delays(rig: Rig, repeats: bool, seconds: float, changes: bool = False) -> None:
    """Refuse delays and filters of channels in a record that does not repeat, also because its speed `changes`: nothing
    tells what came before it."""
    if repeats:
        return
    keys = [f"delay_{name}" for name in CHANNELS if getattr(rig.sensors, f"delay_{name}", 0.0)]
    found = [f"{key}_us" for key in keys] + (["filter_hz"] if rig.sensors.filter is not None else [])
    if found and changes:
        raise BenchError(
            f"rig.sensors.{found[0]} needs a record that repeats, but the speed changes (experiment.speed_end_rpm or"
            " speed_table)"
        )
    if found:
        raise BenchError(
            f"rig.sensors.{found[0]} needs a record that repeats: what differs from tooth to tooth does so"
            f" after {seconds:g} s, so periods x samples_per_period / sampling_rate_hz must be at least that"
        )
