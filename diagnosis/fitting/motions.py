"""Which motions a housing has, by what its rig leaves unexplained: every first one is tried where it might resonate,
and every second one beside the best of them.

A fit moves a resonance by its width, not over another one: what explains most before the rest of the rig has followed
need not do so after. So several are begun, apart, and compared when they have been fitted for a while.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import SIDES
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.structure.structure import ACROSS, CROSS, HOUSING, MOTIONS, free_motions, with_motion

Array = NDArray[np.float64]

# Where a motion is looked for: compliances over the supports', logarithms of its frequency over theirs.
FROM, AT = (0.004, 0.012, 0.04), tuple(float(at) for at in np.linspace(-2.0, 1.3, 34))
APART = 0.3  # of those logarithms, by which two of one kind are begun apart
BEGUN = (4, 3)  # first motions that are begun in each rig, and second ones
# Where one is looked for that moves along: the mesh pushes both gears apart, so that it answers faintly.
FAINT_AT = (-1.0, -0.7, -0.4, 0.0)
KEPT, ENDED = 4, 3  # rigs that are gone on with, and those that are fitted to the end
# Where a gear's resonance across its support is looked for, which its cross-coupling shows.
ACROSS_AT = tuple(float(at) for at in np.geomspace(0.08, 0.6, 19))
CROSS_AT = (-0.15, -0.06, 0.06, 0.15)
WORTH = 3.0  # nats by which a resonance across, or one of a housing, must explain more


class Accounted(Protocol):
    """What rigs leave unexplained; ValueError where no rig is there."""

    @property
    def unknowns(self) -> Unknowns:
        """What a rig is told by."""

    def misfit(self, p: Array) -> float:
        """Nats of what the rig of unknowns (size,) leaves."""

    def cost(self, p: Array) -> float:
        """The same and what it costs by its priors."""

    def compared(self, begin: Array, *, faint: bool = False) -> Array:
        """The rig (size,) to which a short fit leads, `faint`: one that sees what answers faintly."""

    def ended(self, begin: Array) -> Array:
        """The rig (size,) to which one leads to the end, from one that was compared."""


def with_motions(account: Accounted, begun: Sequence[Array]) -> Array:
    """The rig (size,) that costs least of those with none, one or both motions of a housing, begun at rigs (size,)
    without, the first of which is as it is where there are none."""
    unknowns = account.unknowns
    rigs = [_crossing(account, p) for p in begun]
    tried = sorted(((account.cost(p), p) for p in rigs), key=_cost)
    for motion in range(len(MOTIONS)) if HOUSING in unknowns.slices else ():
        trials = [trial for p in rigs for trial in _moving(account, p, BEGUN[motion])]
        fitted = [account.compared(trial) for trial in trials]
        if motion == 0:
            faint = [with_motion(unknowns, rigs[0], motion, at, FROM[-1], motion) for at in FAINT_AT]
            fitted += [account.compared(trial, faint=True) for trial in faint]
        found = sorted(((account.cost(p), p) for p in fitted), key=_cost)
        if tried[0][0] - found[0][0] < WORTH:
            break
        tried = sorted([*tried, *found], key=_cost)
        rigs = [p for _, p in found[:KEPT]]
    ends = [account.ended(p) for _, p in tried[:ENDED]]
    return min((begun[0], *(p for _, p in tried), *ends), key=account.cost)


def _cost(one: tuple[float, Array]) -> float:
    return one[0]


def _crossing(account: Accounted, p: Array) -> Array:
    """`p` (size,), with cross-coupling of the supports whose gears are seen to resonate across them."""
    unknowns = account.unknowns
    for side in range(len(SIDES)):
        trials = []
        for soft, coupled in product(ACROSS_AT, CROSS_AT):
            trial = p.copy()
            trial[unknowns[ACROSS].start + side] = soft
            trial[unknowns[CROSS].start + side] = coupled
            trials.append(trial)
        costs = [account.misfit(trial) for trial in trials]
        best = int(np.argmin(costs))
        if costs[best] < account.misfit(p) - WORTH:
            p = trials[best]
    return p


def _moving(account: Accounted, p: Array, most: int) -> list[Array]:
    """`p` (size,) with one more motion of the housing, of any kind, where that explains most, at most so often."""
    unknowns = account.unknowns
    trials = []
    for (motion, kind), part, at in product(free_motions(unknowns, p), FROM, AT):
        trial = with_motion(unknowns, p, motion, at, part, kind)
        trials.append((account.misfit(trial), kind, at, trial))
    out = list[tuple[int, float, Array]]()
    for _, kind, at, trial in sorted(trials, key=lambda one: one[0]):
        if len(out) < most and all(kind != other or abs(at - there) > APART for other, there, _ in out):
            out.append((kind, at, trial))
    return [trial for _, _, trial in out]
