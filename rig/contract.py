"""Names by which diagnoses, challenges and their files know what may be at work in a rig, and where.

They are a contract with other programs: a name is never changed, and new ones are added at the end.
"""

from __future__ import annotations

from typing import Literal, get_args

EFFECTS = (
    "backlash",
    "friction",
    "eccentricity",
    "pitch-error",
    "tooth-crack",
    "coupling",
    "bearing-nonlinearity",
    "contact-nonlinearity",
    "sensor-delay",
    "torque-ripple",
    "profile-error",
    "encoder-runout",
    "temperature-drift",
    "support-stiffness",
    "mesh-damping",
)
Place = Literal["mesh", "driver-support", "driven-support", "drive", "load", "sensor", "none"]
PLACES: tuple[str, ...] = get_args(Place)


def rank_of(effect: str) -> tuple[int, str]:
    """The order of effects in files and tables: that of the contract, others after it by name."""
    return (EFFECTS.index(effect), "") if effect in EFFECTS else (len(EFFECTS), effect)
