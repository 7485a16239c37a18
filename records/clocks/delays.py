"""The delay of some channels with which the accounts of the mesh force agree best."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.look import Complexes, Look
from gearbench.records.seen.mesh_force import Accounts

Array = NDArray[np.float64]

# Delays that are looked for [samples], and steps to the shortest period in the band.
LONGEST, STEPS = 100, 8


def delays_of(look: Look, omega: Array) -> Array:
    """Delays (D,) [s] that are tried, evenly spaced, up to LONGEST samples either way; `omega` [rad/s]: rising."""
    top = float(omega[-1]) / (2 * np.pi)
    step = min(1 / (STEPS * top), 1 / look.rate)
    return np.arange(-np.ceil(LONGEST / look.rate / step), np.ceil(LONGEST / look.rate / step) + 1) * step


@dataclass(frozen=True, eq=False)
class Delays:
    """Evenly spaced delays `tried` (D,) [s] of channels in `accounts`."""

    accounts: Accounts
    tried: Array

    def best(self, relations: list[tuple[str, str]], names: frozenset[str]) -> tuple[float, float]:
        """The delay [s] of some channels that leaves least of the worst misfit of the relations, found on a grid forty
        times as fine around the best of those tried; and what it leaves."""
        coarse, _ = least(self.accounts, relations, names, self.tried, self._turns)
        step = float(self.tried[1] - self.tried[0])
        return least(self.accounts, relations, names, coarse + step * np.linspace(-1.0, 1.0, 41))

    def misfits(self, relations: list[tuple[str, str]], names: frozenset[str], delay: float) -> list[float]:
        """What a delay [s] of some channels leaves of the misfit of each relation."""
        turns = _turns(self.accounts, np.array([delay]))
        return [float(self.accounts.misfit(relation, names, turns)[0]) for relation in relations]

    @cached_property
    def _turns(self) -> Complexes:
        """What the delays turn lines by (D, lines): the same for every channel."""
        return _turns(self.accounts, self.tried)


def least(
    accounts: Accounts,
    relations: list[tuple[str, str]],
    names: frozenset[str],
    delays: Array,
    turns: Complexes | None = None,
) -> tuple[float, float]:
    """Of delays (D,) [s] of some channels the one that leaves least of the worst misfit of the relations, and that."""
    turns = _turns(accounts, delays) if turns is None else turns
    found = np.max([accounts.misfit(relation, names, turns) for relation in relations], axis=0)
    return float(delays[int(np.argmin(found))]), float(found.min())


def _turns(accounts: Accounts, delays: Array) -> Complexes:
    return np.asarray(np.exp(1j * np.outer(delays, accounts.omega)))
