"""The mesh-feedback model: what it is made of, its equations, and their solution.

    D(k) Y(k) + sum_{l /= 0} [k_l + j w_{k-ld} c_l] Y(k - l d) = N(k) U(k),   D = 1/P2 + k_0 + j w c_0,  N = P1/P2,

for a machine Y = P1 U - P2 F_m with F_m = k(t) dte + c(t) dte'. D and N are functions of frequency, k_l and
c_l Fourier coefficients of the mesh. Everything is in the units of `ClassData`.

Angles alone show X = P1 (U - F_m), without the motion S F_m of the gear centres, while F_m follows the whole deflection
Y = X - S F_m (P2 = P1 + S). With F_m = (P1 U - Y) / P2,

    X = Y + S F_m = (1 - S/P2) Y + (S P1/P2) U = N Y + E U,    E = S N,

where Y obeys the equation above: N is the same function twice, by reciprocity, and E has the poles of D and N. (As an
equation for X: with F_m = U - X/P1, [k*](P2/P1 X + (P1 - P2) U) + X/P1 = U.)
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearbench.identification.feedback.blocks import MeshMatrices
from gearbench.identification.feedback.functions import Basis, Fractions
from gearbench.identification.spectra.joint import Complexes, Floats


@dataclass(frozen=True)
class Model:
    """`d`, `n` (M,) real coefficients of D and N on `basis`, `k` and `c` (L,) Fourier coefficients l = 1..L of the
    mesh; `e` (M,) those of E where records show N Y + E U, else (0,)."""

    basis: Basis
    d: Floats
    n: Floats
    k: Complexes
    c: Complexes
    e: Floats = field(default_factory=lambda: np.empty(0))

    @property
    def torsional(self) -> bool:
        """Whether the records show the torsional part of the deflection only."""
        return self.e.size > 0

    @property
    def harmonics(self) -> int:
        """Harmonics L of the mesh."""
        return self.k.size

    @property
    def free(self) -> int:
        """Real parameters of D, N and E, poles included."""
        return self.d.size + self.n.size + self.e.size + self.basis.pairs.size

    def vector(self) -> Floats:
        """All parameters as real numbers: d, n, e, those of the pairs, k, c, of complex ones real parts first."""
        mesh = [part for x in (self.k, self.c) for part in (x.real, x.imag)]
        return np.concatenate([self.d, self.n, self.e, self.basis.parameters, *mesh])

    def scaled(self, factor: float) -> Model:
        """N times a real number, and D, k, c times what leaves the same response."""
        other = factor**self.gauge
        return Model(self.basis, other * self.d, factor * self.n, other * self.k, other * self.c, self.e)

    @property
    def gauge(self) -> int:
        """Power of N's factor that D, k and c have: with N in the output, too, the deflection has 1 over the factor."""
        return 2 if self.torsional else 1

    def scale_direction(self) -> Floats:
        """Derivative of `vector` with respect to that number."""
        direction = self.gauge * self.vector()
        first = self.d.size + self.n.size
        direction[self.d.size : first] = self.n
        direction[first : self.free] = 0.0
        return direction

    def moved(self, vector: Floats) -> Model:
        """The model with these parameters; poles are kept stable."""
        sizes = [self.d.size, self.n.size, self.e.size, self.basis.pairs.size, *(4 * [self.harmonics])]
        d, n, e, pairs, k, kj, c, cj = np.split(vector, np.cumsum(sizes)[:-1])
        basis = self.basis
        if isinstance(basis, Fractions):
            basis = basis.with_parameters(pairs)
        return Model(basis, d, n, k + 1j * kj, c + 1j * cj, e)

    def functions(self, position: Floats) -> tuple[Complexes, Complexes]:
        """D and N at signed positions line / top."""
        values = self.basis.at(position)
        return values @ self.d, values @ self.n

    def columns(self, values: Complexes, omega: Floats, dte: Complexes, force: Complexes) -> Complexes:
        """Derivatives (S, P) of A Y - N U of one class for Y = `dte` and U = `force` (S,); `values`: of the basis."""
        parts = [values * dte[:, None], -values * force[:, None], np.zeros((dte.size, self.e.size), dtype=complex)]
        if isinstance(self.basis, Fractions):
            of_d, of_n = self.basis.slopes(omega, self.d), self.basis.slopes(omega, self.n)
            parts.append(of_d * dte[:, None] - of_n * force[:, None])
        return np.concatenate([*parts, mesh_columns(dte, omega, self.harmonics)], axis=1)

    def shown(self, position: Floats, dte: Complexes, force: Complexes) -> Complexes:
        """What the records show (...) of a deflection `dte` under `force`: itself, or N Y + E U."""
        if not self.torsional:
            return dte
        values = self.basis.at(position)
        return np.asarray((values @ self.n) * dte + (values @ self.e) * force)

    def shown_columns(
        self, values: Complexes, omega: Floats, inner: Complexes, dte: Complexes, force: Complexes
    ) -> Complexes:
        """Derivatives (S, P) of `shown` from those of the deflection, `inner`; else as in `columns`."""
        if not self.torsional:
            return inner
        columns = (values @ self.n)[:, None] * inner
        first, second = self.d.size, self.d.size + self.n.size
        third = second + self.e.size
        columns[:, first:second] += values * dte[:, None]
        columns[:, second:third] += values * force[:, None]
        if isinstance(self.basis, Fractions):
            slopes = self.basis.slopes(omega, self.n) * dte[:, None] + self.basis.slopes(omega, self.e) * force[:, None]
            columns[:, third : self.free] += slopes
        return columns


class Operator:
    """A of `A Y = N U` for the classes of `lines` / top (C, S), solvable for any right-hand sides."""

    def __init__(self, model: Model, omega: Floats, valid: np.ndarray) -> None:
        kept = min(model.harmonics, omega.shape[1] - 1)
        diagonal, n = model.functions(omega)
        self.n = np.where(valid, n, 0.0)
        self._matrices = MeshMatrices(
            np.where(valid, diagonal, 1.0), model.k[:kept], model.c[:kept], omega, valid
        )

    def times(self, values: Complexes) -> Complexes:
        """A `values` (C, S, m)."""
        return self._matrices.times(values)

    def solve(self, index: int, right: Complexes, even: bool = False) -> Complexes:
        """A^-1 `right` (S, m) of one class; `even`: of spectra of real signals, over negative lines as well."""
        return self._matrices.solve(index, right, even)


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
