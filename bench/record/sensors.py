"""What the measuring chain makes of a rig's motions: delays of single channels and white noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.rig import Rig

Array = NDArray[np.float64]
Scalar = TypeVar("Scalar", bound=np.generic)

# Channels in the order of their noise streams, and the field of their noise.
CHANNELS = {
    "torque_driver": "noise_torque",
    "torque_driven": "noise_torque",
    "angle_driver": "noise_angle",
    "angle_driven": "noise_angle",
    "y_driver": "noise_displacement",
    "y_driven": "noise_displacement",
}


@dataclass(frozen=True)
class Signal:
    """A channel: `ramp` per second times time, plus `swing` (realisations, samples) that repeats after it."""

    swing: Array
    ramp: float = 0.0


def delayed(signal: Signal, delay: float, sampling_rate: float) -> Signal:
    """The signal of a sensor that lags by `delay` [s]: its spectrum turned, exact below half the sampling rate."""
    if delay == 0.0:
        return signal
    samples = signal.swing.shape[-1]
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(samples, 1 / sampling_rate) * delay)
    if samples % 2 == 0:
        turn[-1] = turn[-1].real  # what is sampled of the highest line
    swing = np.fft.irfft(np.fft.rfft(signal.swing, axis=-1) * turn, n=samples, axis=-1)
    return Signal(swing - signal.ramp * delay, signal.ramp)


def measured(
    signals: Mapping[str, Signal], rig: Rig, sampling_rate: float, *, seed: int, samples: int, samples_per_period: int
) -> dict[str, Signal]:
    """Signals as the rig's sensors give them, `samples` long: delayed, repeated, then noise of its own for every
    channel, realisation and excitation period."""
    out = {}
    for number, name in enumerate(CHANNELS):
        signal = delayed(signals[name], getattr(rig.sensors, f"delay_{name}"), sampling_rate)
        swing = repeated(signal.swing, samples)
        level = getattr(rig.sensors, CHANNELS[name])
        if level > 0.0:
            swing = swing + level * _noise(seed, number, swing.shape, samples_per_period)
        out[name] = Signal(swing, signal.ramp)
    return out


def repeated(values: NDArray[Scalar], samples: int) -> NDArray[Scalar]:
    """What repeats (..., n) over `samples` samples; the same array where that is its length."""
    length = values.shape[-1]
    return values if length == samples else np.take(values, np.arange(samples) % length, axis=-1)


def _noise(seed: int, channel: int, shape: tuple[int, int], samples_per_period: int) -> Array:
    """Standard white noise (realisations, samples); its streams differ from those of the excitation."""
    out = np.empty(shape)
    for realisation in range(shape[0]):
        for period, start in enumerate(range(0, shape[1], samples_per_period)):
            stream = np.random.SeedSequence(seed, spawn_key=(realisation, channel, period))
            stop = min(start + samples_per_period, shape[1])
            out[realisation, start:stop] = np.random.default_rng(stream).standard_normal(stop - start)
    return out


def check_delays(rig: Rig, repeats: bool, seconds: float) -> None:
    """Refuse delays of channels in a record that does not repeat: nothing tells what came before it."""
    if repeats:
        return
    for name in CHANNELS:
        if getattr(rig.sensors, f"delay_{name}"):
            raise BenchError(
                f"rig.sensors.delay_{name}_us needs a record that repeats: what differs from tooth to tooth does so"
                f" after {seconds:g} s, so periods x samples_per_period / sampling_rate_hz must be at least that"
            )
