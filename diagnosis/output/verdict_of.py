"""The verdict that simulation justifies: the effects that entered, none, or unknown at a place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.decision import SHARPNESS, at_place, worst
from gearbench.diagnosis.evidence.search import Search
from gearbench.diagnosis.output.selection import LIMIT, Weighed
from gearbench.diagnosis.output.simulated import Simulated
from gearbench.diagnosis.output.target import FITTED
from gearbench.diagnosis.verdict import Outcome
from gearbench.rig.contract import Place

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Parts of a channel's fluctuation that must remain for a row, or a form without a name, to mean something unknown. A
# housing of 6 % of the supports' compliance, supports with cross-coupling and a drift of 0.4 % leave 0.17, which free
# forms describe though no row stands out; a slipping coupling leaves 0.155 in one row.
STRUCTURE, FORMED = 0.1, 0.25
# Part of what a channel lacks that an effect takes away for itself, from which no form without a name outbids it.
CLOSES = 0.5


@dataclass(frozen=True)
class Decided:
    """`verdict` effect, none or unknown; `place`; what entered (effect only); probabilities of the three; `because`
    says in one sentence what decided."""

    verdict: Outcome
    place: Place
    named: tuple[Weighed, ...]
    probability: dict[str, float]
    because: str


def decide_simulated(
    found: Simulated, forces: Search, silent: Array, unsteady: Array, limits: Limits = LIMITS
) -> Decided:
    """The decision. `silent`, `unsteady` (equations + 1,) of the force residuals are audits: they can refuse, and say
    where, what simulation leaves open."""
    selection = found.selection
    named = tuple(one for one in selection.entered if relative_size(found, one) > size_needed(one, limits))
    worth = max((one.log_bayes_factor for one in named), default=0.0)
    place, over = worst(unsteady, limits.unsteady)
    if over > 1.0:
        because = f"the force missing {at_place(place)} changes from one repetition to the next"
        return _unknown(place, because, over)
    free = forces.best_free
    needed = limits.competitor_factor * max(worth, _by_force(forces, named)) + limits.competitor_offset
    left = remainder(found)
    closed = bool(named) and max(1.0 - left[c] / max(without, 1e-300) for c, without in lacking(found).items()) > CLOSES
    open_still = not named and max(left.values()) > FORMED
    if free and free.log_bayes_factor > (needed if named else limits.free) and (open_still or (named and not closed)):
        place = free.hypothesis.place
        because = f"a force {at_place(place)} without any given form explains the records clearly better"
        return _unknown(place, because, free.log_bayes_factor / (needed if named else limits.free))
    if named:
        because = "simulated with it, the rig comes closer to the records than any rig without an effect"
        return Decided("effect", named[0].hypothesis.place, named, _probabilities(worth - LIMIT, 0.0), because)
    place, over = worst(silent, limits.silent)
    if over > 1.0 and max(left.values()) > STRUCTURE:
        because = f"a force {at_place(place)} remains that no effect of the library explains"
        return _unknown(place, because, over)
    ahead = max((one.log_bayes_factor for one in selection.weighed), default=-LIMIT)
    because = "no effect brings the simulation closer to the records than a good rig's share of it"
    return Decided("none", "none", (), _probabilities(min(ahead, LIMIT) - LIMIT, over), because)


def size_needed(one: Weighed, limits: Limits) -> float:
    """Size, over that of a background, from which an effect is named."""
    assert one.hypothesis.effect is not None
    return limits.size_of(one.hypothesis.effect)


def relative_size(found: Simulated, one: Weighed) -> float:
    """Rms of an effect's unknowns in standard deviations of the background, each by how much the records tell of it."""
    unknowns, best = found.layout.unknowns, found.selection.best
    at = one.hypothesis.entries(unknowns)
    told = np.clip(1.0 - (found.std[at] / np.maximum(best.sd[at], 1e-300)) ** 2, 1e-6, 1.0)
    return float(np.sqrt(np.average((best.p[at] / unknowns.prior()[at]) ** 2, weights=told)))


def remainder(found: Simulated) -> dict[str, float]:
    """Rms of what the best rig leaves over the measured fluctuation, by channel."""
    return _parts(found, found.selection.best.lines)


def lacking(found: Simulated) -> dict[str, float]:
    """The same of the best rig without an effect."""
    return _parts(found, found.selection.base.lines)


def _parts(found: Simulated, lines: Complex) -> dict[str, float]:
    target = found.simulator.target
    left = target.energies(target.lines - lines) * target.sizes
    whole = target.energies(target.lines) * target.sizes
    channels = np.array([block.channel for block in target.blocks])
    shares = {}
    for channel in FITTED:
        inside = channels == channel
        if inside.any() and whole[inside].sum() > 0.0:
            shares[channel] = float(np.sqrt(left[inside].sum() / whole[inside].sum()))
    return shares


def _by_force(forces: Search, named: tuple[Weighed, ...]) -> float:
    """Most evidence that the force residuals have for what is named."""
    names = {one.hypothesis.effect.name for one in named if one.hypothesis.effect}
    found = [
        one.log_bayes_factor for one in forces.tried if one.hypothesis.effect and one.hypothesis.effect.name in names
    ]
    return max(found, default=0.0)


def _unknown(place: Place, because: str, over: float) -> Decided:
    """How likely something unknown is follows from how far its sign lies beyond its limit."""
    unknown = 1.0 - 0.5 / max(over, 1.0)
    rest = 1.0 - unknown
    return Decided("unknown", place, (), {"effect": 0.5 * rest, "none": 0.5 * rest, "unknown": unknown}, because)


def _probabilities(ahead: float, over: float) -> dict[str, float]:
    """Of the three, by how far the evidence lies beyond the limit and how near a sign of the unknown comes to its."""
    effect = 1.0 / (1.0 + float(np.exp(-np.clip(ahead / SHARPNESS, -40, 40))))
    unknown = 0.05 + 0.2 * min(over, 1.0) ** 2 * (1.0 - effect)
    return {"effect": (1 - unknown) * effect, "none": (1 - unknown) * (1 - effect), "unknown": unknown}

