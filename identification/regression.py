"""The local regression of a periodically time-varying system, without ever writing it down.

Row m of the regression reads Y(m) = sum_j Gs_j(m) U(m + j d) + T(m), j = -l. Lines that differ by a
multiple of d form a residue class; inside one, row m's regressors are 2L+1 successive elements. So the Gram
matrix of a window is a slice of a larger matrix that neighbouring windows share,

    W_pp'[a, b] = sum_r P_p(r) P_p'(r) C_r[a, b],   C_r = U_r^H U_r over the experiments,

and products with the regression matrix are small matrix-vector products on views.

Lines of residue class 0 carry the operating response, the same in each experiment. An orthogonal rotation
of the experiments gathers it in the first one, whose class-0 rows are then dropped: the same as one free
unknown a line. With a single experiment that means leaving class 0 out.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from gearbench.identification.spectra import Complexes, Floats, Spectra

# A line counts as excited if its rms force over the experiments exceeds this part of the largest one's.
EXCITATION_FLOOR = 1e-3


@dataclass(frozen=True)
class Window:
    """Shape of the local model: branches -L..L, polynomial order R, half-width n lines, estimated transient."""

    harmonics: int
    order: int
    half_width: int
    transient: bool

    @property
    def width(self) -> int:
        """Rows per experiment, 2n+1."""
        return 2 * self.half_width + 1

    @property
    def branches(self) -> int:
        """2L+1."""
        return 2 * self.harmonics + 1

    @property
    def unknowns(self) -> int:
        """Polynomial coefficients of the branches, (R+1)(2L+1); those of transients are projected out."""
        return (self.order + 1) * self.branches

    def basis(self) -> Floats:
        """Legendre polynomials (2n+1, R+1) over the window."""
        r = np.arange(-self.half_width, self.half_width + 1) / max(self.half_width, 1)
        return np.asarray(legendre.legvander(r, self.order), dtype=float)


@dataclass(frozen=True)
class Regression:
    """Force and DTE of all experiments, sorted by residue class; made by `prepare`.

    `force`, `dte` (d, E, Q): line k is at [k mod d, :, k // d + origin]; `excited` (d, Q). `same_phase`:
    all records begin at the same mesh phase, so the operating response has been rotated into experiment 0;
    otherwise, where transients are estimated, class 0 is left out of every experiment. `start_phase` (E,)
    [cycles] of the records before they were shifted.
    """

    force: Complexes
    dte: Complexes
    excited: NDArray[np.bool_]
    origin: int
    highest: int
    same_phase: bool
    start_phase: Floats
    _transients: dict[tuple[int, Window], Complexes] = field(default_factory=dict, repr=False)

    @property
    def mesh_lines(self) -> int:
        """Lines between mesh harmonics, d."""
        return self.force.shape[0]

    @property
    def experiments(self) -> int:
        """Number of experiments E."""
        return self.force.shape[1]

    @property
    def operating_rows_lost(self) -> int:
        """Experiments whose row is dropped on a line of class 0."""
        return 1 if self.same_phase else self.experiments

    def input_power(self) -> float:
        """Mean of |U|^2 over experiments and excited lines [N^2]."""
        return float(np.sum(np.abs(self.force) ** 2) / (self.experiments * np.count_nonzero(self.excited)))

    def last_row(self, harmonics: int) -> int:
        """Highest line whose response any excited line reaches through `harmonics` branches."""
        residue, position = np.nonzero(self.excited)
        return min(
            int(((position - self.origin) * self.mesh_lines + residue).max()) + harmonics * self.mesh_lines,
            self.highest,
        )

    def locate(self, line: int) -> tuple[int, int]:
        """Residue class and position inside it of a line."""
        return line % self.mesh_lines, line // self.mesh_lines + self.origin

    def rows(self, centre: int, window: Window) -> list[tuple[int, int]]:
        """Residue class and position of each row of the window around `centre`."""
        return [self.locate(centre + r) for r in range(-window.half_width, window.half_width + 1)]

    def data(self, centre: int, window: Window) -> Complexes:
        """Y (E, 2n+1) of a window, transients projected out; without transients rows that no input excites are 0."""
        places = self.rows(centre, window)
        data = np.stack([self.dte[c][:, q] for c, q in places], axis=1)
        if window.transient:
            return self.project(data, centre, window)
        reach = window.harmonics
        data[:, [not self.excited[c, q - reach : q + reach + 1].any() for c, q in places]] = 0.0
        return data

    def project(self, data: Complexes, centre: int, window: Window) -> Complexes:
        """`data` (E, 2n+1) without its part in the space of the transients' polynomials."""
        if not window.transient:
            return data
        basis = self.transient_basis(centre, window)
        data = data * (np.abs(basis).sum(axis=2) > 0)
        return data - np.einsum("erp,ep->er", basis, np.einsum("erp,er->ep", basis.conj(), data))

    def transient_basis(self, centre: int, window: Window) -> Complexes:
        """Orthonormal polynomials (E, 2n+1, R+1) of the transients; 0 on rows that are left out."""
        key = (centre % self.mesh_lines, window)
        if key not in self._transients:
            r = np.arange(-window.half_width, window.half_width + 1)
            turn = np.exp(-2j * np.pi * np.outer(self.start_phase, r) / self.mesh_lines)
            columns = window.basis() * turn[:, :, None]
            operating = (centre + r) % self.mesh_lines == 0
            columns[: self.operating_rows_lost, operating] = 0.0
            left, strength, _ = np.linalg.svd(columns, full_matrices=False)
            # Fewer rows than coefficients (all but a few left out): keep only the directions that exist.
            self._transients[key] = left * (strength > 1e-10 * strength.max())[:, None, :]
        return self._transients[key]

    def apply(self, coefficients: Complexes, centre: int, window: Window) -> Complexes:
        """Model output (E, 2n+1) of the coefficients (R+1, 2L+1), transients projected out."""
        local = window.basis() @ coefficients
        reach = window.harmonics
        output = np.empty((self.experiments, window.width), dtype=complex)
        for row, (c, q) in enumerate(self.rows(centre, window)):
            output[:, row] = self.force[c][:, q - reach : q + reach + 1] @ local[row]
        return self.project(output, centre, window)

    def adjoint(self, data: Complexes, centre: int, window: Window) -> Complexes:
        """Product (R+1, 2L+1) of the regression's conjugate transpose with (projected) data (E, 2n+1)."""
        reach = window.harmonics
        local = np.empty((window.width, window.branches), dtype=complex)
        flipped = data.conj()
        for row, (c, q) in enumerate(self.rows(centre, window)):
            local[row] = flipped[:, row] @ self.force[c][:, q - reach : q + reach + 1]
        return np.asarray(window.basis().T @ local.conj(), dtype=complex)

    def matrix(self, centre: int, window: Window) -> Complexes:
        """The regression written down: (E, 2n+1, R+1, 2L+1), transients projected out."""
        reach = window.harmonics
        places = self.rows(centre, window)
        inputs: Complexes = np.stack([self.force[c][:, q - reach : q + reach + 1] for c, q in places], axis=1)
        full: Complexes = inputs[:, :, None, :] * window.basis()[None, :, :, None]
        if window.transient:
            basis = self.transient_basis(centre, window)
            full *= (np.abs(basis).sum(axis=2) > 0)[:, :, None, None]
            full -= np.einsum("erp,epsj->ersj", basis, np.einsum("erp,ersj->epsj", basis.conj(), full))
        return np.asarray(full, dtype=complex)

    def columns(self, centre: int, window: Window) -> NDArray[np.bool_]:
        """Which coefficients (R+1, 2L+1) the window can know: order p needs p+1 rows that excite the branch."""
        reach = window.harmonics
        count = np.zeros(window.branches, dtype=int)
        for c, q in self.rows(centre, window):
            if c or self.experiments > self.operating_rows_lost:
                count += self.excited[c, q - reach : q + reach + 1]
        return np.arange(window.order + 1)[:, None] < count[None, :]

    def equations(self, centre: int, window: Window) -> int:
        """Complex equations of the window that are left once operating response and transients are taken out."""
        reach = window.harmonics
        total = 0
        for c, q in self.rows(centre, window):
            if window.transient or self.excited[c, q - reach : q + reach + 1].any():
                total += self.experiments - (self.operating_rows_lost if c == 0 else 0)
        if window.transient:
            basis = self.transient_basis(centre, window)
            total -= int(np.count_nonzero(np.abs(basis).sum(axis=1) > 0))
        return total

    def gram_table(self, first: int, last: int, window: Window) -> Complexes:
        """W_pp' (pairs p <= p', M, M) for the centres first, first + d, ..., last of one residue class.

        The Gram matrix of the centre first + i d, without the transients' part, is W[:, i : i+2L+1, i :
        i+2L+1].
        """
        basis, reach, d = window.basis(), window.harmonics, self.mesh_lines
        pairs = _pairs(window.order)
        weights = np.stack([basis[:, p] * basis[:, s] for p, s in pairs])
        size = (last - first) // d + window.branches
        table = np.zeros((len(pairs), size, size), dtype=complex)
        rows = self.rows(first, window)
        for c in sorted({c for c, _ in rows}):
            positions = [q for cc, q in rows if cc == c]
            begin = min(positions) - reach
            inputs = self.force[c][:, begin : max(positions) - reach + size]
            gram = inputs.conj().T @ inputs
            for row, (cc, q) in enumerate(rows):
                if cc == c:
                    shift = q - reach - begin
                    part = gram[shift : shift + size, shift : shift + size]
                    for pair, weight in enumerate(weights[:, row]):
                        if weight:
                            table[pair] += weight * part
        return table

    def transient_products(self, centre: int, window: Window) -> Complexes:
        """Q^H A (E (R+1), unknowns): what the projection takes from the Gram matrix is its own Gram matrix."""
        reach, basis = window.harmonics, window.basis()
        transient = self.transient_basis(centre, window).conj()
        result = np.zeros((self.experiments, window.order + 1, window.order + 1, window.branches), dtype=complex)
        for row, (c, q) in enumerate(self.rows(centre, window)):
            weight = transient[:, row, :, None] * basis[row]
            result += weight[..., None] * self.force[c][:, None, None, q - reach : q + reach + 1]
        return result.reshape(-1, window.unknowns)


def _pairs(order: int) -> list[tuple[int, int]]:
    return [(p, s) for p in range(order + 1) for s in range(p, order + 1)]


def gram_of(table: Complexes, index: int, window: Window) -> Complexes:
    """Gram matrix (unknowns, unknowns) of the centre first + index d from `Regression.gram_table`."""
    size = window.branches
    gram = np.empty((window.order + 1, size, window.order + 1, size), dtype=complex)
    for pair, (p, s) in enumerate(_pairs(window.order)):
        part = table[pair, index : index + size, index : index + size]
        gram[p, :, s, :] = part
        if p != s:
            gram[s, :, p, :] = part
    return gram.reshape(window.unknowns, window.unknowns)


def prepare(spectra: Spectra, *, transient: bool, reach: int) -> Regression:
    """Sort the spectra by residue class; `reach` lines beyond the highest one are padded with zeros.

    Each record is shifted in time to mesh phase 0 at its start, so that branches refer to the mesh phase.
    """
    d, highest = spectra.mesh_lines, spectra.highest
    phase = spectra.start_phase % 1.0
    same = bool(np.abs(spectra.relative()).max() < 1e-9) or not transient
    force, dte = (_two_sided(s, phase, d) for s in (spectra.force, spectra.dte))
    if spectra.realisations > 1 and same:
        force, dte = _rotate(force), _rotate(dte)
    lost = 1 if same else spectra.realisations
    operating = np.arange(-highest, highest + 1) % d == 0
    force[:lost, operating] = 0.0
    dte[:lost, operating] = 0.0
    strength = np.sqrt(np.mean(np.abs(force) ** 2, axis=0))
    # Line 0 holds what means differ by between records, which may be any size.
    excited = strength > EXCITATION_FLOOR * np.delete(strength, highest).max()
    force[:, ~excited] = 0.0
    origin = -((-highest - reach) // d)
    count = (highest + reach) // d + 1 + origin
    arrays = [np.zeros((d, spectra.realisations, count), dtype=complex) for _ in range(2)]
    mask = np.zeros((d, count), dtype=bool)
    for c in range(d):
        lines = np.arange(-highest, highest + 1)
        chosen = lines[lines % d == c]
        place = chosen // d + origin
        for array, source in zip(arrays, (force, dte), strict=True):
            array[c][:, place] = source[:, chosen + highest]
        mask[c, place] = excited[chosen + highest]
    return Regression(arrays[0], arrays[1], mask, origin, highest, same, phase)


def _two_sided(one_sided: Complexes, phase: Floats, mesh_lines: int) -> Complexes:
    """Lines -K..K (E, 2K+1), delayed so that the record begins at mesh phase 0."""
    full = np.concatenate([one_sided[:, :0:-1].conj(), one_sided], axis=1)
    lines = np.arange(full.shape[1]) - (one_sided.shape[1] - 1)
    return full * np.exp(-2j * np.pi * np.outer(phase, lines) / mesh_lines)


def _rotate(values: Complexes) -> Complexes:
    """Householder reflection of the experiments that turns their mean into experiment 0."""
    count = values.shape[0]
    direction = np.full(count, 1.0 / np.sqrt(count))
    direction[0] -= 1.0
    direction /= np.linalg.norm(direction)
    return values - 2.0 * np.outer(direction, direction @ values)
