"""Spectra of signals and of their derivatives, of records that repeat and of those that do not.

A signal that does not end where it began has a jump in its derivatives by lines. Tapered by a window w that leaves zero
smoothly at both ends it has none, and the derivatives stay exact, as w x' = (w x)' - w' x and
w x'' = (w x)'' - 2 (w' x)' + w'' x. Newton's law holds at every instant, and so it does between tapered terms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Lines over which the window spreads one line and more than rounding is left; those below hold the mean and its course.
SPREAD = 8


def transform(values: Array, rate: float, derivative: int = 0, tapered: bool = False) -> Complexes:
    """DFT (N // 2 + 1,) of values (N,), sampled at `rate` [Hz], or of their first or second derivative in time."""
    omega = 2 * np.pi * np.fft.rfftfreq(values.size, 1 / rate)
    if not tapered:
        return np.asarray((1j * omega) ** derivative * np.fft.rfft(values))
    window = _window(values.size, rate)
    lines = [np.fft.rfft(each * values) for each in window[: derivative + 1]]
    if derivative == 0:
        return np.asarray(lines[0])
    if derivative == 1:
        return np.asarray(1j * omega * lines[0] - lines[1])
    return np.asarray(-(omega**2) * lines[0] - 2j * omega * lines[1] + lines[2])


def _window(samples: int, rate: float) -> tuple[Array, Array, Array]:
    """The square of Hann's window and its first two derivatives in time (samples,), of mean square 1."""
    turn = 2 * np.pi * np.arange(samples) / samples
    speed = 2 * np.pi * rate / samples
    # w = (1 - cos)^2 = 3/2 - 2 cos + cos(2 .) / 2 over its rms
    rms = np.sqrt(1.5**2 + 0.5 * 2.0**2 + 0.5 * 0.5**2)
    value = 1.5 - 2 * np.cos(turn) + 0.5 * np.cos(2 * turn)
    slope = speed * (2 * np.sin(turn) - np.sin(2 * turn))
    bend = speed**2 * (2 * np.cos(turn) - 2 * np.cos(2 * turn))
    return value / rms, slope / rms, bend / rms
