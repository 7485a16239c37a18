"""The verdict that a search justifies: an effect, none, or unknown at a place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.calibration import LIMITS, Limits
from gearbench.diagnosis.search import Search, Tried
from gearbench.diagnosis.unknowns import ROWS

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
    best, free = found.best(free=False), found.best(free=True)
    gain = best.gain if best else 0.0
    worst = int(np.argmax(unsteady / np.array(limits.unsteady)))
    if unsteady[worst] > limits.unsteady[worst]:
        place = PLACE_OF_ROW[worst]
        return _unknown(place, f"periods differ by more than noise in the row of the {place}")
    if free and free.gain > max(limits.free, limits.competitor_factor * max(gain, 0.0) + limits.competitor_offset):
        return _unknown(free.hypothesis.place, f"a free form at the {free.hypothesis.place} explains clearly more")
    loud = int(np.argmax(silent / np.array(limits.silent)))
    if silent[loud] > limits.silent[loud] and not (best and gain > limits.effect and gain > silent[loud]):
        place = PLACE_OF_ROW[loud]
        return _unknown(place, f"the row of the {place} keeps what should be silent")
    if best and gain > limits.effect:
        return Decision(
            "effect", best.hypothesis.place, best, _shares(gain - limits.effect, 0.0), "its evidence clears the limit"
        )
    return Decision("none", "none", None, _shares(gain - limits.effect, 0.0), "no hypothesis clears its limit")


def _unknown(place: str, because: str) -> Decision:
    return Decision("unknown", place, None, {"effect": 0.1, "none": 0.05, "unknown": 0.85}, because)


def _shares(ahead: float, doubt: float) -> dict[str, float]:
    """Probabilities by how far the evidence lies beyond the limit."""
    effect = 1.0 / (1.0 + np.exp(-np.clip(ahead / SHARPNESS, -40, 40)))
    return {"effect": 0.95 * effect, "none": 0.95 * (1 - effect), "unknown": 1.0 - 0.95}
