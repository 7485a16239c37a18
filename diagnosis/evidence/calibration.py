"""Limits of the decision, set on truth rigs of the calibration family (benchmarks/diagnosis.md tells how)."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot


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

# Relative error in the size of rightly named effects on the calibration family, rms: what the model's simplicity leaves
# besides the noise that a fit knows of. At least 2 %, as four rigs of each do not tell less.
MODEL_ERROR = {
    "backlash": 0.06,
    "friction": 0.17,
    "eccentricity": 0.04,
    "pitch-error": 0.23,
    "tooth-crack": 0.30,
    "coupling": 0.02,
    "bearing-nonlinearity": 0.02,
    "sensor-delay": 0.02,
    "torque-ripple": 0.13,
}


def stated(effect: str, name: str, value: float, std: float) -> float:
    """Standard deviation to state for a parameter: the fit's `std` and the model's error; numbers of teeth and phases
    keep the fit's."""
    if name.endswith((".tooth", "_phase")):
        return std
    return hypot(std, MODEL_ERROR[effect] * value)
