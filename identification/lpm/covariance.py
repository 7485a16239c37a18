"""Covariances of the local polynomial estimates.

A window's estimates are linear in the data, Gs_j(m) = h^H y with h = A (A^H A)^-1 phi_j(m), so that for
white noise of variance s^2 cov = s^2 h_a^H h_b over the rows that both windows share. G_l and G_{l+q} on
one output line come from rows q d lines apart: their covariance vanishes unless the windows overlap.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.regression import Regression, Window
from gearbench.identification.lpm.rows import WindowRows
from gearbench.identification.spectra.joint import Complexes, Floats


def diagonal_variance(roots: Complexes, window: Window) -> Floats:
    """Real parts (B, R+1, R+1, 2L+1) of the unit-noise covariances of one branch's own coefficients, from `roots`
    (B, unknowns, unknowns) of LocalFits."""
    shape = (*roots.shape[:2], window.order + 1, window.branches)  # of no roots too
    parts = [np.ascontiguousarray(part).reshape(shape) for part in (roots.real, roots.imag)]
    result = np.empty((len(roots), window.order + 1, window.order + 1, window.branches))
    for p in range(window.order + 1):
        for s in range(p + 1):
            value = sum(np.einsum("btj,btj->bj", part[:, :, p], part[:, :, s]) for part in parts)
            result[:, p, s] = result[:, s, p] = value
    return result


class CrossCovariance:
    """Accumulates sums over l of E[dG_l conj(dG_{l+q})], q = 1..Q, on the output lines: `sums` (Q, F).

    Windows may be added in any order; each pair of rows is met once, when its second window comes.
    Pairs of a row m < 0 with a row m' > 0 (within a window of frequency 0) are left out.
    """

    def __init__(self, regression: Regression, window: Window, place: NDArray[np.int64], shifts: int) -> None:
        self.regression, self.window, self.place, self.shifts = regression, window, place, shifts
        self.sums = np.zeros((shifts, int(place.max()) + 1), dtype=complex)
        self._kept: dict[int, tuple[int, float, Complexes]] = {}

    def add(self, root: Complexes, source: WindowRows, rows: NDArray[np.int64], noise: float) -> None:
        """Take in the estimates on `rows` from the one window of `source`, its `root` (LocalFits) and its residual
        variance `noise`."""
        window, d, centre = self.window, self.regression.mesh_lines, int(source.centres[0])
        matrix = source.matrix().reshape(-1, window.unknowns)
        transfer = (matrix @ root.conj().T) @ root
        transfer = transfer.reshape(self.regression.experiments, window.width, window.order + 1, window.branches)
        for m in rows:
            weight = window.basis()[m - centre + window.half_width]
            functional = np.einsum("erpj,p->jer", transfer, weight)
            for q in range(1, self.shifts + 1):
                for low, high in ((m - q * d, m), (m, m + q * d)):
                    other = low if high == m else high
                    if other in self._kept:
                        mine, theirs = (centre, noise, functional), self._kept[other]
                        first, second = (theirs, mine) if high == m else (mine, theirs)
                        self._pair(low, q, first, second)
            self._kept[int(m)] = (centre, noise, functional)

    def _pair(
        self, low: int, q: int, first: tuple[int, float, Complexes], second: tuple[int, float, Complexes]
    ) -> None:
        """Rows low (first) and low + q d (second): covariances of branch j there with branch j - q here."""
        window, d = self.window, self.regression.mesh_lines
        offset = second[0] - first[0]  # lines between the centres
        width = window.width - abs(offset)
        if width <= 0:
            return
        one = first[2][q:, :, max(offset, 0) : max(offset, 0) + width]
        two = second[2][: window.branches - q, :, max(-offset, 0) : max(-offset, 0) + width]
        value = np.einsum("jer,jer->j", one.conj(), two) * np.sqrt(first[1] * second[1])
        j = np.arange(-window.harmonics + q, window.harmonics + 1)
        line = np.abs(low + j * d)
        inside = (line > 0) & (line < self.place.size)
        column = np.where(inside, self.place[np.where(inside, line, 0)], -1)
        np.add.at(self.sums[q - 1], column[column >= 0], value[column >= 0])
