"""Integration over whole periods, in the frequency domain: speeds to angles, accelerations to displacements."""

from __future__ import annotations

import numpy as np

from gearbench.records.formats.source import Array


def integrated(values: Array, rate: float, times: int, lowest: float = 0.0) -> Array:
    """The `times`-fold integral of values (runs, n) that repeat after n samples, without its mean.

    Lines below `lowest` [Hz] are left out, and so is the mean.
    """
    samples = values.shape[1]
    frequency = np.fft.rfftfreq(samples, 1 / rate)
    kept = (frequency > 0) & (frequency >= lowest * (1 - 1e-9))
    operator = np.zeros(frequency.size, dtype=complex)
    operator[kept] = (2j * np.pi * frequency[kept]) ** -float(times)
    return np.fft.irfft(np.fft.rfft(values, axis=1) * operator, n=samples, axis=1)


def lost_share(values: Array, rate: float, lowest: float) -> float:
    """Rms share of values (runs, n), without their mean, that lies below `lowest` [Hz]."""
    frequency = np.fft.rfftfreq(values.shape[1], 1 / rate)
    power = (np.abs(np.fft.rfft(values, axis=1)) ** 2).sum(axis=0)
    power[0] = 0.0
    total = float(power.sum())
    return float(np.sqrt(power[frequency < lowest].sum() / total)) if total > 0 else 0.0
