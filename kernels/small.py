"""Small dense systems inside compiled loops, without LAPACK: it takes seconds to compile and calls cost more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import compiled

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


@compiled(forceinline=True)
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


@compiled(forceinline=True)
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


@compiled
def times(matrix: Array, vector: Array) -> Array:
    """Matrix (n, m) times vector (m,)."""
    out = np.zeros(matrix.shape[0])
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            out[i] += matrix[i, j] * vector[j]
    return out


@compiled
def plus(x: Array, factor: float, y: Array) -> Array:
    """x + factor y."""
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = x[i] + factor * y[i]
    return out


@compiled
def arrow_times(diagonal: Array, corner: Array, vector: Array) -> Array:
    """Arrow matrix times vector: `diagonal` (d,) and, between its first k and its last d - k rows, `corner`."""
    k = corner.shape[0]
    out = np.empty(len(vector))
    for i in range(len(vector)):
        out[i] = diagonal[i] * vector[i]
    for i in range(k):
        for j in range(corner.shape[1]):
            out[i] += corner[i, j] * vector[k + j]
            out[k + j] += corner[i, j] * vector[i]
    return out


@compiled
def arrow_factor(diagonal: Array, corner: Array, scale: float) -> Array:
    """Inverse (k, k) of the Schur complement of an arrow matrix whose corner is scale * corner."""
    k = corner.shape[0]
    system = np.zeros((k, 2 * k))
    for p in range(k):
        for q in range(k):
            for j in range(corner.shape[1]):
                system[p, q] -= scale * scale * corner[p, j] * corner[q, j] / diagonal[k + j]
        system[p, p] += diagonal[p]
        system[p, k + p] = 1.0
    return eliminate(system)


@compiled
def arrow_solve(factor: Array, diagonal: Array, corner: Array, scale: float, rhs: Array) -> Array:
    """Solution (d,) of the arrow matrix for one right-hand side."""
    k = corner.shape[0]
    head = np.empty(k)
    for p in range(k):
        head[p] = rhs[p]
        for j in range(corner.shape[1]):
            head[p] -= scale * corner[p, j] * rhs[k + j] / diagonal[k + j]
    out = np.empty(len(rhs))
    for p in range(k):
        out[p] = 0.0
        for q in range(k):
            out[p] += factor[p, q] * head[q]
    for j in range(corner.shape[1]):
        value = rhs[k + j]
        for p in range(k):
            value -= scale * corner[p, j] * out[p]
        out[k + j] = value / diagonal[k + j]
    return out
