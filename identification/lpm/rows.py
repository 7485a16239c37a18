"""The rows of the local regression around one line: gathered once, used for every product with it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.regression import Regression, Window
from gearbench.identification.spectra.joint import Complexes


@dataclass(frozen=True)
class WindowRows:
    """Rows `centre` - n .. `centre` + n of the regression; what is asked for is gathered when it is first asked for."""

    regression: Regression
    centre: int
    window: Window

    @cached_property
    def _place(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Residue class and position of each row."""
        lines = self.centre + np.arange(-self.window.half_width, self.window.half_width + 1)
        residue = lines % self.regression.mesh_lines
        return residue, (lines - residue) // self.regression.mesh_lines + self.regression.origin

    @cached_property
    def inputs(self) -> Complexes:
        """Regressors (2n+1, E, 2L+1): U(m + j d) for j = -L..L."""
        residue, position = self._place
        force, _ = self.regression.sliding(self.window.harmonics)
        return force[residue, :, position - self.window.harmonics]

    @cached_property
    def excited(self) -> NDArray[np.bool_]:
        """Which regressors (2n+1, 2L+1) are excited."""
        residue, position = self._place
        _, excited = self.regression.sliding(self.window.harmonics)
        return excited[residue, position - self.window.harmonics]

    @cached_property
    def transients(self) -> Complexes:
        """Orthonormal polynomials (E, 2n+1, R+1) of the transients."""
        return self.regression.transient_basis(self.centre, self.window)

    @cached_property
    def data(self) -> Complexes:
        """Y (E, 2n+1), transients projected out; without transients rows that no input excites are 0."""
        residue, position = self._place
        data = self.regression.dte[residue, :, position].T
        if not self.window.transient:
            data = data * self.excited.any(axis=1)
        return self.project(data)

    @cached_property
    def power(self) -> float:
        """Mean of |Y|^2 over rows and experiments [m^2]."""
        residue, position = self._place
        return float(np.mean(np.abs(self.regression.dte[residue, :, position]) ** 2))

    def project(self, data: Complexes) -> Complexes:
        """`data` (E, 2n+1) without its part in the space of the transients' polynomials."""
        if not self.window.transient:
            return data
        basis = self.transients
        data = data * (np.abs(basis).sum(axis=2) > 0)
        taken = (data[:, None, :] @ basis.conj())[:, 0]
        return np.asarray(data - (basis @ taken[:, :, None])[:, :, 0])

    def apply(self, coefficients: Complexes) -> Complexes:
        """Model output (E, 2n+1) of the coefficients (R+1, 2L+1), transients projected out."""
        local = self.window.basis() @ coefficients
        return self.project((self.inputs @ local[:, :, None])[:, :, 0].T)

    def adjoint(self, data: Complexes) -> Complexes:
        """Product (R+1, 2L+1) of the regression's conjugate transpose with (projected) data (E, 2n+1)."""
        local = (data.T.conj()[:, None, :] @ self.inputs)[:, 0]
        return np.asarray(self.window.basis().T @ local.conj(), dtype=complex)

    def matrix(self, *, projected: bool = True) -> Complexes:
        """The regression written down: (E, 2n+1, R+1, 2L+1); transients projected out unless told otherwise."""
        inputs = self.inputs.transpose(1, 0, 2)
        full: Complexes = inputs[:, :, None, :] * self.window.basis()[None, :, :, None]
        if self.window.transient and projected:
            basis = self.transients
            full *= (np.abs(basis).sum(axis=2) > 0)[:, :, None, None]
            full -= np.einsum("erp,epsj->ersj", basis, np.einsum("erp,ersj->epsj", basis.conj(), full))
        return full

    @cached_property
    def columns(self) -> NDArray[np.bool_]:
        """Which coefficients (R+1, 2L+1) the window can know.

        Order p needs p+1 rows that excite the branch and, for p > 0, that they span more than p / (R+1) of the window:
        a branch that is excited at one edge only is known there, and not a polynomial over all of the window.
        """
        excited: NDArray[np.bool_] = self.excited
        if self.regression.experiments <= self.regression.operating_rows_lost:
            excited = np.asarray(excited & (self._place[0] != 0)[:, None], dtype=bool)
        count = excited.sum(axis=0)
        span = np.where(count > 0, excited.shape[0] - excited[::-1].argmax(axis=0) - excited.argmax(axis=0), 0)
        order = np.arange(self.window.order + 1)[:, None]
        return (order < count) & (order * excited.shape[0] < span * (self.window.order + 1))

    @cached_property
    def equations(self) -> int:
        """Complex equations that are left once operating response and transients are taken out."""
        used: NDArray[np.bool_] = np.ones(self.window.width, dtype=bool)
        if not self.window.transient:
            used = np.asarray(self.excited.any(axis=1), dtype=bool)
        total = int(used.sum()) * self.regression.experiments
        total -= int(used[self._place[0] == 0].sum()) * self.regression.operating_rows_lost
        if self.window.transient:
            total -= int(np.count_nonzero(np.abs(self.transients).sum(axis=1) > 0))
        return total

    @property
    def unknowns(self) -> int:
        """Polynomial coefficients that the window can know."""
        return int(self.columns.sum())

    def transient_products(self) -> Complexes:
        """Q^H A (E (R+1), unknowns): what the projection takes from the Gram matrix is its own Gram matrix."""
        weights = self.transients.conj()[:, :, :, None] * self.window.basis()[None, :, None, :]
        weights = weights.reshape(self.regression.experiments, self.window.width, -1).transpose(0, 2, 1)
        products = weights @ self.inputs.transpose(1, 0, 2)
        return np.asarray(products.reshape(-1, self.window.unknowns))
