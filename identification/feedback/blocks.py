"""The equations of a residue class, solved by dense blocks.

A matrix of band `reach` on both sides is block tridiagonal with blocks of that size or more. Its block factors (Golub
and Van Loan 2013, section 4.5) pivot inside blocks only: every leading part of the equations of a damped machine is the
equations of the same machine with fewer sidebands, and as well-conditioned as these.

A class that is its own mirror image has as many lines below zero as above, and equations there that are the complex
conjugates of those above in reverse. Both ends are taken off at once, and one says the other; what is left in the
middle, the core, is coupled to both.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal import fftconvolve

from gearbench.identification.spectra.joint import Complexes, Floats

# Matrices of up to so many times the band are one block.
DENSE = 2
# Part of the diagonal by which rounding may keep it from being its own mirror image.
ROUNDED = 1e-9


class MeshMatrices:
    """Factors of the matrices A (C, S, S), A_ij = k_{i-j} + j w_j c_{i-j}, with `diagonal` (C, S) in place of i = j.

    `k`, `c` (L,): coefficients 1..L, of -l their complex conjugates; `omega` (C, S). Lines that are not `valid` (C, S)
    are not coupled.
    """

    def __init__(self, diagonal: Complexes, k: Complexes, c: Complexes, omega: Floats, valid: np.ndarray) -> None:
        size, reach = diagonal.shape[1], max(k.size, 1)
        self._reach = reach
        self._diagonal, self._speed, self._valid = diagonal, 1j * omega, valid
        self._tables = tuple(_two_sided(x, size) for x in (k, c))
        self.mirrored = _mirrored(diagonal, omega, valid)
        ends = 2 if self.mirrored else 1
        count = 0 if size <= DENSE * reach else max((size - reach) // (ends * reach), 0)
        width = (size - reach) // (ends * count) if count else 0
        self._blocks = [slice(row * width, (row + 1) * width) for row in range(count)]
        self._core = slice(count * width, size - (ends - 1) * count * width)
        self.inverse: list[Complexes] = []
        self.upper: list[Complexes] = []
        self.down: list[Complexes] = []
        for own, following in pairwise([*self._blocks, self._core]):
            self.inverse.append(np.asarray(np.linalg.inv(self._left_of(own)), dtype=complex))
            self.upper.append(self._block(own, following))
            self.down.append(self._block(following, own) @ self.inverse[-1])
        core = self._left_of(self._core)
        if self.mirrored and count:
            core -= (self.down[-1] @ self.upper[-1])[:, ::-1, ::-1].conj()
        self._core_inverse = np.linalg.inv(core)

    def _left_of(self, own: slice) -> Complexes:
        """Diagonal block (C, b, b) without what the one before takes of it."""
        block = self._block(own, own)
        if self.down:
            block -= self.down[-1] @ self.upper[-1]
        return block

    def _block(self, own: slice, other: slice) -> Complexes:
        """Block (C, b, b')."""
        k, c = (_toeplitz(table, own, other) for table in self._tables)
        block = c * self._speed[:, None, other]
        block += k
        coupled = self._valid[:, own].all(axis=1) & self._valid[:, other].all(axis=1)
        for index in np.flatnonzero(~coupled):
            block[index] *= np.outer(self._valid[index, own], self._valid[index, other])
        if own == other:
            place = np.arange(own.stop - own.start)
            block[:, place, place] = self._diagonal[:, own]
        return np.asarray(block)

    def times(self, values: Complexes) -> Complexes:
        """A `values` (C, S, m)."""
        coupled, middle = values * self._valid[:, :, None], values.shape[1]
        band = slice(middle - self._reach, middle + self._reach + 1)
        found = sum(
            fftconvolve(x, table[None, band, None], mode="same", axes=1)
            for table, x in zip(self._tables, (coupled, self._speed[:, :, None] * coupled), strict=True)
        )
        return np.asarray(self._diagonal[:, :, None] * values + found * self._valid[:, :, None])

    def solve(self, index: int, right: Complexes, even: bool = False) -> Complexes:
        """Solution (S, m) of matrix number `index` for right-hand sides (S, m); `even`: each is its own mirror image,
        where the class is."""
        if not self._blocks:
            return np.asarray(self._core_inverse[index] @ right)
        columns, lines = right.shape[1], right.shape[0]
        # One set of factors serves both ends, side by side: the far one as its mirror image.
        both = self.mirrored and not even
        ends = np.concatenate([right, _flipped(right)], axis=1) if both else right
        work = [ends[own] for own in self._blocks]
        for row in range(1, len(work)):
            work[row] = work[row] - self.down[row - 1][index] @ work[row - 1]
        taken = self.down[-1][index] @ work[-1]
        core = right[self._core] - taken[:, :columns]
        if self.mirrored:
            core -= _flipped(taken[:, -columns:])
        result = np.empty(right.shape, dtype=complex)
        result[self._core] = found = self._core_inverse[index] @ core
        if both:
            found = np.concatenate([found, _flipped(found)], axis=1)
        for row in range(len(work) - 1, -1, -1):
            found = self.inverse[row][index] @ (work[row] - self.upper[row][index] @ found)
            own = self._blocks[row]
            result[own] = found[:, :columns]
            if self.mirrored:
                result[lines - own.stop : lines - own.start] = _flipped(found[:, -columns:])
        return result


def _flipped(values: Complexes) -> Complexes:
    """What stands at the opposite lines, conjugate."""
    return np.asarray(values[::-1].conj())


def _mirrored(diagonal: Complexes, omega: Floats, valid: np.ndarray) -> bool:
    opposite = diagonal[:, ::-1].conj()
    return bool(
        np.array_equal(omega, -omega[:, ::-1])
        and np.array_equal(valid, valid[:, ::-1])
        and np.all(np.abs(diagonal - opposite) <= ROUNDED * np.abs(diagonal))
    )


def _toeplitz(table: Complexes, own: slice, other: slice) -> Complexes:
    """Coefficients (b, b') of the differences of lines of a two-sided `table`, a view of it."""
    first = table.size // 2 - own.start + other.start
    windows = sliding_window_view(table[::-1], other.stop - other.start)
    return np.asarray(windows[first - (own.stop - own.start) + 1 : first + 1][::-1])


def _two_sided(positive: Complexes, reach: int) -> Complexes:
    """Coefficients -reach..reach of those from 1 on; 0 in the middle and beyond."""
    table = np.zeros(2 * reach + 1, dtype=complex)
    kept = positive[:reach]
    table[reach + 1 : reach + 1 + kept.size] = kept
    table[reach - kept.size : reach] = kept[::-1].conj()
    return table
