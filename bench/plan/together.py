"""Steady motion of a free inertia, in closed form: where both gears turn freely it must begin right, or they drift."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def under_waves(size: Array, rate: Array, turn: Array) -> tuple[float, float]:
    """Place and speed under accelerations size cos(turn) (n,), whose phases `turn` grow at `rate` [rad/s]."""
    return float(-(size / rate**2) @ np.cos(turn)), float((size / rate) @ np.sin(turn))


def under_signal(acceleration: Array, step: float, at: int) -> tuple[float, float]:
    """Place and speed at entry `at` of an acceleration (n,) that repeats, `step` [s] apart; its mean moves nothing."""
    count = acceleration.size
    lines = np.fft.rfft(acceleration)[1:] / count
    lines[: (count - 1) // 2] *= 2.0  # the highest of an even number has no mirror image
    number = np.arange(1, len(lines) + 1)
    rate = 2 * np.pi * number / (count * step)
    turned = lines * np.exp(2j * np.pi * number * at / count)
    return float(-(turned / rate**2).real.sum()), float((turned / (1j * rate)).real.sum())
