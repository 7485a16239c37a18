"""Limits of the decision, set on truth rigs of the calibration family (benchmarks/diagnosis.md tells how)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gearbench.diagnosis.effects.effect import Effect


@dataclass(frozen=True)
class Limits:
    """When what the search found counts.

    `effect`: log Bayes factor over the background from which an effect is named, if it is at least `size` times as
    large as a background and has at least the part `rival` of the log Bayes factor that any other effect of that size
    has; an effect may have a limit and a least size of its own. `free`: from which a free form alone means that
    something unknown is at work; a free form that beats the best effect by `competitor_factor` times its log Bayes
    factor plus `competitor_offset` refutes it. `silent`: sums of bins times log lambda, by place, that a sound rig does
    not exceed; `unsteady`: the same between repetitions.
    """

    effect: float
    size: float
    rival: float
    free: float
    competitor_factor: float
    competitor_offset: float
    silent: Mapping[str, float]
    unsteady: Mapping[str, float]

    def of(self, effect: Effect) -> float:
        """Log Bayes factor from which that effect is named."""
        return self.effect if effect.limit is None else effect.limit

    def size_of(self, effect: Effect) -> float:
        """Size, over that of a background, from which that effect is named."""
        return self.size if effect.least_size is None else effect.least_size


LIMITS = Limits(
    effect=4.0,
    size=2.0,
    rival=0.5,
    free=9.5,
    competitor_factor=1.5,
    competitor_offset=20.0,
    silent={"drive": 150.0, "driver-support": 250.0, "load": 2000.0, "driven-support": 250.0, "mesh": 1300.0},
    unsteady={"drive": 150.0, "driver-support": 150.0, "load": 1.0e4, "driven-support": 150.0, "mesh": 150.0},
)
