"""Least squares of local windows: scaled normal equations with a corrected solution, or orthogonal factors.

The corrected semi-normal equations (Bjorck, Linear Algebra Appl. 88/89, 1987) are as accurate as QR as long
as the squared condition number is far below 1/eps, which the scaled Legendre columns of random-phase inputs
keep (condition numbers of 3 to 100). Beyond CONDITION_LIMIT the window is solved by its singular values
instead; a window that is numerically singular is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from gearbench.identification.lpm.rows import Lines, WindowRows
from gearbench.identification.spectra.joint import Complexes, Floats

# Largest condition number of the regression that the normal equations are trusted with.
CONDITION_LIMIT = 1e5
# Largest one that is solved at all.
SINGULAR = 1e9
# Iterations of the condition estimate.
POWER_ROUNDS = 30


class LpmError(ValueError):
    """An identification that the record cannot support; the sentence names the numbers."""


@dataclass(frozen=True)
class LocalFits:
    """Solutions of B windows: coefficients (B, R+1, 2L+1), what is `left` (B, E, 2n+1) of the data, its sum of squares
    `residual` and the degrees of `freedom` (B,).

    `roots` (windows asked for, unknowns, unknowns): Z with (A^H A)^-1 = Z^H Z; `condition` (B,): the estimated
    condition number of the scaled regression, NaN where it was not asked for.
    """

    coefficients: Complexes
    left: Complexes
    residual: Floats
    freedom: Lines
    roots: Complexes
    condition: Floats


def solve_windows(
    rows: WindowRows, gram: Complexes, *, want_roots: Sequence[int] = (), want_condition: Sequence[int] = ()
) -> LocalFits:
    """Fit all windows; `gram` (B, unknowns, unknowns) are their Gram matrices without the transients' part
    (overwritten), `want_roots` and `want_condition` the indices of the windows whose these are wanted of.

    Raises LpmError if the inputs of one are numerically dependent.
    """
    if rows.window.transient:
        taken = rows.transient_products()
        gram -= taken.conj().transpose(0, 2, 1) @ taken
    keep = rows.columns.reshape(gram.shape[:2])
    scale = _scale(gram, keep) * keep
    kept = gram[list(want_condition)]
    triangles, sound = _triangles(gram)

    def solved(right: Complexes) -> Complexes:
        reduced = (right.reshape(scale.shape) * scale).conj()
        found = [lapack.zpotrs(t, r, lower=0)[0] for t, r in zip(triangles, reduced, strict=True)]
        return np.asarray((np.array(found).conj() * scale).reshape(right.shape))

    coefficients = solved(rows.adjoint(rows.data))
    left = rows.data - rows.apply(coefficients)
    correction = solved(rows.adjoint(left))
    coefficients = coefficients + correction
    if (_power(correction) > 1e-18 * _power(coefficients)).any():
        left = rows.data - rows.apply(coefficients)
    roots: Complexes = np.zeros((len(want_roots), *gram.shape[1:]), dtype=complex)
    for place, index in enumerate(want_roots):
        inverse, _ = lapack.ztrtri(triangles[index], lower=0)
        np.multiply(inverse.T, scale[index], out=roots[place])
    condition = np.full(len(keep), np.nan)
    for index, matrix in zip(want_condition, kept, strict=True):
        condition[index] = _condition(matrix.conj(), triangles[index])
    for index in np.flatnonzero(~sound).tolist():
        coefficients[index], left[index], root, condition[index] = _by_singular_values(rows.part(index))
        if index in want_roots:
            roots[list(want_roots).index(index)] = root
    return LocalFits(coefficients, left, _power(left), rows.equations - rows.unknowns, roots, condition)


def _triangles(gram: Complexes) -> tuple[list[Complexes], NDArray[np.bool_]]:
    """Cholesky factors, in place, and which of them can be relied on.

    LAPACK reads the transposed, that is the conjugate matrix: conjugate equations are solved.
    """
    found, sound = [], np.ones(len(gram), dtype=bool)
    for index, matrix in enumerate(gram):
        triangle, failed = lapack.zpotrf(matrix.T, lower=0, clean=1, overwrite_a=1)
        diagonal = np.diagonal(triangle).real
        sound[index] = not failed and diagonal.min() * CONDITION_LIMIT >= diagonal.max()
        found.append(triangle if sound[index] else np.eye(len(matrix), dtype=complex))
    return found, sound


def _scale(gram: Complexes, keep: NDArray[np.bool_]) -> Floats:
    """Scale Gram matrices in place to a unit diagonal, unknown columns replaced by the identity's; the scales."""
    if not keep.all():
        gram *= keep[:, :, None]
        gram *= keep[:, None, :]
        window, column = np.nonzero(~keep)
        gram[window, column, column] = 1.0
    scale = 1.0 / np.sqrt(np.abs(np.diagonal(gram, axis1=1, axis2=2)))
    gram *= scale[:, :, None]
    gram *= scale[:, None, :]
    return np.asarray(scale)


def _power(values: Complexes) -> Floats:
    """Sum of squares of each window."""
    flat = np.ascontiguousarray(values).view(float).reshape(len(values), -1)
    return np.asarray(np.einsum("bi,bi->b", flat, flat))


def _condition(gram: Complexes, triangle: Complexes) -> float:
    """Condition number of the regression from its scaled Gram matrix and that one's (conjugate) Cholesky factor.

    Power and inverse iteration from a fixed start: a lower estimate, within some per cent.
    """
    start = np.random.default_rng(0).standard_normal((2, gram.shape[0]))
    largest = smallest = (start[0] + 1j * start[1]) / np.linalg.norm(start)
    top = bottom = 1.0
    for _ in range(POWER_ROUNDS):
        largest = gram @ largest
        top = float(np.linalg.norm(largest))
        largest = largest / top
        smallest, _ = lapack.zpotrs(triangle, smallest, lower=0)
        bottom = float(np.linalg.norm(smallest))
        smallest = smallest / bottom
    return float(np.sqrt(top * bottom))


def _by_singular_values(rows: WindowRows) -> tuple[Complexes, Complexes, Complexes, float]:
    """Coefficients, what is left, root and condition number of the one window of `rows`."""
    window, data, keep = rows.window, rows.data[0], rows.columns.ravel()
    matrix = rows.matrix().reshape(data.size, window.unknowns)[:, keep]
    scale = 1.0 / np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
    left, strength, right = np.linalg.svd(matrix * scale, full_matrices=False)
    condition = float(strength[0] / max(strength[-1], np.finfo(float).tiny))
    if condition > SINGULAR:
        raise LpmError(
            f"the inputs are numerically dependent around line {rows.centres[0]}: condition number {condition:.1e}"
            f" exceeds {SINGULAR:.0e}; excite with random phases, or lower harmonics = {window.harmonics} or order ="
            f" {window.order}"
        )
    inverse = (right.conj().T / strength) * scale[:, None]
    solution = inverse @ (left.conj().T @ data.ravel())
    coefficients = np.zeros(window.unknowns, dtype=complex)
    coefficients[keep] = solution
    root = np.zeros((window.unknowns, window.unknowns), dtype=complex)
    root[np.ix_(keep, keep)] = inverse.conj().T
    remains = (data.ravel() - matrix @ solution).reshape(data.shape)
    return coefficients.reshape(window.order + 1, -1), remains, root, condition
