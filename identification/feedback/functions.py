"""What D and N are made of: splines that assume nothing, or partial fractions with poles in common.

A basis gives complex functions phi_i of the signed position w = line / top with phi_i(-w) = conj phi_i(w), so that real
coefficients make the transfer function of a real system.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from gearbench.identification.spectra.joint import Complexes, Floats

FITTING_ROUNDS = 12
# Poles that fitting would make unstable or all but undamped come back with this damping ratio.
LEAST_DAMPING = 2e-3


@dataclass(frozen=True)
class Splines:
    """Cubic splines, real and imaginary parts apart, on `intervals` equal intervals from position 0 to 1."""

    intervals: int

    def at(self, position: Floats) -> Complexes:
        """Values (..., M)."""
        knots = np.arange(-3, self.intervals + 4) / self.intervals
        flat = np.clip(np.abs(position).ravel(), 0.0, 1.0)
        values = BSpline.design_matrix(flat, knots, 3).toarray().reshape(*position.shape, -1)
        return np.concatenate([values + 0j, values * (1j * np.sign(position))[..., None]], axis=-1)

    @property
    def poles(self) -> Complexes:
        """None."""
        return np.empty(0, dtype=complex)


@dataclass(frozen=True)
class Fractions:
    """1, s, s^2 and two functions for each pair of `poles` (m,) (upper half plane, stable); s = j position.

    r / (s - p) + conj r / (s - conj p) has the coefficients Re r, Im r.
    """

    poles: Complexes

    def at(self, position: Floats) -> Complexes:
        """Values (..., 3 + 2 m)."""
        s = 1j * np.asarray(position)[..., None]
        first, second = 1.0 / (s - self.poles), 1.0 / (s - self.poles.conj())
        return np.concatenate([s**0, s, s**2, first + second, 1j * (first - second)], axis=-1)

    def slopes(self, position: Floats, coefficients: Floats) -> Complexes:
        """Derivatives (..., 2 m) of sum coefficients phi with respect to Re p and Im p of each pole."""
        s = 1j * np.asarray(position)[..., None]
        count = self.poles.size
        residue = coefficients[3 : 3 + count] + 1j * coefficients[3 + count :]
        first, second = residue / (s - self.poles) ** 2, residue.conj() / (s - self.poles.conj()) ** 2
        return np.concatenate([first + second, 1j * (first - second)], axis=-1)


Basis = Splines | Fractions


def common_poles(position: Floats, responses: list[Complexes], weights: list[Floats], pairs: int) -> Complexes:
    """Poles (pairs,) of partial fractions fitted to all `responses` at `position` > 0 at once.

    Vector fitting (Gustavsen and Semlyen 1999): sigma = 1 + sum c_i phi_i times each response is fitted with the same
    poles; the zeros of sigma are the next poles.
    """
    imaginary = np.linspace(position[0], position[-1], pairs + 2)[1:-1]
    poles = imaginary * (1j - 0.02)
    for _ in range(FITTING_ROUNDS):
        values = Fractions(poles).at(position)
        size = values.shape[1]
        blocks, right = [], []
        for index, (response, weight) in enumerate(zip(responses, weights, strict=True)):
            row = np.zeros((position.size, len(responses) * size + 2 * pairs), dtype=complex)
            row[:, index * size : (index + 1) * size] = values
            row[:, len(responses) * size :] = -values[:, 3:] * response[:, None]
            blocks.append(row * weight[:, None])
            right.append(response * weight)
        matrix, target = np.concatenate(blocks), np.concatenate(right)
        stacked = np.concatenate([matrix.real, matrix.imag])
        scale = np.maximum(np.linalg.norm(stacked, axis=0), np.finfo(float).tiny)
        solution = np.linalg.lstsq(stacked / scale, np.concatenate([target.real, target.imag]), rcond=1e-12)[0] / scale
        poles = _zeros(poles, solution[len(responses) * size :])
    return poles


def _zeros(poles: Complexes, coefficients: Floats) -> Complexes:
    """Zeros (upper half plane) of 1 + sum of the fractions, made stable."""
    count = poles.size
    residue = coefficients[:count] + 1j * coefficients[count:]
    matrix = np.diag(np.concatenate([poles, poles.conj()])) - np.outer(
        np.ones(2 * count), np.concatenate([residue, residue.conj()])
    )
    found = np.linalg.eigvals(matrix)
    upper = found[np.argsort(-found.imag)][:count]
    size = np.maximum(np.abs(upper), 1e-6)
    real = -np.maximum(np.abs(upper.real), LEAST_DAMPING * size)
    return np.asarray(real + 1j * np.maximum(np.abs(upper.imag), 1e-4), dtype=complex)
