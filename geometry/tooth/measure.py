"""What an inspector measures on a gear: thickness at any diameter, chord, span over teeth, dimension over pins.

Formulas: ISO 21771:2007, section 7, written with the polar angle psi_b of the involute's origin: the tooth is
2 rb psi_b thick on the base circle, so thinning needs no terms of its own.
"""

from __future__ import annotations

from math import atan2, cos, hypot, nan, pi, sin, sqrt, tan
from typing import NamedTuple

import numpy as np

from gearbench.geometry.error import GeometryError
from gearbench.geometry.tooth.profile import Profile
from gearbench.geometry.tooth.roots import bracketed_root

# Pins are rounded to this part of the module.
PIN_STEP = 0.01


class Span(NamedTuple):
    """Base tangent length [m] over a number of teeth; nan with 0 teeth where no span touches both flanks."""

    teeth: int
    length: float


class OverPins(NamedTuple):
    """Pin diameter and dimension over two pins [m]; nan where no pin rests on both flanks."""

    pin: float
    dimension: float


def half_angle_at(tooth: Profile, radius: float) -> float:
    """Polar angle of the working side of the outline at a radius [m] between root and tip circle, be it fillet,
    involute or tip edge. Raises GeometryError outside."""
    if not tooth.root_radius <= radius <= tooth.tip_radius:
        raise GeometryError(
            f"diameter = {2e3 * radius:g} mm is not on the teeth: between {2e3 * tooth.root_radius:g} and"
            f" {2e3 * tooth.tip_radius:g} mm"
        )
    if radius > tooth.end_radius:
        x, y = tooth.edge_centre
        reach = hypot(x, y)
        cosine = (radius**2 + reach**2 - tooth.edge_radius**2) / (2 * radius * reach)
        return atan2(y, x) + float(np.arccos(min(1.0, cosine)))
    if radius >= tooth.form_radius:
        return float(tooth.half_angle(radius))
    beta = 0.0
    if radius > np.hypot(*tooth.fillet(0.0)):
        beta = bracketed_root(
            lambda b: np.hypot(*tooth.fillet(b)) - radius, 0.0, tooth.beta_form, xtol=1e-15, rtol=1e-14
        )
    x, y = tooth.fillet(beta)
    return atan2(y, x)


def thickness(tooth: Profile, radius: float) -> float:
    """Tooth thickness [m] as an arc of the circle of that radius, anywhere between root and tip circle."""
    return 2 * radius * half_angle_at(tooth, radius)


def chord(tooth: Profile, radius: float) -> tuple[float, float]:
    """Chordal tooth thickness at a radius, and the chord's height below the tip (chordal addendum) [m]."""
    half = half_angle_at(tooth, radius)
    return 2 * radius * sin(half), tooth.tip_radius - radius * cos(half)


def _middle_roll(tooth: Profile) -> float:
    """Roll length where gauges should touch: on the circle of radius r + x m (as cut), if that is on the flank."""
    middle = 0.5 * (tooth.rho_form + tooth.rho_end)
    cut = tooth.reference_radius + _generating_shift(tooth)
    if cut <= tooth.base_radius:
        return middle
    rho = sqrt(cut**2 - tooth.base_radius**2)
    return rho if tooth.rho_form < rho < tooth.rho_end else middle


def _generating_shift(tooth: Profile) -> float:
    """Shift [m] of the rack that cut the tooth, from its thickness."""
    half = float(tooth.half_angle(tooth.reference_radius))
    return tooth.reference_radius * (half - pi / 2 / tooth.teeth) / tan(tooth.pressure_angle)


def span(tooth: Profile) -> Span:
    """Base tangent length over the number of teeth (at least 2) whose contacts lie nearest to mid-flank."""
    base = 2 * tooth.base_radius * tooth.psi_b
    wanted = 2 * _middle_roll(tooth)
    near = 1 + round((wanted - base) / tooth.base_pitch)
    lengths = [(k, (k - 1) * tooth.base_pitch + base) for k in (near - 1, near, near + 1) if k >= 2]
    touching = [(k, w) for k, w in lengths if tooth.rho_form <= w / 2 <= tooth.rho_end]
    if not touching:
        return Span(0, nan)
    return Span(*min(touching, key=lambda item: abs(item[1] - wanted)))


def over_pins(tooth: Profile, pin: float | None = None) -> OverPins:
    """Dimension over two pins in opposite tooth spaces (with odd teeth half a pitch off). Without a `pin` diameter
    the one that touches at mid-flank is taken, rounded to module/100."""
    rb, space = tooth.base_radius, pi / tooth.teeth - tooth.psi_b
    if pin is None:
        rho = _middle_roll(tooth)
        angle = rho / rb + space  # pressure angle at the pin's centre
        if not 0.0 < angle < 1.5:
            return OverPins(nan, nan)
        step = PIN_STEP * tooth.module
        pin = step * round(2 * (rb * tan(angle) - rho) / step)
    rolled = pin / (2 * rb) - space
    if pin <= 0.0 or rolled <= 0.0:
        return OverPins(nan, nan)
    slope = bracketed_root(lambda t: t - np.arctan(t) - rolled, 0.0, rolled + 2.0, xtol=1e-16, rtol=1e-15)
    centre = rb * sqrt(1 + slope * slope)
    touching = tooth.rho_form <= rb * slope - pin / 2 <= tooth.rho_end
    if not touching or centre - pin / 2 < tooth.root_radius:
        return OverPins(nan, nan)
    across = 2 * centre * (cos(pi / 2 / tooth.teeth) if tooth.teeth % 2 else 1.0)
    return OverPins(pin, across + pin)
