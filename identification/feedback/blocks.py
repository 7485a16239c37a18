"""The equations of a residue class, solved by dense blocks.

A matrix of band `reach` on both sides is block tridiagonal with blocks of that size. Its block factors (Golub and Van
Loan 2013, section 4.5) pivot inside blocks only: every leading part of the equations of a damped machine is the
equations of the same machine with fewer sidebands, and as well-conditioned as these.
"""

from __future__ import annotations

import numpy as np

from gearbench.identification.spectra.joint import Complexes, Floats

# Matrices of up to so many times the band are one block.
DENSE = 2


class MeshMatrices:
    """Factors of the matrices A (C, S, S), A_ij = k_{i-j} + j w_j c_{i-j}, with `diagonal` (C, S) in place of i = j.

    `k`, `c` (L,): coefficients 1..L, of -l their complex conjugates; `omega` (C, S). Lines that are not `valid` (C, S)
    are not coupled.
    """

    def __init__(self, diagonal: Complexes, k: Complexes, c: Complexes, omega: Floats, valid: np.ndarray) -> None:
        self.size, reach = diagonal.shape[1], max(k.size, 1)
        self.block = self.size if self.size <= DENSE * reach else reach
        self.count = -(-self.size // self.block)
        more = ((0, 0), (0, self.count * self.block - self.size))
        self._diagonal = np.pad(diagonal, more, constant_values=1.0)
        self._speed, self._valid = np.pad(1j * omega, more), np.pad(valid, more)
        self._tables = tuple(_two_sided(x, 2 * self.block) for x in (k, c))
        self.inverse: list[Complexes] = []
        self.upper: list[Complexes] = []
        self.down: list[Complexes] = []
        for index in range(self.count):
            own = self._block(index, index)
            if index:
                left = self._block(index, index - 1) @ self.inverse[-1]
                own = own - left @ self.upper[-1]
                self.down.append(left)
            self.inverse.append(np.asarray(np.linalg.inv(own), dtype=complex))
            if index + 1 < self.count:
                self.upper.append(self._block(index, index + 1))

    def _block(self, row: int, column: int) -> Complexes:
        """Block (C, b, b)."""
        b = self.block
        order = np.subtract.outer(np.arange(b), np.arange(b)) + (row - column) * b + 2 * b
        own, other = slice(row * b, row * b + b), slice(column * b, column * b + b)
        k, c = (table[order] for table in self._tables)
        block = c * self._speed[:, None, other]
        block += k
        for index in np.flatnonzero(~(self._valid[:, own].all(axis=1) & self._valid[:, other].all(axis=1))):
            block[index] *= np.outer(self._valid[index, own], self._valid[index, other])
        if row == column:
            block[:, np.arange(b), np.arange(b)] = self._diagonal[:, own]
        return np.asarray(block)

    def solve(self, index: int, right: Complexes) -> Complexes:
        """Solution (S, m) of matrix number `index` for right-hand sides (S, m)."""
        if self.count == 1:
            return np.asarray(self.inverse[0][index] @ right)
        work: Complexes = np.zeros((self.count, self.block, right.shape[1]), dtype=complex)
        work.reshape(-1, right.shape[1])[: self.size] = right
        for row in range(1, self.count):
            work[row] -= self.down[row - 1][index] @ work[row - 1]
        work[-1] = self.inverse[-1][index] @ work[-1]
        for row in range(self.count - 2, -1, -1):
            work[row] = self.inverse[row][index] @ (work[row] - self.upper[row][index] @ work[row + 1])
        return np.asarray(work.reshape(-1, right.shape[1])[: self.size])


def _two_sided(positive: Complexes, reach: int) -> Complexes:
    """Coefficients -reach..reach of those from 1 on; 0 in the middle and beyond."""
    table = np.zeros(2 * reach + 1, dtype=complex)
    kept = positive[:reach]
    table[reach + 1 : reach + 1 + kept.size] = kept
    table[reach - kept.size : reach] = kept[::-1].conj()
    return table
