"""How close a fit comes to the records, and which of two comes closer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]

# Nats an independent line that are left, in the median block, below which no other structure is tried.
CLOSE = 0.2
# The same of a block that answers the excitation, above which it is nearly all unexplained.
FAR = 5.0
# Part of any channel's fluctuation that is left, above which another is tried, too: where few lines carry it, nats do
# not say so. Of the rigs that were found right few leave as much.
OPEN = 0.05
# Part of what one rig leaves of the excited lines above which another leaves nearly as much.
ALIKE = 0.75


def better(found: Optimum, other: Optimum | None) -> Optimum:
    """The one of more evidence."""
    return other if other is not None and other.evidence > found.evidence else found


def is_close(simulator: Simulator, found: Optimum) -> bool:
    """Whether the median block is left with little beside its noise, no block that answers the excitation with much,
    and no channel with a part of its fluctuation that counts: a structure that is not there shows in the transmission
    error before it shows anywhere else."""
    left, target = _left(simulator, found), simulator.target
    parts, _ = target.shares(target.lines - found.lines)
    median, far = float(np.median(left[target.fluctuating])), target.excited & (left > FAR)
    return bool(median < CLOSE and parts.max() < OPEN and not far.any())


def answers_alike(simulator: Simulator, before: Optimum, after: Optimum) -> bool:
    """Whether the lines that show structure are left with nearly as much by both rigs: what was not found beside the
    one is not found beside the other."""
    counts = simulator.target.excited_counts
    one, other = (float((counts * _left(simulator, found)).sum()) for found in (before, after))
    return other > ALIKE * one


def _left(simulator: Simulator, found: Optimum) -> Array:
    """Nats an independent line (blocks,) that the optimum leaves beside the noise."""
    target = simulator.target
    return np.asarray(target.nats(target.energies(target.lines - found.lines)) - target.nats(target.noise))
