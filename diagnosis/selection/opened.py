"""Backlash weighed value by value: nothing leads downhill to it.

Flanks that meet behind a wider gap, or no more, make a jump, and where the gap is wider than all motion its value is
nothing to the records: they say at least how much there is. So its likelihood is simulated over all of its prior, all
else as it is, and more closely where it changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]

# What is simulated at first, over the width of the hypothesis' prior and of a good rig's.
TRIED = np.array([-3.0, -2.0, *np.linspace(-1.5, 1.5, 13), 2.0, 3.0])
NEAR_NOTHING = np.linspace(-2.0, 2.0, 5)
FINE = 2001  # values that are integrated over, between those simulated
# How often the values next to the likeliest come closer by half, and the nats that they differ by where it ends.
CLOSER, ALIKE = 7, 0.5


class Opened(NamedTuple):
    """A backlash [m] with its posterior standard deviation, nats of evidence over a good rig's share of it, and that
    share."""

    value: float
    std: float
    worth: float
    good: float


def opened(simulator: Simulator, p: Array) -> Opened | None:
    """What the records say of the backlash of the rig `p` (size,); None where they say nothing, or no rig can be."""
    unknowns = simulator.layout.unknowns
    at, narrow = unknowns[BACKLASH].start, float(unknowns.prior()[unknowns[BACKLASH]][0])
    wide = float(unknowns.group(BACKLASH).wide[0])
    costs: dict[float, float] = {}

    def cost_of(value: float) -> float | None:
        there = p.copy()
        there[at] = value
        lines = simulator.lines(there)
        return None if lines is None else simulator.target.cost(simulator.target.lines - lines)

    def tried(values: Array) -> None:
        new = [value for value in dict.fromkeys(values) if value not in costs]
        found = zip(new, side_by_side(cost_of, new), strict=True)
        costs.update((value, cost) for value, cost in found if cost is not None)

    tried(np.concatenate([wide * TRIED, narrow * NEAR_NOTHING]))
    if 0.0 not in costs or max(costs.values()) - min(costs.values()) < ALIKE:
        return None
    for _ in range(CLOSER):
        values = np.array(sorted(costs))
        best = int(np.argmin([costs[value] for value in values]))
        around = values[max(best - 1, 0) : best + 2]
        if max(costs[value] for value in around) - costs[values[best]] < ALIKE:
            break
        tried((around[1:] + around[:-1]) / 2)
    tried_at = np.array(sorted(costs))
    values = np.union1d(tried_at, np.linspace(tried_at[0], tried_at[-1], FINE))
    nats = np.interp(values, tried_at, [costs[value] for value in tried_at])
    worth = _evidence(values, nats, wide) - _evidence(values, nats, narrow)
    value, std = _known(values, nats, wide)
    return Opened(value, std, worth, _known(values, nats, narrow)[0])


def _known(values: Array, nats: Array, width: float) -> tuple[float, float]:
    """Posterior mean and standard deviation under a prior of that width; of two peaks, the higher one."""
    weights = _weights(values, nats, width)
    likely = np.exp(weights - logsumexp(weights))
    mean = float(likely @ values)
    std = float(np.sqrt(likely @ (values - mean) ** 2))
    costs = nats + 0.5 * (values / width) ** 2
    if float(np.interp(mean, values, nats)) < nats[np.argmin(costs)] + 1.0:
        return mean, std
    return float(values[np.argmin(costs)]), std


def _weights(values: Array, nats: Array, width: float) -> Array:
    """Logarithms of likelihood, prior and part of the axis (values,)."""
    prior = -0.5 * (values / width) ** 2 - np.log(width * np.sqrt(2 * np.pi))
    return np.asarray(prior - nats + np.log(np.gradient(values)))


def _evidence(values: Array, nats: Array, width: float) -> float:
    """Logarithm of the evidence under a prior of that width."""
    return float(logsumexp(_weights(values, nats, width)))
