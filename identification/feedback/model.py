"""The mesh-feedback model: what it is made of, its equations, and their solution.

    D(k) Y(k) + sum_{l /= 0} [k_l + j w_{k-ld} c_l] Y(k - l d) = N(k) U(k),   D = 1/P2 + k_0 + j w c_0,  N = P1/P2,

for a machine Y = P1 U - P2 F_m with F_m = k(t) dte + c(t) dte'. D and N are functions of frequency, k_l and
c_l Fourier coefficients of the mesh. Everything is in the units of `ClassData`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearbench.identification.feedback.blocks import MeshMatrices
from gearbench.identification.feedback.functions import Basis, Fractions
from gearbench.identification.spectra.joint import Complexes, Floats


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
        return self.d.size + self.n.size + self.basis.pairs.size

    def vector(self) -> Floats:
        """All parameters as real numbers: d, n, those of the pairs, k, c, of complex ones real parts first."""
        mesh = [part for x in (self.k, self.c) for part in (x.real, x.imag)]
        return np.concatenate([self.d, self.n, self.basis.parameters, *mesh])

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
        sizes = [self.d.size, self.n.size, self.basis.pairs.size, *(4 * [self.harmonics])]
        d, n, pairs, k, kj, c, cj = np.split(vector, np.cumsum(sizes)[:-1])
        basis = self.basis
        if isinstance(basis, Fractions):
            basis = basis.with_parameters(pairs)
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
        kept = min(model.harmonics, omega.shape[1] - 1)
        diagonal, n = model.functions(omega)
        self.n = np.where(valid, n, 0.0)
        self._matrices = MeshMatrices(
            np.where(valid, diagonal, 1.0), model.k[:kept], model.c[:kept], omega, valid
        )

    def solve(self, index: int, right: Complexes) -> Complexes:
        """A^-1 `right` (S, m) of one class."""
        return self._matrices.solve(index, right)


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
