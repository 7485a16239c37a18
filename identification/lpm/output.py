"""Where the branches of a row belong among the output lines, and what is said of them there."""

from __future__ import annotations

import numpy as np

from gearbench.identification.lpm.rows import Lines
from gearbench.identification.spectra.joint import Complexes, Floats


class OutputLines:
    """Collects branches G_l(k), l = -L..L, with their variances and the coherence on the output `lines` k, row by row.

    `last`: highest row; `htf`, `variance` (2L+1, F), `coherence` (F,).
    """

    def __init__(self, lines: Lines, harmonics: int, mesh_lines: int, last: int) -> None:
        self.lines, self.harmonics, self.mesh_lines = lines, harmonics, mesh_lines
        # Column of each output line at [line + offset], -1 for every other line that a branch of a row may lead to.
        self.offset = last + harmonics * mesh_lines
        self.column = np.full(2 * self.offset + 1, -1)
        self.column[lines + self.offset] = np.arange(lines.size)
        self.htf = np.zeros((2 * harmonics + 1, lines.size), dtype=complex)
        self.variance = np.zeros((2 * harmonics + 1, lines.size))
        self.coherence = np.zeros(lines.size)

    @property
    def place(self) -> Lines:
        """Column of each of the lines 0, 1, .., up to the last output line, or -1."""
        return self.column[self.offset : self.offset + int(self.lines[-1]) + 1]

    def put(self, rows: Lines, value: Complexes, spread: Floats) -> None:
        """Put Gs_j(m) (M, 2L+1) and its mirror Gs_j(-m) = conj Gs_{-j}(m), with the variances `spread`, where they
        belong: G_l(k), l = -j, k = m + j d, for the `rows` m (M,)."""
        j = np.arange(-self.harmonics, self.harmonics + 1)
        for sign in (1, -1):
            column = self.column[sign * (rows[:, None] + j * self.mesh_lines) + self.offset]
            row, branch = np.nonzero(column >= 0)
            at = self.harmonics - sign * j[branch], column[row, branch]
            self.htf[at] = value[row, branch] if sign > 0 else value[row, branch].conj()
            self.variance[at] = spread[row, branch]

    def explain(self, rows: Lines, explained: Floats) -> None:
        """Part (M,) of the response's power around each of the `rows` that the result explains."""
        column = self.column[rows + self.offset]
        self.coherence[column[column >= 0]] = explained[column >= 0]
