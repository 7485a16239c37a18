"""Small dense systems inside compiled loops, without LAPACK: it takes seconds to compile and calls cost more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import INNER, ROUNDING, compiled

Array = NDArray[np.float64]


@compiled
def eliminate(system: Array) -> Array:
    """Solve [A | B] of shape (n, n + m) by Gaussian elimination with row pivoting; returns A^-1 B, (n, m).

    `system` is overwritten. A singular A gives infinities or NaN.
    """
    n, width = system.shape
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, width):
                system[k, j], system[pivot, j] = system[pivot, j], system[k, j]
        scale = 1.0 / system[k, k]
        for i in range(k + 1, n):
            factor = system[i, k] * scale
            if factor != 0.0:
                for j in range(k + 1, width):
                    system[i, j] -= factor * system[k, j]
    out = np.empty((n, width - n))
    for c in range(width - n):
        for k in range(n - 1, -1, -1):
            value = system[k, n + c]
            for j in range(k + 1, n):
                value -= system[k, j] * out[j, c]
            out[k, c] = value / system[k, k]
    return out


@compiled(forceinline=True, **INNER)
def solve_in_place(system: Array, n: int) -> None:
    """Solve [A | b], the first n rows and n + 1 columns of `system`, by Gaussian elimination with row pivoting; the
    solution stands in column n. A singular A gives infinities or NaN."""
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, n + 1):
                system[k, j], system[pivot, j] = system[pivot, j], system[k, j]
        scale = 1.0 / system[k, k]
        for i in range(k + 1, n):
            factor = system[i, k] * scale
            for j in range(k + 1, n + 1):
                system[i, j] -= factor * system[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            system[k, n] -= system[k, j] * system[j, n]
        system[k, n] /= system[k, k]


@compiled(fastmath=ROUNDING, forceinline=True, **INNER)
def invert(matrix: Array, inverse: Array) -> None:
    """Write the inverse (n, n) of a matrix (n, n) by Gauss and Jordan's method with row pivoting; `matrix` is
    overwritten. A singular one gives infinities or NaN."""
    n = len(matrix)
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
                inverse[k, j], inverse[pivot, j] = inverse[pivot, j], inverse[k, j]
        scale = 1.0 / matrix[k, k]
        for j in range(n):
            matrix[k, j] *= scale
            inverse[k, j] *= scale
        for i in range(n):
            factor = matrix[i, k]
            if i != k and factor != 0.0:
                for j in range(n):
                    matrix[i, j] -= factor * matrix[k, j]
                    inverse[i, j] -= factor * inverse[k, j]
