"""The verdict that a search justifies: an effect, none, or unknown at a place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.search import Search, Tried
from gearbench.diagnosis.forces.unknowns import ROWS

Array = NDArray[np.float64]

PLACE_OF_ROW = (*ROWS, "mesh")
SHARPNESS = 3.0  # nats over which a probability goes from 1/2 to 3/4 or so


@dataclass(frozen=True)
class Decision:
    """`verdict` effect, none or unknown; `place`; the winner (effect only); probabilities of the three; `because` says
    in one sentence what decided."""

    verdict: str
    place: str
    winner: Tried | None
    probability: dict[str, float]
    because: str


def decide(found: Search, silent: Array, unsteady: Array, limits: Limits = LIMITS) -> Decision:
    """The decision. `silent` (rows + 1,) is what the best effect's fit (else the background's) leaves unexplained by
    row, `unsteady` (rows + 1,) the excess scatter between periods."""
    best, free = named(found, limits), found.best_free
    worst = int(np.argmax(unsteady / np.array(limits.unsteady)))
    if unsteady[worst] > limits.unsteady[worst]:
        place = PLACE_OF_ROW[worst]
        return _unknown(place, f"periods differ by more than noise in the row of the {place}")
    needed = limits.free if best is None else limits.competitor_factor * best.gain + limits.competitor_offset
    if free and free.gain > needed:
        return _unknown(free.hypothesis.place, f"a free form at the {free.hypothesis.place} explains clearly more")
    loud = int(np.argmax(silent / np.array(limits.silent)))
    if silent[loud] > limits.silent[loud] and not (best and best.gain > silent[loud]):
        place = PLACE_OF_ROW[loud]
        return _unknown(place, f"the row of the {place} keeps what should be silent")
    if best:
        ahead = best.gain - limits.of(best.hypothesis.effect)
        return Decision("effect", best.hypothesis.place, best, _shares(ahead), "its evidence clears the limit")
    gains = [one.gain - limits.of(one.hypothesis.effect) for one in found.tried if one.hypothesis.effect and one.fit]
    return Decision("none", "none", None, _shares(max(gains, default=-limits.effect)), "no hypothesis clears its limit")


def named(found: Search, limits: Limits = LIMITS) -> Tried | None:
    """The best effect of the library whose evidence clears its limit and whose size the background does not have; none
    if another effect of that size, which does not clear its own limit, has much more evidence."""
    large = [
        one
        for one in found.tried
        if one.hypothesis.effect and one.fit is not None and one.size > limits.size and one.gain > 0.0
    ]
    cleared = [one for one in large if one.gain > limits.of(one.hypothesis.effect)]
    best = max(cleared, key=lambda one: one.gain, default=None)
    if best is None or best.gain < limits.rival * max(one.gain for one in large):
        return None
    return best


def _unknown(place: str, because: str) -> Decision:
    return Decision("unknown", place, None, {"effect": 0.1, "none": 0.05, "unknown": 0.85}, because)


def _shares(ahead: float) -> dict[str, float]:
    """Probabilities by how far the evidence lies beyond the limit."""
    effect = 1.0 / (1.0 + np.exp(-np.clip(ahead / SHARPNESS, -40, 40)))
    return {"effect": 0.95 * effect, "none": 0.95 * (1 - effect), "unknown": 1.0 - 0.95}
