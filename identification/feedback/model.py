"""The mesh-feedback model: what it is made of, its equations, and their solution.

    D(k) Y(k) + sum_{l /= 0} [k_l + j w_{k-ld} c_l] Y(k - l d) = N(k) U(k),   D = 1/P2 + k_0 + j w c_0,  N = P1/P2,

for a machine Y = P1 U - P2 F_m with F_m = k(t) dte + c(t) dte'. D and N are functions of frequency, k_l and
c_l Fourier coefficients of the mesh. Everything is in the units of `ClassData`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from gearbench.identification.feedback.functions import Basis, Fractions
from gearbench.identification.spectra.joint import Complexes, Floats

# Classes of up to so many lines are solved as dense matrices.
DENSE = 160


@dataclass(frozen=True)
class Model:
    """`d`, `n` (M,) real coefficients of D and N on `basis`, `k` and `c` (L,) Fourier coefficients l = 1..L of the
    mesh."""

    basis: Basis
    d: Floats
    n: Floats
    k: Complexes
    c: Complexes

    @property
    def harmonics(self) -> int:
        """Harmonics L of the mesh."""
        return self.k.size

    @property
    def free(self) -> int:
        """Real parameters of D and N, poles included."""
        return self.d.size + self.n.size + 2 * self.basis.poles.size

    def vector(self) -> Floats:
        """All parameters as real numbers: d, n, poles, k, c, of complex ones real parts first."""
        mesh = [part for x in (self.basis.poles, self.k, self.c) for part in (x.real, x.imag)]
        return np.concatenate([self.d, self.n, *mesh])

    def scaled(self, factor: float) -> Model:
        """D, N, k, c times a real number: the same response."""
        return Model(self.basis, factor * self.d, factor * self.n, factor * self.k, factor * self.c)

    def scale_direction(self) -> Floats:
        """Derivative of `vector` with respect to that number."""
        direction = self.vector()
        direction[self.d.size + self.n.size : self.free] = 0.0
        return direction

    def moved(self, vector: Floats) -> Model:
        """The model with these parameters; poles are kept stable."""
        pairs = self.basis.poles.size
        sizes = [self.d.size, self.n.size, pairs, pairs, *(4 * [self.harmonics])]
        d, n, real, imaginary, k, kj, c, cj = np.split(vector, np.cumsum(sizes)[:-1])
        basis = self.basis
        if isinstance(basis, Fractions):
            basis = Fractions(-np.abs(real) + 1j * np.abs(imaginary))
        return Model(basis, d, n, k + 1j * kj, c + 1j * cj)

    def functions(self, position: Floats) -> tuple[Complexes, Complexes]:
        """D and N at signed positions line / top."""
        values = self.basis.at(position)
        return values @ self.d, values @ self.n

    def columns(self, values: Complexes, omega: Floats, dte: Complexes, force: Complexes) -> Complexes:
        """Derivatives (S, P) of A Y - N U of one class for Y = `dte` and U = `force` (S,); `values`: of the basis."""
        parts = [values * dte[:, None], -values * force[:, None]]
        if isinstance(self.basis, Fractions):
            of_d, of_n = self.basis.slopes(omega, self.d), self.basis.slopes(omega, self.n)
            parts.append(of_d * dte[:, None] - of_n * force[:, None])
        return np.concatenate([*parts, mesh_columns(dte, omega, self.harmonics)], axis=1)


class Operator:
    """A of `A Y = N U` for the classes of `lines` / top (C, S), solvable for any right-hand sides."""

    def __init__(self, model: Model, omega: Floats, valid: np.ndarray) -> None:
        self.size, self.harmonics = omega.shape[1], min(model.harmonics, omega.shape[1] - 1)
        diagonal, self.n = model.functions(omega)
        diagonal = np.where(valid, diagonal, 1.0)
        self.n = np.where(valid, self.n, 0.0)
        if self.size <= DENSE:
            inverse = np.linalg.inv(self._dense(model, omega, valid, diagonal))
            self.inverse: Complexes | None = np.asarray(inverse, dtype=complex)
        else:
            self.inverse = None
            self.banded = self._banded(model, omega, valid, diagonal)

    def _dense(self, model: Model, omega: Floats, valid: np.ndarray, diagonal: Complexes) -> Complexes:
        index = np.subtract.outer(np.arange(self.size), np.arange(self.size)) + self.size - 1
        k, c = np.zeros((2, 2 * self.size - 1), dtype=complex)
        for target, source in ((k, model.k), (c, model.c)):
            target[self.size : self.size + self.harmonics] = source[: self.harmonics]
            target[self.size - 1 - self.harmonics : self.size - 1] = source[: self.harmonics][::-1].conj()
        matrix = (k[index] + c[index] * (1j * omega)[:, None, :]) * (valid[:, :, None] & valid[:, None, :])
        matrix[:, np.arange(self.size), np.arange(self.size)] = diagonal
        return np.asarray(matrix)

    def _banded(self, model: Model, omega: Floats, valid: np.ndarray, diagonal: Complexes) -> Complexes:
        reach = self.harmonics
        band = np.zeros((omega.shape[0], 2 * reach + 1, self.size), dtype=complex)
        band[:, reach] = diagonal
        for branch in range(1, reach + 1):
            low = (model.k[branch - 1] + 1j * model.c[branch - 1] * omega) * valid
            high = (model.k[branch - 1].conj() + 1j * model.c[branch - 1].conj() * omega) * valid
            # Row q + l of column q: l = branch below the diagonal, -branch above it.
            band[:, reach + branch, :-branch] = (low[:, :-branch]) * valid[:, branch:]
            band[:, reach - branch, branch:] = (high[:, branch:]) * valid[:, :-branch]
        return band

    def solve(self, index: int, right: Complexes) -> Complexes:
        """A^-1 `right` (S, m) of one class."""
        if self.inverse is not None:
            return np.asarray(self.inverse[index] @ right)
        reach = self.harmonics
        return np.asarray(solve_banded((reach, reach), self.banded[index], right, check_finite=False))


def coupled(values: Complexes, omega: Floats, harmonics: int) -> tuple[Complexes, Complexes]:
    """Columns (S, L) of Y(k - l d) and Y(k + l d), l = 1..L, of one class: `values` (S,); c columns are j w times."""
    size = values.size
    padded = np.concatenate([np.zeros(harmonics), values, np.zeros(harmonics)])
    row = np.arange(size)[:, None] + harmonics
    branch = np.arange(1, harmonics + 1)
    return padded[row - branch], padded[row + branch]


def mesh_columns(values: Complexes, omega: Floats, harmonics: int) -> Complexes:
    """d/d(Re k, Im k, Re c, Im c) of sum_l [k_l + j w c_l] Y(k - l d): (S, 4 L) of one class."""
    lower, upper = coupled(values, omega, harmonics)
    fast_lower, fast_upper = coupled(1j * omega * values, omega, harmonics)
    return np.concatenate(
        [lower + upper, 1j * (lower - upper), fast_lower + fast_upper, 1j * (fast_lower - fast_upper)], axis=1
    )
