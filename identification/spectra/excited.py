"""Which lines a force excites, and which hold nothing but the noise of its sensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.spectra.joint import Floats

# A line counts as excited if its force exceeds this part of the strongest line's (rms over realisations),
EXCITED = 1e-3
# and if its power exceeds that of noise by this factor: one of 10^8 lines of Gaussian noise does.
ABOVE_NOISE = 20.0
# Lines over which the noise that periods tell is averaged: a single one is uncertain by all of itself.
AVERAGED = 101
# Without periods the upper third of the spectrum tells the noise, if it lies this far below the strongest line [power].
BELOW = 1e-2


def excited_lines(power: Floats, noise: Floats | None = None, least: float = EXCITED) -> NDArray[np.bool_]:
    """Which of the lines (K+1,) from 0 to half of the sampling rate a force of that mean power excites; never line 0.

    `noise` (K+1,): variance of a line from the scatter of periods. Without it the noise is the median power of the
    upper third of the lines, as far as that is BELOW the strongest one: a force that is excited up to there has none to
    be told. Where no line is above the noise, the strongest line alone is the measure (`least`: of amplitudes).
    """
    strongest = float(power[1:].max(initial=0.0))
    above = power > least**2 * strongest
    above[0] = False
    clear = above & (power > ABOVE_NOISE * (_median_above(power, strongest) if noise is None else _smooth(noise)))
    return clear if clear.any() else above


def _median_above(power: Floats, strongest: float) -> float:
    level = float(np.median(power[2 * power.size // 3 :])) / np.log(2.0)  # mean of an exponential law from its median
    return level if level < BELOW * strongest else 0.0


def _smooth(noise: Floats) -> Floats:
    """Moving mean of the noise, shorter at both ends."""
    width = min(AVERAGED, noise.size)
    total = np.convolve(noise, np.ones(width), mode="same")
    return np.asarray(total / np.convolve(np.ones(noise.size), np.ones(width), mode="same"))
