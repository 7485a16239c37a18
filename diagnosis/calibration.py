"""Limits of the decision, set on truth rigs of the calibration family (benchmarks/diagnosis.md tells how)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """When what the search found counts.

    `effect`: log evidence over the background from which an effect is named, if it is at least `size` times as large as
    a background and has at least the part `rival` of the evidence that any other effect of that size has; `own`: the
    evidence that effects need which a rig's structure imitates more easily; `free`: from which
    a free form alone means that something unknown is at work; a free form that beats the best effect by
    `competitor_factor` times its evidence plus `competitor_offset` refutes it.
    `silent`: sums of bins times log lambda, by row (drive, driver support, load, driven support, mesh), that a sound
    rig does not exceed; `unsteady`: the same between periods.
    """

    effect: float
    size: float
    rival: float
    own: dict[str, float]
    free: float
    competitor_factor: float
    competitor_offset: float
    silent: tuple[float, float, float, float, float]
    unsteady: tuple[float, float, float, float, float]

    def of(self, effect: str) -> float:
        """Log evidence from which that effect is named."""
        return self.own.get(effect, self.effect)


LIMITS = Limits(
    effect=4.0,
    size=2.0,
    rival=0.5,
    own={"pitch-error": 60.0},
    free=9.5,
    competitor_factor=1.5,
    competitor_offset=20.0,
    silent=(150.0, 250.0, 2000.0, 250.0, 1300.0),
    unsteady=(150.0, 150.0, 1.0e4, 150.0, 150.0),
)
