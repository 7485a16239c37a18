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
from gearbench.diagnosis.structure.structure import (
    ACROSS,
    CROSS,
    HOUSING,
    MODE,
    MOTIONS,
    free_motions,
    kind_of,
    with_motion,
)

Array = NDArray[np.float64]

# Where a motion is looked for: compliances over the supports', logarithms of its frequency over theirs.
FROM, AT = (0.004, 0.012, 0.04), tuple(float(at) for at in np.linspace(-2.0, 1.3, 34))
# Of those logarithms, within which two motions are the same, and compliance from which one counts.
ALIKE, COUNTS = 0.1, 1e-3
BEGUN = (4, 3)  # first motions that are begun in each rig, and second ones
# Where one is looked for that moves along: the mesh pushes both gears apart, so that it answers faintly.
FAINT_AT = (-1.0, -0.7, -0.4, 0.0)
KEPT, ENDED = 4, 3  # rigs that are gone on with, and those that are fitted to the end
# Where a gear's resonance across its support is looked for, which its cross-coupling shows.
ACROSS_AT = tuple(float(at) for at in np.geomspace(0.08, 0.6, 19))
CROSS_AT = (-0.15, -0.06, 0.06, 0.15)
WORTH = 3.0  # nats by which a resonance across, or one of a housing, must explain more


class Accounted(Protocol):
    """What rigs leave unexplained, infinitely much where no rig is there."""

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
    tried = _ranked(account, rigs)
    for motion in range(len(MOTIONS)) if HOUSING in unknowns.slices else ():
        trials = [_moving(account, p, BEGUN[motion]) for p in rigs]
        faint = trials[0]
        if motion == 0:
            faint = [with_motion(unknowns, rigs[0], motion, at, FROM[-1], motion) for at in FAINT_AT]
        fitted = [account.compared(trial) for each in trials for trial in each]
        fitted += [account.compared(trial, faint=True) for trial in faint]
        found = _ranked(account, fitted)
        if tried[0][0] - found[0][0] < WORTH:
            break
        rigs = _apart(unknowns, found, KEPT)
        # What the next one explains is more than a fit does that goes on.
        tried = sorted([*tried, *found, *_ranked(account, [account.ended(rigs[0])])], key=_cost)
    ends = [account.ended(p) for p in _apart(unknowns, tried, ENDED)]
    return min((*_ranked(account, [begun[0], *ends]), *tried), key=_cost)[1]


def _ranked(account: Accounted, rigs: Sequence[Array]) -> list[tuple[float, Array]]:
    """Rigs (size,) behind what each costs, the best first."""
    return sorted(((account.cost(p), p) for p in rigs), key=_cost)


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
    """`p` (size,) with one more motion of the housing, of any kind, where that explains more than a little above or
    below, at most so often, where it explains most first."""
    unknowns = account.unknowns
    peaks = list[tuple[float, Array]]()
    for motion, kind in free_motions(unknowns, p):
        tried = [
            min(((account.misfit(trial), trial) for trial in trials), key=_cost)
            for trials in ([with_motion(unknowns, p, motion, at, part, kind) for part in FROM] for at in AT)
        ]
        costs = np.pad([cost for cost, _ in tried], 1, constant_values=np.inf)
        lowest = (costs[1:-1] <= costs[:-2]) & (costs[1:-1] < costs[2:])
        peaks += [tried[number] for number in np.flatnonzero(lowest)]
    return [trial for _, trial in sorted(peaks, key=_cost)[:most]]


def _apart(unknowns: Unknowns, rigs: Sequence[tuple[float, Array]], most: int) -> list[Array]:
    """At most so many of `rigs` (size,), the best first, of which no two have the same motions."""
    out = list[Array]()
    for _, p in rigs:
        if len(out) < most and not any(_alike(unknowns, p, other) for other in out):
            out.append(p)
    return out


def _alike(unknowns: Unknowns, p: Array, other: Array) -> bool:
    """Whether the motions of two rigs (size,) that count are of the same frequencies and kinds."""
    one, two = (_motions(unknowns, rig) for rig in (p, other))
    return len(one) == len(two) and all(
        kind == its and abs(at - there) < ALIKE for (kind, at), (its, there) in zip(one, two, strict=True)
    )


def _motions(unknowns: Unknowns, p: Array) -> list[tuple[str, float]]:
    """Kind and logarithm of the frequency of each motion that counts."""
    there = np.flatnonzero(p[unknowns[HOUSING]] > COUNTS)
    return sorted((kind_of(unknowns, p, int(number)), float(p[unknowns[MODE]][2 * number])) for number in there)
