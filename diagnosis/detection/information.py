"""What records tell of the unknowns: Fisher's information at a rig, block by block.

A block is a record, a channel, a kind of line and a band (`output.target`). Leaving out a record or a channel leaves
out its blocks, so that one Jacobian serves every question about them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.simulation.quadratic import Quadratic
from gearbench.diagnosis.simulation.target import Target

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Without:
    """What is left out: a record of the search, channels of all records."""

    record: str = ""
    channels: tuple[str, ...] = ()


def floors_of(target: Target, quiet: float = 1.0, left: float = 0.0) -> Array:
    """Mean squares (blocks,) below which nothing is seen: s^2 with `quiet` times the variance of the noise, and what
    the best rig leaves of a block, the part `left` of its level."""
    return np.asarray(target.floors - (1.0 - quiet) * target.noise + left**2 * target.energies(target.lines))


@dataclass(frozen=True, eq=False)
class Blocks:
    """Quadratic of some records about what they hold beside the rig itself: noise, and what that rig leaves."""

    quadratic: Quadratic

    @property
    def target(self) -> Target:
        """The lines."""
        return self.quadratic.target

    def kept(self, without: Without) -> NDArray[np.bool_]:
        """Which blocks are kept."""
        blocks = self.target.blocks
        return np.array([one.record != without.record and one.channel not in without.channels for one in blocks])

    def floors(self, quiet: float, left: float) -> Array:
        """As `floors_of`."""
        return floors_of(self.target, quiet, left)

    def information(self, without: Without, quiet: float, left: float) -> Array:
        """Information (q, q) of the blocks kept."""
        noise = quiet * self.quadratic.energy / self.target.sizes
        weights = 2 * self.target.counts / ((self.floors(quiet, left) + noise) * self.target.sizes)
        return np.asarray(np.tensordot(weights * self.kept(without), self.quadratic.squares, axes=1))

    def rest(self, quiet: float, left: float) -> Array:
        """Mean squares (blocks,) of the gap to the best rig, its noise included."""
        noise = quiet * self.quadratic.energy / self.target.sizes
        return np.asarray(noise + left**2 * self.target.energies(self.target.lines))

    def energies(self, step: Array) -> Array:
        """Mean squares (blocks,) of the lines that a step (q,) of the unknowns changes."""
        whole = np.einsum("bij,i,j->b", self.quadratic.squares, step, step, optimize=True)
        return np.asarray(np.maximum(whole, 0.0) / self.target.sizes)


@dataclass(frozen=True)
class Known:
    """Blocks of the records of the search and of the judged one, over the unknowns `active` (q,) that they show;
    `narrow` (size,): priors of the background; `apart`: whether the judged record had no part in the search."""

    unknowns: Unknowns
    active: NDArray[np.int64]
    narrow: Array
    search: Blocks
    judged: Blocks
    apart: bool = False
