"""Spectra sorted for the local regression of a periodically time-varying system.

Row m of the regression reads Y(m) = sum_j Gs_j(m) U(m + j d) + T(m), j = -l. Lines that differ by a multiple of d form
a residue class; inside one, row m's regressors are 2L+1 successive elements of the input.

Lines of residue class 0 carry the operating response, the same in each experiment. An orthogonal rotation of the
experiments gathers it in the first one, whose class-0 rows are then dropped: the same as one free unknown a line. With
a single experiment that means leaving class 0 out.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial import legendre
from numpy.typing import NDArray

from gearbench.identification.spectra.folded import folded_harmonics
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra

Values = TypeVar("Values", Floats, Complexes)

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
        """Legendre polynomials (2n+1, R+1) over the window; read-only."""
        return _basis(self.half_width, self.order)


@lru_cache(maxsize=256)
def _basis(half_width: int, order: int) -> Floats:
    r = np.arange(-half_width, half_width + 1) / max(half_width, 1)
    basis = np.asarray(legendre.legvander(r, order), dtype=float)
    basis.setflags(write=False)
    return basis


@dataclass(frozen=True)
class Regression:
    """Force and DTE of all experiments, sorted by residue class; made by `prepare`.

    `force`, `dte` (d, E, Q): line k is at [k mod d, :, k // d + origin]; `excited` (d, Q). `same_phase`:
    all records begin at the same mesh phase, so the operating response has been rotated into experiment 0;
    otherwise, where transients are estimated, class 0 is left out of every experiment. `start_phase` (E,)
    [cycles] of the records before they were shifted. `folded`: lines beside class 0 onto which the operating
    response may have folded.
    """

    force: Complexes
    dte: Complexes
    excited: NDArray[np.bool_]
    origin: int
    highest: int
    same_phase: bool
    start_phase: Floats
    folded: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64), kw_only=True)
    _transients: dict[tuple[int, Window], Complexes] = field(default_factory=dict, repr=False)
    _views: dict[int, tuple[Complexes, NDArray[np.bool_]]] = field(default_factory=dict, repr=False)

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

    def runs(self, centre: int, window: Window) -> list[tuple[int, NDArray[np.int64], int]]:
        """The window's rows by residue class: class, indices of its rows in the window, position of the first.

        Rows of one class follow each other at successive positions.
        """
        lines = np.arange(centre - window.half_width, centre + window.half_width + 1)
        d = self.mesh_lines
        return [
            (int(first % d), np.arange(index, window.width, d), int(first // d) + self.origin)
            for index, first in enumerate(lines[: min(d, window.width)])
        ]

    def sliding(self, reach: int) -> tuple[Complexes, NDArray[np.bool_]]:
        """All runs of 2 `reach` + 1 successive elements of `force` and `excited`, as views."""
        if reach not in self._views:
            width = 2 * reach + 1
            force = sliding_window_view(self.force, width, axis=2)
            self._views[reach] = force, sliding_window_view(self.excited, width, axis=1)
        return self._views[reach]

    def transient_basis(self, centre: int, window: Window) -> Complexes:
        """Orthonormal polynomials (E, 2n+1, R+1) of the transients; 0 on rows that are left out."""
        key = (centre % self.mesh_lines, window)
        if key not in self._transients:
            r = np.arange(-window.half_width, window.half_width + 1)
            operating = (centre + r) % self.mesh_lines == 0
            if not operating.any():  # the same for all such centres
                key = (-1, window)
            if key not in self._transients:
                self._transients[key] = self._transient_basis(operating, window)
        return self._transients[key]

    def _transient_basis(self, operating: NDArray[np.bool_], window: Window) -> Complexes:
        r = np.arange(-window.half_width, window.half_width + 1)
        turn = np.exp(-2j * np.pi * np.outer(self.start_phase, r) / self.mesh_lines)
        columns = window.basis()[None] * turn[:, :, None]
        columns[: self.operating_rows_lost, operating] = 0.0
        left, strength, _ = np.linalg.svd(columns, full_matrices=False)
        # Fewer rows than coefficients (all but a few left out): keep only the directions that exist.
        return np.asarray(left * (strength > 1e-10 * strength.max())[:, None, :])


def prepare(spectra: Spectra, *, transient: bool, reach: int) -> Regression:
    """Sort the spectra by residue class; `reach` lines beyond the highest one are padded with zeros.

    Each record is shifted in time to mesh phase 0 at its start, so that branches refer to the mesh phase.
    """
    d, highest = spectra.mesh_lines, spectra.highest
    phase = spectra.start_phase % 1.0
    same = bool(np.abs(spectra.relative()).max() < 1e-9) or not transient
    force, dte = (_two_sided(s, phase, d) for s in (spectra.force, spectra.dte))
    if same:
        force, dte = rotated(force), rotated(dte)
    lost = 1 if same else spectra.realisations
    operating = np.arange(-highest, highest + 1) % d == 0
    force[:lost, operating] = 0.0
    dte[:lost, operating] = 0.0
    strength = np.sqrt(np.mean(np.abs(force) ** 2, axis=0))
    # Line 0 holds what means differ by between records, which may be any size.
    excited = strength > EXCITATION_FLOOR * np.delete(strength, highest).max()
    force[:, ~excited] = 0.0
    force, dte, mask, origin = sorted_lines(force, dte, excited, d, reach)
    folded = folded_harmonics(spectra.samples, d)
    return Regression(force, dte, mask, origin, highest, same, phase, folded=folded[folded % d != 0])


def sorted_lines(
    force: Complexes, dte: Complexes, excited: NDArray[np.bool_], mesh_lines: int, reach: int
) -> tuple[Complexes, Complexes, NDArray[np.bool_], int]:
    """The fields `force`, `dte`, `excited` and `origin` of a Regression, from lines -K..K (E, 2K+1) and (2K+1,)."""
    highest = force.shape[1] // 2
    origin = -((-highest - reach) // mesh_lines)
    count = (highest + reach) // mesh_lines + 1 + origin
    # Class c holds the lines c + d i: columns of the lines from -origin d on, written d to a row.
    begin = origin * mesh_lines - highest

    def by_class(lines: NDArray[Any]) -> NDArray[Any]:
        padded = np.zeros((lines.shape[0], count * mesh_lines), dtype=lines.dtype)
        padded[:, begin : begin + 2 * highest + 1] = lines
        return np.ascontiguousarray(padded.reshape(-1, count, mesh_lines).transpose(2, 0, 1))

    return by_class(force), by_class(dte), by_class(excited[None])[:, 0], origin


def _two_sided(one_sided: Complexes, phase: Floats, mesh_lines: int) -> Complexes:
    """Lines -K..K (E, 2K+1), delayed so that the record begins at mesh phase 0."""
    full = np.concatenate([one_sided[:, :0:-1].conj(), one_sided], axis=1)
    lines = np.arange(full.shape[1]) - (one_sided.shape[1] - 1)
    # Row by row: of a hundred long records the factors of all are as large as the spectra.
    for row, start in zip(full, phase, strict=True):
        row *= np.exp(-2j * np.pi * (start * lines) / mesh_lines)
    return np.asarray(full)


def rotated(values: Values) -> Values:
    """Householder reflection of the experiments (E, ...) that turns their mean into experiment 0."""
    count = values.shape[0]
    if count == 1:
        return values
    direction = np.full(count, 1.0 / np.sqrt(count))
    direction[0] -= 1.0
    direction /= np.linalg.norm(direction)
    return values - 2.0 * np.outer(direction, direction @ values)  # type: ignore[return-value]
