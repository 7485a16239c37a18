"""What a check finds, and the units that a wrong factor hints at."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

# Factors by which a channel in a wrong unit is off, in words.
ANGLE_UNITS = {180 / pi: "degrees", 1 / (2 * pi): "turns", 1000.0: "mrad"}
TORQUE_UNITS = {1e3: "N mm", 1e-3: "kN m", 0.737562: "lbf ft", 8.850746: "lbf in", -1.0: "the other direction"}
# How well a factor must be met to be taken for a unit.
UNIT_MATCH = 0.1


@dataclass(frozen=True)
class Finding:
    """One thing found in a record.

    `sentence` names field, value and limit. `refused`: the record cannot be used. Of what can be right `error` says
    what it costs if it is not: the relative rms error, |G_est - G| / |G|, that it leaves in an identified response;
    `above` [Hz]: only there.
    """

    sentence: str
    refused: bool = True
    error: float = 0.0
    above: float | None = None


def unit_hint(factor: float, units: dict[float, str], channel: str, verb: str = "is") -> str:
    """A guess at the unit of a channel from the factor by which it is off, as the end of a sentence."""
    for known, name in units.items():
        if abs(factor / known - 1) < UNIT_MATCH:
            return f": {verb} {channel} in {name}?"
    return ""
