"""The verdict that a search justifies: an effect, none, or unknown at a place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.search import Search, Tried
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import Unsteady
from gearbench.diagnosis.verdict import Outcome
from gearbench.rig.contract import Place

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Decision:
    """`verdict` effects, none or unknown; `place`; the winner (effect only); the largest `sign` of something unknown
    over its limit; `because` says in one sentence what decided."""

    verdict: Outcome
    place: Place
    winner: Tried | None
    sign: float
    because: str


def decide(search: Search, silent: Array, unsteady: Unsteady, limits: Limits = LIMITS) -> Decision:
    """The decision. `silent` (equations + 1,) is what the best effect's fit (else the background's) leaves unexplained
    by equation, `unsteady` the excess scatter between repetitions."""
    best, free = named(search, limits), search.best_free
    place, over = unsteady.worst(limits.unsteady)
    if over > 1.0:
        because = f"the force missing {at_place(place)} changes from one repetition to the next"
        return Decision("unknown", place, None, over, because)
    needed = limits.free
    if best:
        needed = limits.competitor_factor * best.log_bayes_factor + limits.competitor_offset
    if free and free.log_bayes_factor > needed:
        found = free.hypothesis.place
        because = f"a force {at_place(found)} without any given form explains the records clearly better"
        return Decision("unknown", found, None, free.log_bayes_factor / needed, because)
    place, over = worst(silent, limits.silent)
    left = float(silent[PLACES.index(place)])
    if over > 1.0 and not (best and best.log_bayes_factor > left):
        because = f"a force {at_place(place)} remains that no effect of the library explains"
        return Decision("unknown", place, None, over, because)
    if best:
        because = "its evidence exceeds what rigs without an effect reach"
        return Decision("effects", best.hypothesis.place, best, min(over, 1.0), because)
    because = "no effect has more evidence than rigs without an effect give it"
    return Decision("none", "none", None, over, because)


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


def likeliest_fit(search: Search) -> Fit:
    """The fit of the effect that is named, or of the background."""
    best = named(search)
    return best.fit if best is not None and best.fit is not None else search.base


def worst(values: Array, limits: Mapping[str, float]) -> tuple[Place, float]:
    """The place whose value (equations + 1,) is largest over its limit, and that ratio."""
    over = values / np.array([limits[place] for place in PLACES])
    worst = int(np.argmax(over))
    return PLACES[worst], float(over[worst])


def at_place(place: str) -> str:
    """`in the mesh`, `at the drive`."""
    return f"{'in' if place == 'mesh' else 'at'} the {place.replace('-', ' ')}"
