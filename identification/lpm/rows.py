"""The rows of the local regression around some lines: gathered once, used for every product with them.

All arrays have the windows as their first axis, so that small windows cost numpy's calls once for many of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.regression import Regression, Window
from gearbench.identification.spectra.joint import Complexes, Floats

Lines = NDArray[np.int64]


@dataclass(frozen=True)
class WindowRows:
    """Rows c - n .. c + n of the regression for each of the `centres` c (B,); what is asked for is gathered when it is
    first asked for."""

    regression: Regression
    centres: Lines
    window: Window

    def part(self, index: int) -> WindowRows:
        """Window number `index` alone."""
        return replace(self, centres=self.centres[index : index + 1])

    @cached_property
    def _place(self) -> tuple[Lines, Lines]:
        """Residue class and position (B, 2n+1) of each row."""
        lines = self.centres[:, None] + np.arange(-self.window.half_width, self.window.half_width + 1)
        residue = lines % self.regression.mesh_lines
        return residue, (lines - residue) // self.regression.mesh_lines + self.regression.origin

    @cached_property
    def inputs(self) -> Complexes:
        """Regressors (B, 2n+1, E, 2L+1): U(m + j d) for j = -L..L."""
        residue, position = self._place
        force, _ = self.regression.sliding(self.window.harmonics)
        return force[residue, :, position - self.window.harmonics]

    @cached_property
    def excited(self) -> NDArray[np.bool_]:
        """Which regressors (B, 2n+1, 2L+1) are excited."""
        residue, position = self._place
        _, excited = self.regression.sliding(self.window.harmonics)
        return excited[residue, position - self.window.harmonics]

    @cached_property
    def transients(self) -> Complexes:
        """Orthonormal polynomials (B, E, 2n+1, R+1) of the transients."""
        return np.stack([self.regression.transient_basis(int(centre), self.window) for centre in self.centres])

    @cached_property
    def observed(self) -> Complexes:
        """Y (B, E, 2n+1) as it was recorded."""
        residue, position = self._place
        return np.asarray(self.regression.dte[residue, :, position].transpose(0, 2, 1))

    @cached_property
    def data(self) -> Complexes:
        """Y (B, E, 2n+1), transients projected out; without transients rows that no input excites are 0."""
        data = self.observed
        if not self.window.transient:
            data = data * np.asarray(self.excited.any(axis=2))[:, None]
        return self.project(data)

    @cached_property
    def power(self) -> Floats:
        """Mean (B,) of |Y|^2 over rows and experiments [m^2]."""
        return np.asarray(np.mean(np.abs(self.observed) ** 2, axis=(1, 2)))

    def project(self, data: Complexes) -> Complexes:
        """`data` (B, E, 2n+1) without its part in the space of the transients' polynomials."""
        if not self.window.transient:
            return data
        basis = self.transients
        data = data * (np.abs(basis).sum(axis=3) > 0)
        taken = data[:, :, None, :] @ basis.conj()
        return np.asarray(data - (basis @ taken.transpose(0, 1, 3, 2))[..., 0])

    def apply(self, coefficients: Complexes) -> Complexes:
        """Model output (B, E, 2n+1) of the coefficients (B, R+1, 2L+1), transients projected out."""
        local = self._flat @ coefficients.transpose(0, 2, 1)
        local = local.reshape(self.centres.size, self.window.width, -1, self.window.order + 1)
        return self.project(np.einsum("brep,rp->ber", local, self.window.basis()))

    def adjoint(self, data: Complexes) -> Complexes:
        """Product (B, R+1, 2L+1) of the regression's conjugate transpose with (projected) data (B, E, 2n+1)."""
        weights = self.window.basis().T[:, :, None] * data.conj().transpose(0, 2, 1)[:, None]
        weights = weights.reshape(self.centres.size, self.window.order + 1, -1)
        return np.asarray((weights @ self._flat).conj())

    @property
    def _flat(self) -> Complexes:
        """Regressors (B, (2n+1) E, 2L+1)."""
        return self.inputs.reshape(self.centres.size, -1, self.window.branches)

    def matrix(self, *, projected: bool = True) -> Complexes:
        """The regression written down: (B, E, 2n+1, R+1, 2L+1); transients projected out unless told otherwise."""
        inputs = self.inputs.transpose(0, 2, 1, 3)
        full: Complexes = inputs[:, :, :, None, :] * self.window.basis()[:, :, None]
        if self.window.transient and projected:
            basis = self.transients
            full *= (np.abs(basis).sum(axis=3) > 0)[..., None, None]
            full -= np.einsum("berp,bepsj->bersj", basis, np.einsum("berp,bersj->bepsj", basis.conj(), full))
        return full

    @cached_property
    def columns(self) -> NDArray[np.bool_]:
        """Which coefficients (B, R+1, 2L+1) the window can know.

        Order p needs p+1 rows that excite the branch and, for p > 0, that they span more than p / (R+1) of the window:
        a branch that is excited at one edge only is known there, and not a polynomial over all of the window.
        """
        excited: NDArray[np.bool_] = self.excited
        width = self.window.width
        if self.regression.experiments <= self.regression.operating_rows_lost:
            excited = np.asarray(excited & (self._place[0] != 0)[:, :, None], dtype=bool)
        count = excited.sum(axis=1)
        span = np.where(count > 0, width - excited[:, ::-1].argmax(axis=1) - excited.argmax(axis=1), 0)[:, None]
        order = np.arange(self.window.order + 1)[:, None]
        return np.asarray((order < count[:, None]) & (order * width < span * (self.window.order + 1)), dtype=bool)

    @cached_property
    def equations(self) -> Lines:
        """Complex equations (B,) that are left once operating response and transients are taken out."""
        used: NDArray[np.bool_] = np.ones((self.centres.size, self.window.width), dtype=bool)
        if not self.window.transient:
            used = np.asarray(self.excited.any(axis=2), dtype=bool)
        total = used.sum(axis=1) * self.regression.experiments
        total -= (used & (self._place[0] == 0)).sum(axis=1) * self.regression.operating_rows_lost
        if self.window.transient:
            total -= np.count_nonzero(np.abs(self.transients).sum(axis=2) > 0, axis=(1, 2))
        return np.asarray(total, dtype=np.int64)

    @property
    def unknowns(self) -> Lines:
        """Polynomial coefficients (B,) that the window can know."""
        return np.asarray(self.columns.sum(axis=(1, 2)), dtype=np.int64)

    def transient_products(self) -> Complexes:
        """Q^H A (B, E (R+1), unknowns): what the projection takes from the Gram matrix is its own Gram matrix."""
        weights = self.transients.conj()[..., :, None] * self.window.basis()[:, None, :]
        weights = weights.reshape(*self.transients.shape[:3], -1).transpose(0, 1, 3, 2)
        products = weights @ self.inputs.transpose(0, 2, 1, 3)
        return np.asarray(products.reshape(self.centres.size, -1, self.window.unknowns))
