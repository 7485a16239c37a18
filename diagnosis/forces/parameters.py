"""The unknowns of the diagnosis: what the nominal rig leaves open, background levels of every effect, free forms.

Every unknown is a departure from the nominal rig with a Gaussian prior around zero. `narrow` is its standard
deviation when it is mere background (what the nominal uncertainty or a sound rig would have), `wide` when the group
that it belongs to is taken to be at work. A hypothesis is a set of groups whose priors are wide.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NUISANCE = "nuisance"


@dataclass(frozen=True)
class Block:
    """A named run of unknowns of one kind.

    `names` (n,), `unit` SI; `narrow`, `wide` (n,) prior standard deviations; `group` what a hypothesis widens;
    `low`, `high` bounds of every entry.
    """

    key: str
    group: str
    unit: str
    names: tuple[str, ...]
    narrow: Array
    wide: Array
    low: float = -np.inf
    high: float = np.inf


def block(
    key: str,
    group: str,
    unit: str,
    names: Sequence[str] | int,
    narrow: float | Array,
    wide: float | None = None,
    *,
    low: float = -np.inf,
    high: float = np.inf,
) -> Block:
    """A block; `names` may be a count, and priors are shared by all its entries unless given for each."""
    listed = tuple(str(i) for i in range(names)) if isinstance(names, int) else tuple(names)
    ones = np.ones(len(listed))
    return Block(key, group, unit, listed, narrow * ones, (narrow if wide is None else wide) * ones, low, high)


@dataclass(frozen=True)
class Layout:
    """Where each block lies in the vector of unknowns."""

    blocks: tuple[Block, ...]
    slices: dict[str, slice]
    size: int

    def __getitem__(self, key: str) -> slice:
        return self.slices[key]

    def block(self, key: str) -> Block:
        """The block of that key."""
        return next(found for found in self.blocks if found.key == key)

    def names(self) -> tuple[str, ...]:
        """`key.name` of every unknown."""
        return tuple(f"{found.key}.{name}" for found in self.blocks for name in found.names)

    def prior(self, groups: Iterable[str] = (), entries: Iterable[int] = ()) -> Array:
        """Prior standard deviations (size,) with these groups, and these single entries, wide."""
        chosen = set(groups)
        parts = [found.wide if found.group in chosen else found.narrow for found in self.blocks]
        sd = np.concatenate(parts)
        wide = np.concatenate([found.wide for found in self.blocks])
        for entry in entries:
            sd[entry] = wide[entry]
        return sd

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds (size,)."""
        low = np.concatenate([np.full(len(found.names), found.low) for found in self.blocks])
        high = np.concatenate([np.full(len(found.names), found.high) for found in self.blocks])
        return low, high

    def members(self, group: str) -> NDArray[np.int64]:
        """Indices of all unknowns of a group."""
        out: list[int] = []
        for found in self.blocks:
            if found.group == group:
                out.extend(range(*self.slices[found.key].indices(self.size)))
        return np.array(out, dtype=np.int64)


def layout(blocks: Sequence[Block]) -> Layout:
    """Blocks one after the other."""
    slices, start = {}, 0
    for found in blocks:
        slices[found.key] = slice(start, start + len(found.names))
        start += len(found.names)
    return Layout(tuple(blocks), slices, start)
