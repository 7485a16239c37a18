"""Limits of the decision, calibrated on truth rigs of the calibration family (benchmarks/diagnosis.md tells how)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """When what the search found counts.

    `effect`: log evidence over the background from which an effect is named; `free`: from which a free form alone means
    that something unknown is at work; a free form that beats the best effect by `competitor_factor` times its evidence
    plus `competitor_offset` refutes it. `silent`: sums of bins times log lambda, by row (drive, driver support, load,
    driven support, mesh), that a sound rig does not exceed; `unsteady`: the same between periods. `second`: evidence
    that a second effect must add.
    """

    effect: float
    free: float
    competitor_factor: float
    competitor_offset: float
    silent: tuple[float, float, float, float, float]
    unsteady: tuple[float, float, float, float, float]
    second: float


LIMITS = Limits(
    effect=4.0,
    free=20.0,
    competitor_factor=1.5,
    competitor_offset=20.0,
    silent=(600.0, 2500.0, 1500.0, 2500.0, 1500.0),
    unsteady=(300.0, 300.0, 1200.0, 300.0, 300.0),
    second=40.0,
)
