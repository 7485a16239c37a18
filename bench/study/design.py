"""Which members a study has: full grids, Latin hypercubes, and the design that Sobol indices are estimated from.

Saltelli et al., Comput. Phys. Commun. 181 (2010) 259: two independent samples A and B of n points, here the halves of
one scrambled Sobol sequence in 2 d dimensions, and d samples AB_i that are A with factor i taken from B; n (d + 2)
members.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from gearbench.bench.errors import BenchError
from gearbench.rig import CaseError, Study
from gearbench.rig.casefile.keys import Key, key_of_case
from gearbench.rig.study import Axis, parse_axis

Array = NDArray[np.float64]

MOST_MEMBERS = 1_000_000


@dataclass(frozen=True)
class Factor:
    """One axis of a study: its words, what its key is, and the texts of its levels (empty: drawn continuously)."""

    axis: Axis
    key: Key
    levels: tuple[str, ...]

    @property
    def name(self) -> str:
        """Its column in the table."""
        return self.axis.name

    @property
    def numeric(self) -> bool:
        """Whether its values are numbers."""
        return self.key.kind != "text"

    def at(self, part: float) -> str:
        """The text of the value at a part (0..1) of its distribution."""
        axis = self.axis
        if self.levels:
            return self.levels[min(int(part * len(self.levels)), len(self.levels) - 1)]
        if axis.kind == "normal":
            return _text(axis.low + axis.high * float(ndtri(part)))
        if self.key.kind == "whole":
            return str(min(int(axis.low + part * (axis.high - axis.low + 1)), int(axis.high)))
        return _text(axis.low + part * (axis.high - axis.low))


@dataclass(frozen=True)
class Design:
    """Members (texts of the values, one a factor) in order. `base`: points n of a Sobol design, whose members are A, B,
    AB_1 .. AB_d, n each; 0 for other samples."""

    factors: tuple[Factor, ...]
    members: tuple[tuple[str, ...], ...]
    sample: str
    base: int = 0

    def settings(self, member: int) -> list[str]:
        """The member's values as settings of a case, `dotted.key=value`."""
        pairs = zip(self.factors, self.members[member], strict=True)
        return [f"{key}={text}" for factor, text in pairs for key in factor.axis.keys]


def factor_of(text: str) -> Factor:
    """A factor from the words of `--vary`. Raises CaseError for an unknown key or a value that it cannot have."""
    axis = parse_axis(text)
    keys = [key_of_case(key) for key in axis.keys]
    first = keys[0]
    if any((one.kind, one.unit) != (first.kind, first.unit) for one in keys):
        raise CaseError(f"--vary {text!r}: keys that move together must have the same unit")
    if first.kind == "text" and axis.kind != "levels":
        raise CaseError(f"--vary {text!r}: {axis.name} is no number: list its values, KEY=V1,V2")
    if first.kind != "text":
        for level in axis.levels:
            _check_number(text, level, first.kind == "whole")
    if first.kind == "whole":
        _check_whole(text, axis)
    return Factor(axis, first, axis.levels or _range(axis, first.kind == "whole"))


def design_of(study: Study) -> Design:
    """The members of a study. Raises CaseError for what `vary` names, BenchError for a sample that it does not fit."""
    if not study.vary:
        raise BenchError("nothing varies: give --vary KEY=V1,V2,.. or vary in the case's [study]")
    factors = tuple(factor_of(text) for text in study.vary)
    names = [key for factor in factors for key in factor.axis.keys]
    for name in names:
        if names.count(name) > 1:
            raise BenchError(f"--vary names {name} twice")
    if study.sample == "grid":
        return Design(factors, _grid(factors), "grid")
    dimensions = len(factors)
    if study.sample == "lhs":
        _check_count(study.size)
        points = qmc.LatinHypercube(dimensions, rng=study.seed).random(study.size)
        return Design(factors, _drawn(factors, points), "lhs")
    return Design(factors, _drawn(factors, _saltelli(study, dimensions)), "sobol", study.size)


def _grid(factors: tuple[Factor, ...]) -> tuple[tuple[str, ...], ...]:
    for factor in factors:
        if not factor.levels:
            how = "KEY=LOW:HIGH:COUNT" if factor.axis.kind == "interval" else "KEY=V1,V2,.."
            raise BenchError(f"{factor.name} has no levels for a grid: write {how}, or add --sample lhs or sobol")
    _check_count(prod(len(factor.levels) for factor in factors))
    return tuple(product(*(factor.levels for factor in factors)))


def _saltelli(study: Study, dimensions: int) -> Array:
    size = study.size
    if size & (size - 1):
        below = 1 << (size.bit_length() - 1)
        raise BenchError(f"--size {size} must be a power of 2 for --sample sobol: {below} or {2 * below}")
    _check_count(size * (dimensions + 2))
    both = qmc.Sobol(2 * dimensions, scramble=True, rng=study.seed).random(size)
    a, b = both[:, :dimensions], both[:, dimensions:]
    mixed = [np.where(np.arange(dimensions) == factor, b, a) for factor in range(dimensions)]
    return np.concatenate([a, b, *mixed])


def _drawn(factors: tuple[Factor, ...], points: Array) -> tuple[tuple[str, ...], ...]:
    # A point at the very edge has no finite value of a normal distribution.
    inside = np.clip(points, 1e-12, 1 - 1e-12)
    return tuple(tuple(f.at(float(u)) for f, u in zip(factors, row, strict=True)) for row in inside)


def _range(axis: Axis, whole: bool) -> tuple[str, ...]:
    """The texts of evenly spaced levels; nothing for other axes."""
    if axis.kind != "range":
        return ()
    values = np.linspace(axis.low, axis.high, axis.count)
    return tuple(str(round(value)) if whole else _text(float(value)) for value in values)


def _check_whole(text: str, axis: Axis) -> None:
    if axis.kind == "normal":
        raise CaseError(f"--vary {text!r}: {axis.name} is a whole number, which no normal distribution gives")
    if axis.kind in ("range", "interval"):
        values = np.linspace(axis.low, axis.high, axis.count) if axis.count else np.array([axis.low, axis.high])
        off = values[np.abs(values - np.round(values)) > 1e-9]
        if off.size:
            raise CaseError(f"--vary {text!r}: {axis.name} is a whole number, and {off[0]:g} would be among its values")


def _check_number(text: str, level: str, whole: bool) -> None:
    try:
        _ = int(level) if whole else float(level)
    except ValueError:
        what = "a whole number" if whole else "a number"
        raise CaseError(f"--vary {text!r}: {level} must be {what}") from None


def _check_count(members: int) -> None:
    if members > MOST_MEMBERS:
        raise BenchError(f"the study has {members} members, at most {MOST_MEMBERS} are possible")


def _text(value: float) -> str:
    """A number as TOML: twelve digits, which no rig is known to."""
    text = f"{value:.12g}"
    return text if any(mark in text for mark in ".e") else f"{text}.0"
