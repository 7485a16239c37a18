"""The verdict that simulation justifies: the effects that entered, none, or unknown at a place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.decision import SHARPNESS, at_place, unknown_by, worst
from gearbench.diagnosis.evidence.search import Search
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.output.judged import Judged
from gearbench.diagnosis.output.missing import Missing
from gearbench.diagnosis.output.selection import LIMIT, Weighed
from gearbench.diagnosis.output.simulated import Simulated
from gearbench.diagnosis.verdict import Outcome
from gearbench.diagnosis.words import percent
from gearbench.rig.contract import Place

Array = NDArray[np.float64]

# Of the nominal gap, rms over rms and all channels in units of their own fluctuation: more than this part left is "the
# greater part"; content that changes between repetitions counts from the latter part on: a drift of 0.4 % makes 0.0014,
# sound and slipping rigs of the development family up to 0.006, a support that drifts by 4 % 0.08.
GREATER, CHANGING = 0.5, 0.03
# Part of a channel's fluctuation that sound rigs leave at most, whatever their structure beyond the unknowns is; from
# half of it on a place can stand out.
STRUCTURE, VISIBLE = 0.1, 0.05
# Part of the nominal gap that the named effects must close for content that changes, or a form without a name, not to
# outbid them.
CLOSES = 0.5


@dataclass(frozen=True)
class Decided:
    """`verdict` effects, none or unknown; `place`; what is named (effects only); probabilities of the three; `because`
    says in sentences what decided."""

    verdict: Outcome
    place: Place
    named: tuple[Weighed, ...]
    probability: dict[str, float]
    because: tuple[str, ...]


def decide_simulated(
    judged: Judged, forces: Search, missing: Missing, unsteady: Array, changing: float, limits: Limits = LIMITS
) -> Decided:
    """The decision on what was kept on the judged record. `missing` are the forces that the final rig lacks; `unsteady`
    (equations + 1,) the excess scatter between repetitions, by place, and `changing` the largest rms of what changes
    over that of the nominal gap."""
    selection = judged.found.selection
    named = selection.entered
    share = max((judged.share(judged.closings[one.hypothesis.name].without) for one in named), default=0.0)
    place, over = worst(unsteady, limits.unsteady)
    if over > 1.0 and changing > CHANGING and share < CLOSES:
        because = f"the force missing {at_place(place)} changes from one repetition to the next"
        return _unknown(place, because, changing / CHANGING)
    free = forces.best_free
    worth = max((one.log_bayes_factor for one in named), default=0.0)
    if named and free and share < CLOSES:
        needed = limits.competitor_factor * max(worth, _by_force(forces, named)) + limits.competitor_offset
        if free.log_bayes_factor > needed:
            place = free.hypothesis.place
            because = f"a force {at_place(place)} without any given form explains the records clearly better"
            return _unknown(place, because, free.log_bayes_factor / needed)
    place, over = outstanding(missing)
    size = judged.remains / STRUCTURE
    if named:
        because = "simulated with it, the rig comes closer to the records than any rig without an effect"
        said = _probabilities(worth - LIMIT, min(judged.left / GREATER, size))
        return Decided("effects", named[0].hypothesis.place, named, said, (because,))
    if size > 1.0 and judged.left > GREATER:
        because = "no effect of the library closes the gap, and the greater part of it stays"
        return _unknown(place if over > 1.0 else "none", because, min(judged.left / GREATER, size))
    if judged.remains > VISIBLE and over > 1.0:
        because = f"a force {at_place(place)} remains that no effect of the library explains"
        return _unknown(place, because, min(over, judged.remains / VISIBLE))
    ahead = max((one.log_bayes_factor for one in selection.weighed), default=-LIMIT)
    because = (
        "no effect brings the simulation closer to the records than a good rig's share of it; what remains, at most"
        f" {percent(judged.remains)} of any channel's fluctuation, is"
        + (f" within the {percent(STRUCTURE)} that sound rigs leave" if size <= 1.0 else " the smaller part of the gap")
    )
    seen = min(over, judged.remains / VISIBLE)
    said = _probabilities(min(ahead, LIMIT) - LIMIT, max(min(judged.left / GREATER, size), seen))
    return Decided("none", "none", (), said, (because,))


def outstanding(missing: Missing) -> tuple[Place, float]:
    """The place at which most is missing over what sound rigs leave there, and that ratio."""
    most = int(np.argmax(missing.over))
    return PLACES[most], float(missing.over[most])


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


def _by_force(forces: Search, named: tuple[Weighed, ...]) -> float:
    """Most evidence that the force residuals have for what is named."""
    names = {one.hypothesis.effect.name for one in named if one.hypothesis.effect}
    found = [
        one.log_bayes_factor for one in forces.tried if one.hypothesis.effect and one.hypothesis.effect.name in names
    ]
    return max(found, default=0.0)


def _unknown(place: Place, because: str, over: float) -> Decided:
    return Decided("unknown", place, (), unknown_by(over), (because,))


def _probabilities(ahead: float, over: float) -> dict[str, float]:
    """Of the three, by how far the evidence lies beyond the limit and how near a sign of the unknown comes to its."""
    effect = 1.0 / (1.0 + float(np.exp(-np.clip(ahead / SHARPNESS, -40, 40))))
    unknown = (0.5 - 0.4 * effect) * over**2 / (1.0 + over**2)
    return {"effect": (1 - unknown) * effect, "none": (1 - unknown) * (1 - effect), "unknown": unknown}
