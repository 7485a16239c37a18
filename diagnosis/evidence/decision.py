"""The verdict that a search justifies: an effect, none, or unknown at a place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.search import Search, Tried
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.verdict import Outcome
from gearbench.rig.contract import Place

Array = NDArray[np.float64]

SHARPNESS = 3.0  # nats over which a probability goes from 1/2 to 3/4 or so


@dataclass(frozen=True)
class Decision:
    """`verdict` effects, none or unknown; `place`; the winner (effect only); probabilities of the three; `because` says
    in one sentence what decided."""

    verdict: Outcome
    place: Place
    winner: Tried | None
    probability: dict[str, float]
    because: str


def decide(search: Search, silent: Array, unsteady: Array, limits: Limits = LIMITS) -> Decision:
    """The decision. `silent` (equations + 1,) is what the best effect's fit (else the background's) leaves unexplained
    by equation, `unsteady` (equations + 1,) the excess scatter between repetitions."""
    best, free = named(search, limits), search.best_free
    place, over = worst(unsteady, limits.unsteady)
    if over > 1.0:
        return _unknown(place, f"the force missing {at_place(place)} changes from one repetition to the next", over)
    needed = limits.free
    if best:
        needed = limits.competitor_factor * best.log_bayes_factor + limits.competitor_offset
    if free and free.log_bayes_factor > needed:
        found = free.hypothesis.place
        because = f"a force {at_place(found)} without any given form explains the records clearly better"
        return _unknown(found, because, free.log_bayes_factor / needed)
    place, over = worst(silent, limits.silent)
    left = float(silent[PLACES.index(place)])
    if over > 1.0 and not (best and best.log_bayes_factor > left):
        return _unknown(place, f"a force {at_place(place)} remains that no effect of the library explains", over)
    if best:
        assert best.hypothesis.effect is not None
        margin = best.log_bayes_factor - limits.of(best.hypothesis.effect)
        because = "its evidence exceeds what rigs without an effect reach"
        return Decision("effects", best.hypothesis.place, best, _probabilities(margin), because)
    margins = [
        one.log_bayes_factor - limits.of(one.hypothesis.effect)
        for one in search.tried
        if one.hypothesis.effect and one.fit
    ]
    because = "no effect has more evidence than rigs without an effect give it"
    return Decision("none", "none", None, _probabilities(max(margins, default=-limits.effect)), because)


def named(search: Search, limits: Limits = LIMITS) -> Tried | None:
    """The best effect of the library whose evidence clears its limit and whose size the background does not have; none
    if another effect of that size, which does not clear its own limit, has much more evidence."""
    large = [
        one
        for one in search.tried
        if one.hypothesis.effect
        and one.fit is not None
        and one.size > limits.size_of(one.hypothesis.effect)
        and one.log_bayes_factor > 0.0
    ]
    cleared = [
        one for one in large if one.hypothesis.effect and one.log_bayes_factor > limits.of(one.hypothesis.effect)
    ]
    best = max(cleared, key=lambda one: one.log_bayes_factor, default=None)
    if best is None or best.log_bayes_factor < limits.rival * max(one.log_bayes_factor for one in large):
        return None
    return best


def worst(values: Array, limits: Mapping[str, float]) -> tuple[Place, float]:
    """The place whose value (equations + 1,) is largest over its limit, and that ratio."""
    over = values / np.array([limits[place] for place in PLACES])
    worst = int(np.argmax(over))
    return PLACES[worst], float(over[worst])


def at_place(place: str) -> str:
    """`in the mesh`, `at the drive`."""
    return f"{'in' if place == 'mesh' else 'at'} the {place.replace('-', ' ')}"


def unknown_by(over: float) -> dict[str, float]:
    """Probabilities where something unknown shows: by how far its sign lies beyond its limit."""
    unknown = 1.0 - 0.5 / max(over, 1.0)
    rest = 0.5 * (1.0 - unknown)
    return {"effect": rest, "none": rest, "unknown": unknown}


def _unknown(place: Place, because: str, over: float) -> Decision:
    return Decision("unknown", place, None, unknown_by(over), because)


def _probabilities(ahead: float) -> dict[str, float]:
    """Probabilities by how far the evidence lies beyond the limit."""
    effect = 1.0 / (1.0 + np.exp(-np.clip(ahead / SHARPNESS, -40, 40)))
    return {"effect": 0.95 * effect, "none": 0.95 * (1 - effect), "unknown": 1.0 - 0.95}
