"""Spectra as the mesh-feedback equations see them: lines in residue classes, in units of about one."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.regression import prepare, rotated
from gearbench.identification.spectra.folded import folded_harmonics
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra

# Lines beyond the excited ones that are kept, as part of the highest and in mesh harmonics: sidebands act back on the
# excited lines, and tell the mesh's higher harmonics.
MARGIN = 0.05
SIDEBANDS = 8
# The same where a resonance above the excited band acts back, which shows in them alone. Elsewhere they cost twice the
# time, and a mesh force that is linear in the band only is asked for what lies far above it.
FURTHER = 24
# Sidebands beyond those lines, in mesh harmonics, that a model has all the same: they too act back. A model that ends
# where the record does puts their effect on the mesh's higher harmonics, and one that ends within a resonance on
# everything; what is still left out is counted (`branches.left_out`).
BEYOND = 24
# Where the response is predicted at a faster mesh: highest line of sidebands in multiples of the highest one of the
# fit. At 500 Hz, without those beyond twice that line the reference system's response errs by 0.3 %, without those
# beyond three times by 0.09 %.
PREDICTED = 3
# Turns by which folded lines of two realisations may differ to be alike.
ALIKE = 1e-9


@dataclass(frozen=True)
class ClassData:
    """Two-sided lines of the residue classes 0..d/2 (the others are their complex conjugates) that hold any dte.

    `lines` (C, S), 0 where `modelled` is False; `valid` (C, S) up to the line `top`: those of the record; `modelled`
    (C, S): up to `furthest`. `force` and `dte` (C, S, E) over `force_unit` [N] and `dte_unit` [m]; of lines that are
    modelled and not valid, dte is there as far as the record goes, for comparison;
    `weight` (C,): 1, or 1/sqrt(2) for classes that are their own mirror image and hold every equation twice.
    `omega` (C, S): angular frequency over `omega_unit` [rad/s]. `excited`: highest excited line. `equations`: complex
    ones, each counted once. `samples` of the joint period, 0 where nothing can have folded; `start_phase` (E,) [cycles]
    by which records were delayed, and the `rotation` (E, E) of the realisations after that. `part` of the model's lines
    beyond half the sampling rate that a model of these data foretells in them.
    """

    lines: NDArray[np.int64]
    valid: NDArray[np.bool_]
    modelled: NDArray[np.bool_]
    force: Complexes
    dte: Complexes
    weight: Floats
    mesh_lines: int
    spacing: float
    excited: int
    top: int
    force_unit: float
    dte_unit: float
    equations: float
    samples: int = 0
    start_phase: Floats = field(default_factory=lambda: np.zeros(1))
    rotation: Floats = field(default_factory=lambda: np.eye(1))
    part: float = 0.0

    @property
    def folds(self) -> bool:
        """Whether the model has lines beyond half the sampling rate."""
        return 0 < self.samples < 2 * self.furthest

    @property
    def folds_inside(self) -> bool:
        """Whether lines fold onto lines of their own class, alike in all realisations: a mesh period is a whole number
        of samples, of which records begin equally far from mesh phase 0."""
        turns = np.exp(2j * np.pi * self.samples / self.mesh_lines * self.start_phase)
        return self.samples % self.mesh_lines == 0 and bool(np.abs(turns - turns[0]).max() < ALIKE)

    def sampled(self, values: Complexes) -> Complexes:
        """What a record shows of a class's `values` (S, ...) on its lines: themselves, and `part` of those that fold
        inside the class onto them, as in `folding.folded`."""
        if self.part == 0.0:
            return values
        apart, size = self.samples // self.mesh_lines, values.shape[0]
        turn = self.part * np.exp(2j * np.pi * ((apart * self.start_phase[0]) % 1.0))
        found = values.copy()
        if apart < size:
            found[: size - apart] += turn * values[apart:]
            found[apart:] += np.conj(turn) * values[: size - apart]
        return found

    @property
    def omega_unit(self) -> float:
        """Angular frequency of the highest line [rad/s]."""
        return float(2 * np.pi * self.top * self.spacing)

    @property
    def omega(self) -> Floats:
        """Angular frequency of each line over `omega_unit`."""
        return np.asarray(self.lines / self.top, dtype=float)

    @property
    def lowest(self) -> int:
        """Lowest excited line."""
        return int(np.abs(self.lines[np.abs(self.force).max(axis=2) > 0]).min())

    @property
    def least(self) -> float:
        """Position of that line, or of the first one: what a pole may be as slow as."""
        return max(self.lowest, 1) / self.top

    @property
    def begins(self) -> Floats:
        """Positions (16,) over the lowest twentieth of the excited band."""
        lowest = self.lowest
        return np.asarray(np.linspace(lowest, lowest + 0.05 * (self.excited - lowest), 16) / self.top)

    @property
    def furthest(self) -> int:
        """Highest line of sidebands that the model has."""
        return furthest_line(self.top, self.mesh_lines)

    def furthest_at(self, ratio: float) -> int:
        """Highest line of sidebands of the response at `ratio` times the record's mesh frequency: a faster mesh carries
        them further than the record shows, where D and N are those of its lines, extrapolated."""
        if ratio <= 1.0:
            return self.furthest
        return max(self.furthest, min(PREDICTED * self.top, self.top + int(BEYOND * self.mesh_lines * ratio)))

    @property
    def stiffness_unit(self) -> float:
        """Unit of stiffness [N/m]."""
        return self.force_unit / self.dte_unit


def furthest_line(top: int, mesh_lines: int) -> int:
    """Highest line of sidebands that a model has whose record ends with the line `top`."""
    return min(2 * top, top + BEYOND * mesh_lines)


def fewer_classes(data: ClassData, equations: int) -> ClassData:
    """Classes spread evenly over all of them, with about so many equations in them."""
    count = data.lines.shape[0]
    kept = int(np.ceil(count * min(1.0, equations / data.equations)))
    if kept == count:
        return data
    chosen = np.unique(np.round((np.arange(kept) + 0.5) * count / kept - 0.5).astype(int))
    parts = {name: getattr(data, name)[chosen] for name in ("lines", "valid", "modelled", "force", "dte", "weight")}
    return replace(data, **parts, equations=_equations(parts["valid"], parts["dte"], parts["weight"]))


def only_lines(data: ClassData, kept: NDArray[np.bool_]) -> ClassData:
    """The same with equations of `kept` lines (C, S) only."""
    valid = data.valid & kept
    return replace(data, valid=valid, equations=_equations(valid, data.dte, data.weight))


def top_line(spectra: Spectra, excited: int, sidebands: int) -> int:
    """Highest line that is fitted: so many `sidebands` beyond the highest `excited` one, or MARGIN of it."""
    return min(spectra.highest, max(int((1.0 + MARGIN) * excited), excited + sidebands * spectra.mesh_lines))


def class_data(spectra: Spectra, excited: int, sidebands: int = SIDEBANDS) -> ClassData:
    """Lines up to `top_line`, without the operating response (class 0 of its records).

    Records are shifted to mesh phase 0 as in the local polynomial method. Without equations are also lines that the
    operating response may have folded onto.
    """
    regression = prepare(spectra, transient=False, reach=0)
    d = spectra.mesh_lines
    top = top_line(spectra, excited, sidebands)
    classes = np.arange(d // 2 + 1)
    furthest = furthest_line(top, d)
    reach = furthest // d + 1
    position = np.arange(-reach, reach + 1)
    lines = classes[:, None] + position * d
    valid, modelled = np.abs(lines) <= top, np.abs(lines) <= furthest
    at = np.clip(position + regression.origin, 0, regression.force.shape[2] - 1)
    known = np.abs(lines) <= min(furthest, spectra.highest)
    force, dte = (
        np.where(kept[:, :, None], source[classes][:, :, at].transpose(0, 2, 1), 0.0)
        for kept, source in ((valid, regression.force), (known, regression.dte))
    )
    valid &= ~np.isin(lines, folded_harmonics(spectra.samples, d))
    weight = np.where((2 * classes) % d == 0, np.sqrt(0.5), 1.0)
    # Of a single realisation nothing is left of the operating response's class, which need not be solved.
    there = np.abs(dte).max(axis=(1, 2)) > 0
    shown = modelled[there].any(axis=0)
    lines, valid, modelled, force, dte = (x[there][:, shown] for x in (lines, valid, modelled, force, dte))
    weight = weight[there]
    force_unit, dte_unit = (
        float(np.sqrt(np.sum(np.abs(x[valid]) ** 2) / max(np.count_nonzero(x[valid]), 1))) or 1.0 for x in (force, dte)
    )
    return ClassData(
        np.where(modelled, lines, 0),
        valid,
        modelled,
        np.asarray(force / force_unit, dtype=complex),
        np.asarray(dte / dte_unit, dtype=complex),
        weight,
        d,
        spectra.spacing,
        excited,
        top,
        force_unit,
        dte_unit,
        _equations(valid, dte, weight),
        spectra.samples,
        regression.start_phase,
        rotated(np.eye(spectra.realisations)),
    )


def _equations(valid: NDArray[np.bool_], dte: Complexes, weight: Floats) -> float:
    """Complex equations, each counted once."""
    present = np.abs(dte).sum(axis=1) > 0  # (C, E): the operating response's record is gone from class 0
    return float(np.sum(valid.sum(axis=1)[:, None] * present * weight[:, None] ** 2))
