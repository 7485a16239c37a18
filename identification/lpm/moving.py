"""Local regression at a speed that varies: branch l reads the force turned with the measured mesh phase.

    Y(k) = sum_l DFT{ exp(j l theta / 2) H_l * (exp(j l theta / 2) F) },    H_l(w) = G_l(w - l ws / 2)

A branch's transfer depends on the speed. Turned half before and half after the filter (Weyl's symmetric order; Folland,
Harmonic Analysis in Phase Space, 1989, chapter 2), that dependence begins with the square of the mesh frequency only:
the inverse of a slowly varying operator has no term of first order in this order, but one in the others. H_l is a
polynomial around w_m, the middle between input and output line at the mean speed. At a mesh frequency that is `shift`
lines above the mean, row c + r reads it at r - l shift / 2, so that with z = exp(j l theta) F the columns are

    sum_i P^(i)(r) / i! (-l / 2)^i DFT{shift^i z}(c + r)          (P: Legendre polynomials, by Taylor's series),

the same number of unknowns as at constant speed, and at the mean speed the same result: G_l on the lines k = m - l d.
Products of shift and r are taken as if they commuted: what is left out is the speed's change during the response's
memory. The operating response no longer keeps to lines: it is exp(j l theta) with an amplitude of its own for each
order, which is left free (`operating`) or counts as noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.regression import Regression, Window, sorted_lines
from gearbench.identification.lpm.rows import WindowRows
from gearbench.identification.spectra.course import Course
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra

# Part of the turning that stands behind the filter.
BEHIND = 0.5
# Bytes that the spectra of the turned force may take, and highest order of polynomials.
BYTES = 8e8
HIGHEST_ORDER = 4
# Speeds of a record that are looked at, and part of them at which a line must be excited to count.
LEVELS, REACHED = 50, 0.03
# Part (rms) of an order's operating response that may lie in a window without being left free there.
LEFT = 0.05


@dataclass(frozen=True, kw_only=True)
class MovingRegression(Regression):
    """A regression whose inputs are turned with the mesh phase; made by `prepare_moving`.

    `moments` (I, E, 2J+1, S): DFT{shift^i exp(-j j theta) F} for j = -J..J on the lines -`before`..S - 1 - `before`;
    `reached` (2J+1, S): where a branch is excited; `orders` (E, O, S): DFT{exp(j o theta)}, o = 0..O-1; `swings` (2,):
    least and largest shift [lines]; `operating`: whether the operating response is left free.
    """

    moments: Complexes
    reached: NDArray[np.bool_]
    orders: Complexes
    before: int
    swings: tuple[float, float]
    operating: bool

    @property
    def operating_rows_lost(self) -> int:
        """None: the operating response does not keep to lines."""
        return 0

    def place(self, centres: NDArray[np.int64], half_width: int) -> NDArray[np.int64]:
        """Places (B, 2n+1) of the windows' lines in the last axis of the arrays."""
        lines = centres[:, None] + np.arange(-half_width, half_width + 1) + self.before
        return np.asarray(np.clip(lines, 0, self.moments.shape[3] - 1), dtype=np.int64)

    def transient_basis(self, centre: int, window: Window) -> Complexes:
        """Orthonormal columns (E, 2n+1, C): polynomials, and the orders of the operating response that reach it."""
        smooth, _ = np.linalg.qr(window.basis())
        basis = np.broadcast_to(smooth, (self.experiments, *smooth.shape)).astype(complex)
        if not self.operating:
            return np.asarray(basis)
        reaching = self._reaching(centre, window.half_width)
        columns = self.orders[:, reaching][:, :, self.place(np.array([centre]), window.half_width)[0]]
        columns = columns.transpose(0, 2, 1)
        columns = columns - smooth @ (smooth.T @ columns)
        left, strength, _ = np.linalg.svd(columns, full_matrices=False)
        free: Complexes = np.zeros((self.experiments, window.width, self._most(window)), dtype=complex)
        free[:, :, : left.shape[2]] = left * (strength > LEFT)[:, None, :]
        return np.concatenate([basis, free], axis=2)

    def _reaching(self, centre: int, half_width: int) -> NDArray[np.int64]:
        """Orders whose frequency passes through the window."""
        order = np.arange(self.orders.shape[1])
        low, high = (order * (self.mesh_lines + swing) for swing in self.swings)
        return np.flatnonzero((high >= centre - half_width - 1) & (low <= centre + half_width + 1))

    def _most(self, window: Window) -> int:
        """Most orders that reach a window."""
        most = self._reaching(self.highest - window.half_width, window.half_width).size
        return min(window.width, max(most, self._reaching(0, window.half_width).size) + 2)


