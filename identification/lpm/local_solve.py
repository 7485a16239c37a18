"""Least squares of one local window: scaled normal equations with a corrected solution, or orthogonal factors.

The corrected semi-normal equations (Bjorck, Linear Algebra Appl. 88/89, 1987) are as accurate as QR as long
as the squared condition number is far below 1/eps, which the scaled Legendre columns of random-phase inputs
keep (condition numbers of 3 to 100). Beyond CONDITION_LIMIT the window is solved by its singular values
instead; a window that is numerically singular is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from gearbench.identification.lpm.rows import WindowRows
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
class LocalFit:
    """Solution of one window: coefficients (R+1, 2L+1), what is `left` (E, 2n+1) of the data, its sum of squares,
    degrees of freedom.

    `factor` (unknowns, unknowns) is X with (A^H A)^-1 = X X^H, or None where it was not asked for;
    `condition` the estimated condition number of the scaled regression (NaN if not asked for).
    """

    coefficients: Complexes
    left: Complexes
    residual: float
    freedom: int
    factor: Complexes | None
    condition: float


def solve_window(
    rows: WindowRows,
    gram: Complexes,
    *,
    want_factor: bool,
    want_condition: bool = False,
) -> LocalFit:
    """Fit one window; `gram` is its Gram matrix without the transients' part (overwritten).

    Raises LpmError if the inputs are numerically dependent.
    """
    if rows.window.transient:
        taken = rows.transient_products()
        gram -= taken.conj().T @ taken
    keep = rows.columns.ravel()
    freedom = rows.equations - rows.unknowns
    scale = _scale(gram, keep)
    kept = gram.copy() if want_condition else None
    # LAPACK reads the transposed, that is the conjugate matrix: solve the conjugate equations.
    triangle, failed = lapack.zpotrf(gram.T, lower=0, clean=0, overwrite_a=1)
    diagonal = np.abs(np.diagonal(triangle))
    if failed or diagonal.min() * CONDITION_LIMIT < diagonal.max():
        return _solve_by_singular_values(rows, keep, freedom)

    def solved(right: Complexes) -> Complexes:
        reduced = (right.ravel() * keep * scale).conj()
        solution, _ = lapack.zpotrs(triangle, reduced, lower=0)
        return (solution.conj() * scale * keep).reshape(right.shape)

    coefficients = solved(rows.adjoint(rows.data))
    residual = rows.data - rows.apply(coefficients)
    correction = solved(rows.adjoint(residual))
    coefficients = coefficients + correction
    if np.linalg.norm(correction) > 1e-9 * np.linalg.norm(coefficients):
        residual = rows.data - rows.apply(coefficients)
    factor, condition = None, np.nan
    if want_factor:
        inverse, _ = lapack.ztrtri(triangle, lower=0)
        factor = np.triu(inverse).conj() * (scale * keep)[:, None]
    if kept is not None:
        condition = _condition(kept.conj(), triangle)
    return LocalFit(coefficients, residual, _power(residual), freedom, factor, condition)


def _scale(gram: Complexes, keep: np.ndarray) -> Floats:
    """Scale the Gram matrix in place to a unit diagonal, unknown columns replaced by the identity's; the scales."""
    if not keep.all():
        gram[~keep] = 0.0
        gram[:, ~keep] = 0.0
        gram[~keep, ~keep] = 1.0
    scale = 1.0 / np.sqrt(np.abs(np.diagonal(gram)))
    gram *= scale[:, None]
    gram *= scale
    return scale


def _power(values: Complexes) -> float:
    return float(np.sum(values.real**2 + values.imag**2))


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


def _solve_by_singular_values(rows: WindowRows, keep: np.ndarray, freedom: int) -> LocalFit:
    window, data = rows.window, rows.data
    matrix = rows.matrix().reshape(data.size, window.unknowns)[:, keep]
    scale = 1.0 / np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
    left, strength, right = np.linalg.svd(matrix * scale, full_matrices=False)
    condition = float(strength[0] / max(strength[-1], np.finfo(float).tiny))
    if condition > SINGULAR:
        raise LpmError(
            f"the inputs are numerically dependent around line {rows.centre}: condition number {condition:.1e} exceeds"
            f" {SINGULAR:.0e}; excite with random phases, or lower harmonics = {window.harmonics} or order ="
            f" {window.order}"
        )
    inverse = (right.conj().T / strength) * scale[:, None]
    solution = inverse @ (left.conj().T @ data.ravel())
    coefficients = np.zeros(window.unknowns, dtype=complex)
    coefficients[keep] = solution
    factor = np.zeros((window.unknowns, window.unknowns), dtype=complex)
    factor[np.ix_(keep, keep)] = inverse
    residual = data.ravel() - matrix @ solution
    left = residual.reshape(data.shape)
    return LocalFit(coefficients.reshape(window.order + 1, -1), left, _power(left), freedom, factor, condition)
