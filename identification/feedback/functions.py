"""What D and N are made of: splines that assume nothing, or partial fractions with poles in common.

A basis gives complex functions phi_i of the signed position w = line / top with phi_i(-w) = conj phi_i(w), so that real
coefficients make the transfer function of a real system.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from gearbench.identification.spectra.joint import Complexes, Floats

FITTING_ROUNDS = 12
# Complex poles that fitting would make unstable or all but undamped come back with this damping ratio.
LEAST_DAMPING = 2e-3


@dataclass(frozen=True)
class Splines:
    """Cubic splines, real and imaginary parts apart, on `intervals` equal intervals from position 0 to 1.

    Beyond, where no line is measured, they go on like a mass and a damper: their last values times the square of the
    position and the position.
    """

    intervals: int

    def at(self, position: Floats) -> Complexes:
        """Values (..., M)."""
        knots = np.arange(-3, self.intervals + 4) / self.intervals
        flat = np.clip(np.abs(position).ravel(), 0.0, 1.0)
        values = BSpline.design_matrix(flat, knots, 3).toarray().reshape(*position.shape, -1)
        further = np.maximum(np.abs(position), 1.0)[..., None]
        return np.concatenate(
            [values * further**2 + 0j, values * (1j * np.sign(position))[..., None] * further], axis=-1
        )

    @property
    def pairs(self) -> Floats:
        """No poles."""
        return np.empty((0, 2))

    @property
    def parameters(self) -> Floats:
        """No free parameters."""
        return np.empty(0)


@dataclass(frozen=True)
class Fractions:
    """1, s, s^2, and 1/q and s/q for each q = s^2 + a s + b of `pairs` (m, 2), a and b positive; s = j position.

    A pair of poles so written passes from complex to real ones, as those of over-damped supports, without a seam.

    No pole is slower than the position `least`, that of the lowest line: a slower one is not told from 1/s by any line,
    and may make anything of frequency 0, by which sidebands pass. Hence the free parameters of a pair are a and r in
    b = least a + r^2.
    """

    pairs: Floats
    least: float = 0.0

    @staticmethod
    def limited(pairs: Floats, least: float) -> Fractions:
        """Fractions of `pairs` (m, 2), of which those that are too slow come to the limit."""
        a = pairs[:, 0]
        return Fractions(np.stack([a, np.maximum(pairs[:, 1], least * a + least**2)], axis=1), least)

    @property
    def parameters(self) -> Floats:
        """Free parameters (2 m,): a of all pairs, then r."""
        a, b = self.pairs.T
        return np.concatenate([a, np.sqrt(np.maximum(b - self.least * a, 0.0))])

    def with_parameters(self, parameters: Floats) -> Fractions:
        """The same with other free parameters; their signs do not count."""
        a, r = np.abs(parameters.reshape(2, -1))
        return Fractions(np.stack([a, self.least * a + r**2], axis=1), self.least)

    def at(self, position: Floats) -> Complexes:
        """Values (..., 3 + 2 m)."""
        s = 1j * np.asarray(position)[..., None]
        fraction = 1.0 / self._squares(s)
        return np.concatenate([s**0, s, s**2, fraction, s * fraction], axis=-1)

    def slopes(self, position: Floats, coefficients: Floats) -> Complexes:
        """Derivatives (..., 2 m) of sum coefficients phi with respect to the free parameters."""
        s = 1j * np.asarray(position)[..., None]
        count = self.count
        change = -(coefficients[3 : 3 + count] + coefficients[3 + count :] * s) / self._squares(s) ** 2
        r = self.parameters[count:]
        return np.concatenate([(s + self.least) * change, 2 * r * change], axis=-1)

    @property
    def count(self) -> int:
        """Pairs of poles."""
        return self.pairs.shape[0]

    def _squares(self, s: NDArray) -> Complexes:
        return np.asarray(s**2 + self.pairs[:, 0] * s + self.pairs[:, 1])


Basis = Splines | Fractions


def pairs_of(poles: Complexes) -> Floats:
    """(m, 2): a and b of complex poles (m,) and their conjugates."""
    return np.stack([-2 * poles.real, np.abs(poles) ** 2], axis=1)


def common_pairs(position: Floats, responses: list[Complexes], weights: list[Floats], pairs: int) -> Floats:
    """Pairs of poles (pairs, 2) of fractions fitted to all `responses` at `position` > 0 at once.

    Vector fitting (Gustavsen and Semlyen 1999): sigma = 1 + sum c_i phi_i times each response is fitted with the same
    poles; the zeros of sigma are the next poles.
    """
    found = spread_pairs(position[0], position[-1], pairs)
    for _ in range(FITTING_ROUNDS):
        values = Fractions(found).at(position)
        size = values.shape[1]
        blocks, right = [], []
        for index, (response, weight) in enumerate(zip(responses, weights, strict=True)):
            row = np.zeros((position.size, len(responses) * size + 2 * pairs), dtype=complex)
            row[:, index * size : (index + 1) * size] = values
            row[:, len(responses) * size :] = -values[:, 3:] * response[:, None]
            blocks.append(row * weight[:, None])
            right.append(response * weight)
        found = relocated(found, np.concatenate(blocks), np.concatenate(right))
    return found


def relocated(pairs: Floats, matrix: Complexes, target: Complexes) -> Floats:
    """Pairs of the zeros of sigma = 1 + sum c_i phi_i, whose c are the last unknowns of `matrix` x = `target`."""
    stacked = np.concatenate([matrix.real, matrix.imag])
    scale = np.maximum(np.linalg.norm(stacked, axis=0), np.finfo(float).tiny)
    solution = np.linalg.lstsq(stacked / scale, np.concatenate([target.real, target.imag]), rcond=1e-12)[0] / scale
    return _zeros(pairs, solution[-2 * pairs.shape[0] :])


def spread_pairs(lowest: float, highest: float, pairs: int) -> Floats:
    """Pairs of poles of little damping, spread between two positions: where fitting begins."""
    size = np.linspace(lowest, highest, pairs + 2)[1:-1]
    return pairs_of(np.asarray((1j - 0.02) * size, dtype=complex))


def _zeros(pairs: Floats, coefficients: Floats) -> Floats:
    """Pairs of the zeros of 1 + sum of (c + e s) / q, made stable: those of A - B C of companion blocks."""
    count = pairs.shape[0]
    matrix = np.zeros((2 * count, 2 * count))
    above, below = np.arange(0, 2 * count, 2), np.arange(1, 2 * count, 2)
    matrix[above, below] = 1.0
    matrix[below, above], matrix[below, below] = -pairs[:, 1], -pairs[:, 0]
    matrix[below] -= np.stack([coefficients[:count], coefficients[count:]], axis=1).ravel()
    found = np.linalg.eigvals(matrix)
    upper = found[found.imag > 0]
    real = np.maximum(np.sort(np.abs(found[found.imag == 0].real)), 1e-6)
    size = np.maximum(np.abs(upper), 1e-6)
    oscillating = np.stack([2 * np.maximum(np.abs(upper.real), LEAST_DAMPING * size), size**2], axis=1)
    return np.concatenate([oscillating, np.stack([real[::2] + real[1::2], real[::2] * real[1::2]], axis=1)])
