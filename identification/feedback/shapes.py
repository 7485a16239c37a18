"""What a mesh is made of: functions of phase whose amplitudes have a prior, of a size that the record tells.

Harmonics of k and c fall like 1/l, as those of a piecewise smooth function (with edges of finite width faster). Zones
of phase are few functions of one size; a remainder of harmonics beside them holds what they do not follow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.feedback.zones import Zones, real_columns
from gearbench.identification.spectra.joint import Floats

# Part of its width by which a switch, or the width itself, may differ from what the zones have: beyond, a derivative
# no longer tells what moves.
MOVED = 0.25
# Group of amplitudes whose prior is given.
GIVEN = -1


@dataclass(frozen=True)
class Shapes:
    """The mesh's part of `Model.vector` (4 L,) is `functions` (4 L, Q) times amplitudes, plus amplitudes (4 R,) of its
    harmonics 1..R; amplitude i of group g has the prior variance size_g / `weight`_i. `group` (Q + 4 R,): 0.., or GIVEN
    for a size of 1."""

    functions: Floats
    remainder: int
    weight: Floats
    group: NDArray[np.int64]

    @property
    def groups(self) -> int:
        """Groups whose size is to be found."""
        return int(self.group.max()) + 1

    @property
    def rows(self) -> NDArray[np.int64]:
        """Places (4 R,) of the remainder in the mesh's part of `Model.vector`."""
        return (np.arange(4)[:, None] * (self.functions.shape[0] // 4) + np.arange(self.remainder)).ravel()

    def without_remainder(self) -> Shapes:
        """The functions alone."""
        count = self.functions.shape[1]
        return Shapes(self.functions, 0, self.weight[:count], self.group[:count])

    def precision(self, squares: Floats) -> Floats:
        """Prior precision (A,) of amplitudes with these expected `squares` (A,)."""
        found = self.weight.copy()
        for number in range(self.groups):
            own = self.group == number
            found[own] /= max(float(np.mean((self.weight * squares)[own])), np.finfo(float).tiny)
        return found

    def of(self, amplitudes: Floats) -> Floats:
        """The mesh's part (4 L, ...) of amplitudes (A, ...)."""
        count = self.functions.shape[1]
        found = self.functions @ amplitudes[:count]
        found[self.rows] += amplitudes[count:]
        return np.asarray(found)

    def columns(self, columns: NDArray) -> NDArray:
        """Derivatives (..., A) with respect to amplitudes of those with respect to the mesh's part (..., 4 L)."""
        if self.functions.shape[1] == 0 and 4 * self.remainder == columns.shape[-1]:
            return columns
        return np.concatenate([_times(columns, self.functions), columns[..., self.rows]], axis=-1)


def _times(columns: NDArray, functions: Floats) -> NDArray:
    """Product with a real matrix, which numpy would turn into a complex one."""
    if not np.iscomplexobj(columns):
        return np.asarray(columns @ functions)
    return columns.real @ functions + 1j * (columns.imag @ functions)


def of_harmonics(count: int, harmonics: int | None = None) -> Shapes:
    """Harmonics 1..`count` of k and c, which fall like 1/l, of a mesh of `harmonics`; absent: of no more than these."""
    weight = np.tile(np.arange(1.0, count + 1) ** 2, 4)
    return Shapes(np.empty((4 * (harmonics or count), 0)), count, weight, np.repeat([0, 1], 2 * count))


def only_zones(zones: Zones, harmonics: int) -> Shapes:
    """Zones in a mesh of so many harmonics."""
    functions = real_columns(zones.coefficients(harmonics))
    count = functions.shape[1]
    return Shapes(functions, 0, np.ones(count), np.repeat([0, 1], count // 2))


def of_zones(zones: Zones, mesh: Floats, remainder: int) -> Shapes:
    """Zones whose switches and width may move a little, as they do of a `mesh` (4 L,) in them, beside a `remainder` of
    so many harmonics."""
    own, beside = only_zones(zones, mesh.size // 4), of_harmonics(remainder)
    moves = zones.moves(mesh)
    count = moves.shape[1]
    return Shapes(
        np.concatenate([own.functions, moves], axis=1),
        remainder,
        np.concatenate([own.weight, np.full(count, (MOVED * zones.width) ** -2), beside.weight]),
        np.concatenate([own.group, np.full(count, GIVEN), beside.group + own.groups]),
    )


@dataclass(frozen=True)
class Mesh:
    """Amplitudes (A,) of shapes, their prior `precision` (A,), and how many of them the record has `determined`.

    `held`: whether the precision stays as it is when they move; of others all amplitudes count as determined.
    """

    shapes: Shapes
    amplitudes: Floats
    precision: Floats
    determined: float
    held: bool = False

    @staticmethod
    def of_harmonics(mesh: Floats) -> Mesh:
        """Of the harmonics that the mesh's part of `Model.vector` has."""
        shapes = of_harmonics(mesh.size // 4)
        return Mesh(shapes, mesh, shapes.precision(mesh**2), mesh.size)

    @property
    def harmonics(self) -> Floats:
        """The mesh's part (4 L,) of `Model.vector`."""
        return self.shapes.of(self.amplitudes)

    @property
    def unlikely(self) -> float:
        """-2 log prior density of the amplitudes but for a constant."""
        return float(self.amplitudes @ (self.precision * self.amplitudes))

    def of_length(self, zones: Zones, harmonics: int) -> Mesh:
        """The same of the shapes that `zones` and a remainder make of so many harmonics."""
        first = only_zones(zones, harmonics)
        alone = first.of(self.amplitudes[: first.weight.size])
        return replace(self, shapes=of_zones(zones, alone, self.shapes.remainder))

    def moved(self, step: Floats) -> Mesh:
        """With amplitudes moved."""
        return replace(self, amplitudes=self.amplitudes + step)

    def scaled(self, factor: float) -> Mesh:
        """With all amplitudes times a factor."""
        return replace(self, amplitudes=factor * self.amplitudes)

    def told(self, root: Floats) -> Mesh:
        """With the prior, and the number of amplitudes that are determined, that follow from the `root` (A, X) of their
        covariance."""
        spread = np.sum(root**2, axis=1)
        if self.held:
            return replace(self, determined=self.amplitudes.size - float(self.precision @ spread))
        return replace(self, precision=self.shapes.precision(self.amplitudes**2 + spread))

    def of_model(self, root: Floats, free: int) -> Floats:
        """The root (P, X) of all parameters of the model from that (free + A, X) of D, N and the amplitudes."""
        return np.concatenate([root[:free], self.shapes.of(root[free:])])
