"""The words of places, channels and sizes, as verdicts and reports say them."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, isfinite, log10

PLACES = {
    "mesh": "in the mesh",
    "driver-support": "at the driver's support",
    "driven-support": "at the driven gear's support",
    "drive": "at the drive",
    "load": "at the load",
    "sensor": "in a sensor",
    "none": "at no place",
}
CHANNELS = {
    "dte": "transmission error",
    "angle_driver": "angle of the driver",
    "angle_driven": "angle of the driven gear",
    "y_driver": "displacement of the driver",
    "y_driven": "displacement of the driven gear",
    "torque_driver": "torque on the driver",
    "torque_driven": "torque on the driven gear",
    "force": "missing force",
}
# How a unit is shown: (factor, unit).
SHOWN_UNITS = {"m": (1e6, "um"), "rad": (1e6, "urad"), "1": (1.0, "")}


def with_parts(noun: str, on: Sequence[str], form: str = "") -> str:
    """`run-out of a gear (driver)`: a noun and the parts that it is about, or its form where it is about none."""
    about = ", ".join(CHANNELS.get(one, one) for one in on) or form
    return f"{noun} ({about})" if about else noun


def number(value: float, digits: int = 3) -> str:
    """A number with that many significant digits, without exponent between 1e-3 and 1e6."""
    if not isfinite(value):
        return str(value)
    if value == 0:
        return "0"
    power = floor(log10(abs(value)))
    if power < -3 or power >= 6:
        return f"{value:.{digits - 1}e}".replace("e-0", "e-").replace("e+0", "e")
    rounded = round(value, digits - 1 - power)
    power = floor(log10(abs(rounded)))  # 9.996 has become 10.0
    return f"{rounded:.{max(0, digits - 1 - power)}f}"


def length(value: float, digits: int = 3) -> str:
    """A number with that many significant digits but at most four decimals: a tenth of a nanometre in um."""
    if not isfinite(value) or abs(value) >= 1e-4 * 10 ** (digits - 1):
        return number(value, digits)
    return f"{value:.4f}" if round(value, 4) else "0"


def percent(value: float) -> str:
    """A probability or share: `97 %`, `0.4 %`, never 100 % for less than all."""
    if 0.995 <= value < 1.0:
        return "> 99 %"
    if 0.0 < value < 0.001:
        return "< 0.1 %"
    return f"{100 * value:.1f} %" if value < 0.1 and value else f"{100 * value:.0f} %"


def band_in_words(band: tuple[float, float]) -> str:
    """`20-3000 Hz`, or `mean` for the band [0, 0]."""
    return "mean" if band[1] == 0 else f"{band[0]:g}–{band[1]:g} Hz"
