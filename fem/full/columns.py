"""Solutions of one sparse symmetric matrix for many right-hand sides at once: SuperLU's factors, swept row by row.

SuperLU solves its right-hand sides one after the other. Where there are as many as teeth, a sweep that takes every
entry of the factors to all of them needs a fifth of the time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from gearbench.fem.gear.ring import Solver
from gearbench.kernels.compiled import compiled

Array = NDArray[np.float64]
Index = NDArray[np.int32]


class Triangle(NamedTuple):
    """Off-diagonal entries of a triangular matrix by columns: `start` (n + 1,), `row` and `value` of each entry."""

    start: Index
    row: Index
    value: Array


def symmetric_sweeps(matrix: csc_matrix) -> Solver:
    """Factorise a symmetric sparse matrix in SuperLU's symmetric mode; the solver takes (n,) or (n, k)."""
    narrow = csc_matrix(
        (matrix.data, matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)), shape=matrix.shape
    )
    factor = splu(narrow, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    lower, upper = _triangle(factor.L), _triangle(factor.U)
    pivots = factor.U.diagonal()
    rows, columns = np.argsort(factor.perm_r), np.asarray(factor.perm_c)

    def solve(forces: Array) -> Array:
        swept = np.ascontiguousarray(forces[rows].reshape(len(rows), -1))
        sweep(lower, upper, pivots, swept)
        return swept[columns].reshape(forces.shape)

    return solve


def _triangle(factor: csc_matrix) -> Triangle:
    """The entries off the diagonal."""
    entries = factor.tocoo()
    off = entries.row != entries.col
    kept = csc_matrix((entries.data[off], (entries.row[off], entries.col[off])), shape=factor.shape)
    return Triangle(kept.indptr.astype(np.int32), kept.indices.astype(np.int32), kept.data)


@compiled
def sweep(lower: Triangle, upper: Triangle, pivots: Array, x: Array) -> None:
    """Turn right-hand sides x (n, k) into solutions of L U x: L has a unit diagonal, U has `pivots` (n,) on its own."""
    n, k = x.shape
    for j in range(n):
        for e in range(lower.start[j], lower.start[j + 1]):
            i, value = lower.row[e], lower.value[e]
            for c in range(k):
                x[i, c] -= value * x[j, c]
    for j in range(n - 1, -1, -1):
        for c in range(k):
            x[j, c] /= pivots[j]
        for e in range(upper.start[j], upper.start[j + 1]):
            i, value = upper.row[e], upper.value[e]
            for c in range(k):
                x[i, c] -= value * x[j, c]