def prepare_moving(
    spectra: Spectra, course: Course, *, harmonics: int, order: int, half_width: int, operating: bool
) -> MovingRegression:
    """Spectra of the force turned by up to `harmonics` branches, for windows up to `half_width` and polynomials up to
    `order`. Raises LpmError where they take more than BYTES."""
    highest, size = spectra.highest, course.force.shape[1]
    before, experiments = min(half_width, size // 2 - 1), spectra.realisations
    count = highest + 1 + before
    branches = 2 * harmonics + 1
    if 16.0 * count * experiments * branches * (order + 1) > BYTES:
        raise LpmError(
            f"harmonics = {harmonics} at a speed that varies take {experiments} x {branches} turned spectra of"
            f" {order + 1} x {count} lines, more than {BYTES / 1e9:g} GB; at most"
            f" {most_harmonics(spectra, experiments, order, half_width)} fit"
        )
    moments: Complexes = np.empty((order + 1, experiments, branches, count), dtype=complex)
    lines = np.arange(-before, highest + 1)
    for row in range(experiments):
        for j in range(harmonics + 1):
            turned = np.exp(-2j * np.pi * j * course.cycles[row]) * course.force[row]
            for power in range(order + 1):
                whole = np.fft.fft(turned) / size
                moments[power, row, harmonics + j] = whole[lines]
                moments[power, row, harmonics - j] = whole[-lines].conj()
                turned = turned * course.shift[row]
    strong = (np.arange(highest + 1) >= course.lowest) & (np.arange(highest + 1) <= course.excited)
    force, dte = (np.concatenate([s[:, :0:-1].conj(), s], axis=1) for s in (spectra.force, spectra.dte))
    both = np.concatenate([strong[:0:-1], strong])
    force, dte = force * both, dte - np.where(np.arange(-highest, highest + 1) == 0, dte, 0.0)
    sorted_force, sorted_dte, excited, origin = sorted_lines(force, dte, both, spectra.mesh_lines, spectra.mesh_lines)
    return MovingRegression(
        sorted_force, sorted_dte, excited, origin, highest, True, spectra.start_phase,
        moments=moments, reached=_reached(course, lines, harmonics, spectra.mesh_lines),
        orders=_orders(course, lines, spectra, operating), before=before,
        swings=(float(course.shift.min()), float(course.shift.max())), operating=operating,
    )  # fmt: skip


def most_harmonics(spectra: Spectra, experiments: int, order: int, half_width: int) -> int:
    """Branches a side whose turned spectra fit into BYTES."""
    each = 16.0 * (spectra.highest + 1 + half_width) * experiments * (order + 1)
    return max(0, int((BYTES / each - 1) / 2))


def _orders(course: Course, lines: NDArray[np.int64], spectra: Spectra, operating: bool) -> Complexes:
    """DFT{exp(j o theta)} (E, O, S) of all orders that reach the lines; none unless they are left free."""
    least = spectra.mesh_lines + float(course.shift.min())
    count = int(spectra.highest / max(least, 1.0)) + 2 if operating else 0
    found: Complexes = np.empty((spectra.realisations, count, lines.size), dtype=complex)
    for row, cycles in enumerate(course.cycles):
        for order in range(count):
            found[row, order] = (np.fft.fft(np.exp(2j * np.pi * order * cycles)) / cycles.size)[lines]
    return found


def _reached(course: Course, lines: NDArray[np.int64], harmonics: int, mesh_lines: int) -> NDArray[np.bool_]:
    """Where (2J+1, S) a branch's source is an excited line at enough of the record's speeds."""
    speeds = mesh_lines + np.quantile(course.shift, (np.arange(LEVELS) + 0.5) / LEVELS)
    branch = np.arange(-harmonics, harmonics + 1)
    share = np.zeros((branch.size, lines.size))
    for speed in speeds:
        source = np.abs(lines + branch[:, None] * speed)
        share += (source >= course.lowest - 0.5) & (source <= course.excited + 0.5)
    return np.asarray(share > REACHED * LEVELS, dtype=bool)


@dataclass(frozen=True)
class MovingRows(WindowRows):
    """Rows of a `MovingRegression`."""

    regression: MovingRegression

    @cached_property
    def excited(self) -> NDArray[np.bool_]:
        """Which regressors (B, 2n+1, 2L+1) are excited."""
        place = self.regression.place(self.centres, self.window.half_width)
        return np.asarray(self.regression.reached[self._branches][:, place].transpose(1, 2, 0), dtype=bool)

    @property
    def _branches(self) -> slice:
        middle = self.regression.reached.shape[0] // 2
        return slice(middle - self.window.harmonics, middle + self.window.harmonics + 1)

    @cached_property
    def plain(self) -> Complexes:
        """The regression (B, E, 2n+1, R+1, 2L+1), nothing projected out."""
        window, place = self.window, self.regression.place(self.centres, self.window.half_width)
        j = np.arange(-window.harmonics, window.harmonics + 1)
        result: Complexes = np.zeros(
            (self.centres.size, self.regression.experiments, window.width, window.order + 1, j.size), dtype=complex
        )
        for power, derivative in enumerate(_taylor(window)):
            # (E, 2L+1, B, 2n+1) -> (B, E, 2n+1, 1, 2L+1); l = -j.
            moment = self.regression.moments[power][:, self._branches][:, :, place].transpose(2, 0, 3, 1)
            factor = (BEHIND * j / max(window.half_width, 1)) ** power
            result += (moment * factor)[:, :, :, None, :] * derivative[:, :, None]
        return result

    def matrix(self, *, projected: bool = True) -> Complexes:
        """The regression written down: (B, E, 2n+1, R+1, 2L+1); transients projected out unless told otherwise."""
        if not projected:
            return self.plain
        basis, full = self.transients, self.plain
        return np.asarray(full - np.einsum("berp,bepsj->bersj", basis, self._taken(full).reshape(
            *basis.shape[:2], basis.shape[3], *full.shape[3:]
        )))  # fmt: skip

    def _taken(self, full: Complexes) -> Complexes:
        """Q^H A (B, E, C, unknowns)."""
        flat = full.reshape(*full.shape[:3], -1)
        return np.asarray(self.transients.conj().transpose(0, 1, 3, 2) @ flat)

    def apply(self, coefficients: Complexes) -> Complexes:
        """Model output (B, E, 2n+1) of the coefficients (B, R+1, 2L+1), transients projected out."""
        flat = self.plain.reshape(self.centres.size, -1, self.window.unknowns)
        local = flat @ coefficients.reshape(self.centres.size, -1, 1)
        return self.project(local.reshape(self.centres.size, -1, self.window.width))

    def adjoint(self, data: Complexes) -> Complexes:
        """Product (B, R+1, 2L+1) of the regression's conjugate transpose with (projected) data (B, E, 2n+1)."""
        flat = self.plain.reshape(self.centres.size, -1, self.window.unknowns)
        found = data.conj().reshape(self.centres.size, 1, -1) @ flat
        return np.asarray(found.conj().reshape(self.centres.size, self.window.order + 1, -1))

    def transient_products(self) -> Complexes:
        """Q^H A (B, E C, unknowns)."""
        return np.asarray(self._taken(self.plain).reshape(self.centres.size, -1, self.window.unknowns))


def _taylor(window: Window) -> list[Floats]:
    """P_p^(i) / i! (2n+1, R+1) over the window for i = 0..R."""
    r = np.arange(-window.half_width, window.half_width + 1) / max(window.half_width, 1)
    unit = np.eye(window.order + 1)
    return [
        np.stack([legendre.legval(r, legendre.legder(one, i)) / factorial(i) for one in unit], axis=1)
        for i in range(window.order + 1)
    ]
