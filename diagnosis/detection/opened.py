"""The smallest backlash that records would show: flanks must part for it, and small changes make jumps there, so that
it is simulated and not read off a derivative."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.backlash import BACKLASH, KEY
from gearbench.diagnosis.evidence.calibration import LIMITS
from gearbench.diagnosis.forces.unknowns import Group
from gearbench.diagnosis.judging.closing import DUE, FELT, GAIN, growth_of
from gearbench.diagnosis.selection.weighing import LIMIT
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]

LEAST, MOST = 0.02, 3.0  # wide standard deviations, between which it is looked for
HALVINGS = 7
SPACING = 0.15  # of a backlash, to which a verdict knows it
MICRO = 1e6


@dataclass(frozen=True, eq=False)
class Changed:
    """How far some records of a rig of unknowns `p` (size,) change with its backlash; `floors` (blocks,): mean squares
    below which nothing is seen in them."""

    simulator: Simulator
    p: Array
    floors: Array

    def energies(self, more: float) -> Array:
        """Mean squares (blocks,) of the change of the lines; none where it does not settle."""
        wider = self.p.copy()
        wider[self.simulator.layout.unknowns[KEY].start] += more
        here, there = self.simulator.lines(self.p), self.simulator.lines(wider)
        if here is None or there is None:
            return np.zeros(len(self.floors))
        return self.simulator.target.energies(there - here)

    def gain(self, more: float) -> float:
        """Nats that it costs to leave the backlash out."""
        return float(np.sum(self.simulator.target.counts * np.log1p(self.energies(more) / self.floors)))

    def feels(self, more: float) -> bool:
        """Whether the records would change beside what is left of them."""
        return bool((self.energies(more) > FELT * self.floors)[self.simulator.target.fluctuating].any())

    def growth(self, more: float) -> float:
        """By how much the gap of some part grows without it."""
        target = self.simulator.target
        rest = np.maximum(self.floors - target.floors, target.noise)
        return growth_of(target, rest + self.energies(more), rest)[0]


class Backlashes(NamedTuple):
    """Backlashes beyond the rig's own [um]: the smallest that is `found` (None: at no size), the deviation `std` that
    is stated for it (of the prior where none is), a `good` rig's, and the `largest` that was looked for."""

    found: float | None
    std: float
    good: float
    largest: float


def backlashes(group: Group, smallest: tuple[float, float] | None) -> Backlashes:
    """The sizes that tell what `smallest_backlash` found with the unknown of the backlash."""
    wide, good = MICRO * float(group.wide[0]), MICRO * float(group.sd[0])
    if smallest is None:
        return Backlashes(None, wide, good, MOST * wide)
    found, std = smallest
    return Backlashes(MICRO * found, MICRO * std, good, MOST * wide)


def smallest_backlash(rough: Changed, judged: Changed) -> tuple[float, float] | None:
    """Smallest backlash beyond the rig's own [m] that would be named from records whose flanks part, and the standard
    deviation that is stated for it; None where no size would be named."""
    group = rough.simulator.layout.unknowns.group(KEY)
    wide, good = float(group.wide[0]), float(group.sd[0])

    def named(size: float) -> bool:
        occam = max(float(np.log(1.0 / (SPACING * size))), 0.0) + 0.5 * size**2
        if rough.gain(size * wide) - occam < LIMIT:
            return False
        # What the judged record does not feel is judged by those whose flanks part.
        telling = judged if judged.feels(size * wide) else rough
        return telling.gain(size * wide) > GAIN and telling.growth(size * wide) > DUE

    # As much as a good rig has is not named, however well it shows.
    low, high = max(LEAST, LIMITS.size_of(BACKLASH) * good / wide), MOST
    if not named(high):
        return None
    if named(low):
        return low * wide, SPACING * low * wide
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if named(middle) else (middle, high)
    return high * wide, SPACING * high * wide
