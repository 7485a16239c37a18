"""Power of the branches that a local model leaves out, from what its residuals share with their inputs.

A branch j that is left out sends Gs_j(m) U(m + j d) into the residual r of a window. The other inputs are independent
of U(m + j d), so that with phi = degrees of freedom over equations

    c_j = sum conj(U(m + j d)) r(m) / (phi S_j),  S_j = sum |U(m + j d)|^2,   E|c_j|^2 = |Gs_j|^2 + s^2 / (phi S_j):

the correlation, less what noise of the residual's variance s^2 adds to it (Bendat and Piersol 2010, chapter 9).

Over a window that is wide against the response's variation only the mean of Gs_j counts: the power is then low, by
a tenth to a quarter in trials with three and six experiments, and by more in wider windows. One experiment with a
transient, whose polynomial takes the slow part of every residual, showed a tenth to a third of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.local_solve import LocalFit
from gearbench.identification.lpm.rows import WindowRows

Lines = NDArray[np.int64]


class MissingPower:
    """Mean over output lines k of |G_l(k)|^2 for branches |l| > L, window by window.

    A row m reads branch l = -j of line m + j d, or l = j of line -(m + j d) where that is negative.
    """

    def __init__(self, lines: Lines, mesh_lines: int, highest: int) -> None:
        self.lines = lines
        self.wanted = np.zeros(int(lines[-1]) + 1, dtype=bool)
        self.wanted[lines] = True
        self.furthest = (int(lines[-1]) + highest) // mesh_lines + 1
        self.power, self.count = np.zeros((2, 2 * self.furthest + 1))

    @property
    def total(self) -> float:
        """Sum over the branches and all output lines; those that no row has met count like those that some have."""
        met = self.count > 0
        return float(np.sum(self.power[met] / self.count[met]) * self.lines.size)

    def add(self, fit: LocalFit, source: WindowRows, rows: Lines) -> None:
        """Take in the residuals of a window for the `rows` that are read from it."""
        branch = np.arange(-self.furthest, self.furthest + 1)
        branch = branch[np.abs(branch) > source.window.harmonics]
        line = rows[:, None] + branch * source.regression.mesh_lines
        reached = (np.abs(line) < self.wanted.size) & self.wanted[np.minimum(np.abs(line), self.wanted.size - 1)]
        ahead, mirrored = (np.count_nonzero(reached & side, axis=0) for side in (line > 0, line < 0))
        some = ahead + mirrored > 0
        branch, ahead, mirrored = branch[some], ahead[some], mirrored[some]
        if not branch.size or fit.freedom <= 0:
            return
        inputs = source.inputs_of(branch)
        size = np.sum(inputs.real**2 + inputs.imag**2, axis=(0, 1))
        excited = size > 0
        share = fit.freedom / source.equations * size[excited]
        product = np.einsum("rej,er->j", inputs[:, :, excited].conj(), fit.left)
        found = np.abs(product / share) ** 2 - fit.residual / fit.freedom / share
        for place, count in ((-branch, ahead), (branch, mirrored)):
            self.power[place[excited] + self.furthest] += count[excited] * found
            self.count[place[excited] + self.furthest] += count[excited]
