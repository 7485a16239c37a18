"""The unknowns of a diagnosis: what the nominal rig leaves open, background levels of every effect, free forms.

Every unknown is a departure from the nominal rig with a Gaussian prior around zero. Its standard deviation is `sd`
while it is mere background (what the nominal uncertainty or a sound rig would have) and `wide` when the cause that it
belongs to is taken to be at work.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.departures import SHAPES, TOOTH_SLOTS, Departures

Array = NDArray[np.float64]

# Of each unknown of a group (n), what it adds per unit to a slot over samples or bins: (n, N) or (n, K), or (n, 3, N)
# to the levers.
Basis = Callable[[Condition], NDArray[Any]]


@dataclass(frozen=True)
class Group:
    """A named run of unknowns of one kind.

    `names` (n,), `unit` SI; `sd`, `wide` (n,) prior standard deviations; `low`, `high` bounds of every entry. They move
    the elements `first` .. `first` + n - 1 of the slot `slot` of `Departures`, or all of it by their `basis`, and other
    slots besides by these `also`.
    """

    key: str
    unit: str
    names: tuple[str, ...]
    sd: Array
    wide: Array
    slot: str
    first: int = 0
    basis: Basis | None = None
    low: float = -np.inf
    high: float = np.inf
    also: Mapping[str, Basis] = field(default_factory=dict)


def group(
    key: str,
    unit: str,
    names: Sequence[str] | int,
    sd: float | Array,
    wide: float | Array | None = None,
    *,
    slot: str,
    first: int = 0,
    basis: Basis | None = None,
    low: float = -np.inf,
    high: float = np.inf,
    also: Mapping[str, Basis] | None = None,
) -> Group:
    """A group; `names` may be a count, and priors are shared by all its entries unless given for each."""
    listed = tuple(str(i) for i in range(names)) if isinstance(names, int) else tuple(names)
    ones = np.ones(len(listed))
    large = sd if wide is None else wide
    return Group(key, unit, listed, sd * ones, large * ones, slot, first, basis, low, high, also or {})


@dataclass(frozen=True)
class Unknowns:
    """All unknowns in the order of their vector (size,); `slices` by the groups' keys.

    `moving` gives the entries that move an element of a slot, `teeth` the number of teeth of both gears.
    """

    groups: tuple[Group, ...]
    slices: dict[str, slice]
    size: int
    teeth: int
    moving: dict[tuple[str, int], tuple[int, ...]]

    def __getitem__(self, key: str) -> slice:
        return self.slices[key]

    def at(self, key: str) -> NDArray[np.int64]:
        """Numbers (n,) of the unknowns of that key; none where there is no such group."""
        return np.arange(self.size)[self.slices.get(key, slice(0))]

    def group(self, key: str) -> Group:
        """The group of that key."""
        return next(one for one in self.groups if one.key == key)

    def of(self, keys: Sequence[str]) -> NDArray[np.bool_]:
        """Which unknowns (size,) are of the groups of these keys, as far as there are such."""
        out = np.zeros(self.size, dtype=bool)
        for key in keys:
            if key in self.slices:
                out[self.slices[key]] = True
        return out

    def names(self) -> tuple[str, ...]:
        """`key.name` of every unknown."""
        return tuple(f"{one.key}.{name}" for one in self.groups for name in one.names)

    def prior(self) -> Array:
        """Prior standard deviations (size,) of the background alone."""
        return np.concatenate([one.sd for one in self.groups])

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds (size,)."""
        low = np.concatenate([np.full(len(one.names), one.low) for one in self.groups])
        high = np.concatenate([np.full(len(one.names), one.high) for one in self.groups])
        return low, high

    def moved_besides(self, slot: str) -> tuple[tuple[slice, Basis], ...]:
        """Unknowns that move a slot besides their own, and how."""
        return tuple((self.slices[one.key], one.also[slot]) for one in self.groups if slot in one.also)

    def based(self, slot: str) -> tuple[Group, ...]:
        """The groups that move a slot by a basis."""
        return tuple(one for one in self.groups if one.slot == slot and one.basis is not None)

    def departures(self, p: Array, condition: Condition) -> Departures:
        """The departures (size,) as the residuals of one condition take them."""
        sizes = {slot: prod(shape) for slot, shape in SHAPES.items()} | dict.fromkeys(TOOTH_SLOTS, self.teeth)
        values: dict[str, Any] = {slot: np.zeros(size) for slot, size in sizes.items()}
        values["excess"], values["closed"] = np.zeros((2, condition.samples))
        values["turned"], values["levers"] = np.zeros(condition.samples), np.zeros((3, condition.samples))
        values["torque"] = np.zeros(condition.bins, dtype=complex)
        for one in self.groups:
            part = p[self.slices[one.key]]
            if one.basis is None:
                values[one.slot][one.first : one.first + len(part)] += part
            else:
                values[one.slot] = values[one.slot] + part @ one.basis(condition)
            for slot, basis in one.also.items() if part.any() else ():
                values[slot] = values[slot] + np.tensordot(part, basis(condition), 1)
        shaped = {
            slot: values[slot].reshape(shape) if shape else float(values[slot][0]) for slot, shape in SHAPES.items()
        }
        return Departures(**(values | shaped))


def unknowns_of(groups: Sequence[Group], teeth: int) -> Unknowns:
    """Groups one after the other, for gears with that many teeth together."""
    slices, start = {}, 0
    moving: dict[tuple[str, int], tuple[int, ...]] = {}
    for one in groups:
        slices[one.key] = slice(start, start + len(one.names))
        if one.basis is None:
            for i in range(len(one.names)):
                element = (one.slot, one.first + i)
                moving[element] = (*moving.get(element, ()), start + i)
        start += len(one.names)
    return Unknowns(tuple(groups), slices, start, teeth, moving)
