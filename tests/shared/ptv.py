"""Periodically time-varying systems whose transfer functions are known in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearbench.identification.spectra.joint import Spectra


@dataclass(frozen=True)
class PeriodicFilter:
    """y[n] = sum_m h_m(n) u[n - m], taps h (taps, M) periodic with M samples; ITF G = sum_m h_m exp(-j w m)."""

    taps: np.ndarray

    @property
    def period(self) -> int:
        return self.taps.shape[1]

    def response(self, force: np.ndarray, start: int = 0) -> np.ndarray:
        """Steady-state output (E, N) to periodic inputs (E, N); sample 0 has phase start / M."""
        index = (np.arange(force.shape[1]) + start) % self.period
        return sum(tap[index] * np.roll(force, m, axis=1) for m, tap in enumerate(self.taps))

    def from_rest(self, force: np.ndarray) -> np.ndarray:
        """Output (E, N) when the input was 0 before the record."""
        index = np.arange(force.shape[1]) % self.period
        delayed = [np.pad(force, ((0, 0), (m, 0)))[:, : force.shape[1]] for m in range(len(self.taps))]
        return sum(tap[index] * u for tap, u in zip(self.taps, delayed, strict=True))

    def itf(self, frequency: np.ndarray) -> np.ndarray:
        """G (frequency, M) at frequencies in cycles per sample."""
        turn = np.exp(-2j * np.pi * np.outer(frequency, np.arange(len(self.taps))))
        return turn @ self.taps

    def htf(self, frequency: np.ndarray, harmonics: int) -> np.ndarray:
        """G_l (2L+1, frequency)."""
        order = np.arange(-harmonics, harmonics + 1)
        turn = np.exp(-2j * np.pi * np.outer(order, np.arange(self.period)) / self.period)
        return turn @ self.itf(frequency).T / self.period


def periodic_filter(harmonics: int, period: int, taps: int = 3, seed: int = 0) -> PeriodicFilter:
    """Random filter with exactly the harmonics -L..L."""
    rng = np.random.default_rng(seed)
    phase = np.arange(period) / period
    rows = []
    for _ in range(taps):
        row = np.full(period, rng.standard_normal())
        for order in range(1, harmonics + 1):
            a, b = rng.standard_normal(2) / (1 + order)
            row += a * np.cos(2 * np.pi * order * phase) + b * np.sin(2 * np.pi * order * phase)
        rows.append(row)
    return PeriodicFilter(np.array(rows))


def spectra_of(
    force: np.ndarray, dte: np.ndarray, mesh_lines: int, *, steady: bool = True, start: np.ndarray | None = None
) -> Spectra:
    """Spectra of (E, N) signals sampled at 1 Hz, up to the line below half the sampling rate."""
    count = force.shape[1]
    kept = (count - 1) // 2 + 1
    u, y = (np.fft.rfft(s, axis=1)[:, :kept] / count for s in (force, dte))
    phases = np.zeros(force.shape[0]) if start is None else start
    return Spectra(u, y, 1.0 / count, mesh_lines, phases, steady)
