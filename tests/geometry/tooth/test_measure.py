"""Thickness, span and dimension over pins against textbook formulas, the rolling rack, and gauges laid on points."""

from __future__ import annotations

from math import acos, atan2, cos, isnan, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from scipy.optimize import brentq
from shared.rack import GEARS, build, rack_half_angle

from gearbench.geometry import GeometryError, Profile
from gearbench.geometry.tooth.measure import chord, half_angle_at, over_pins, span, thickness

ALPHA = radians(20)


def inv(angle: float) -> float:
    return tan(angle) - angle


@pytest.mark.parametrize("name", GEARS)
def test_thickness_at_any_diameter_is_what_the_rack_leaves(name: str) -> None:
    gear, tooth = build(**GEARS[name])
    for radius in np.linspace(tooth.root_radius, tooth.end_radius, 14)[1:]:
        half = rack_half_angle(gear, radius)
        assert thickness(tooth, radius) == pytest.approx(2 * radius * half, abs=1e-9)
        across, height = chord(tooth, radius)
        assert across == pytest.approx(2 * radius * sin(half), abs=1e-9)
        assert height == pytest.approx(tooth.tip_radius - radius * cos(half), abs=1e-9)


def test_thickness_of_the_tip_edge() -> None:
    _, tooth = build(teeth=30, tip_edge_radius=200e-6)
    for s in np.linspace(tooth.s_end, tooth.s_tip, 7):
        x, y = tooth.points(s)
        assert half_angle_at(tooth, min(float(np.hypot(x, y)), tooth.tip_radius)) == pytest.approx(
            atan2(y, x), abs=1e-7
        )


def test_a_diameter_off_the_teeth_is_refused() -> None:
    _, tooth = build(teeth=30)
    with pytest.raises(GeometryError, match=r"diameter = 65 mm is not on the teeth: between 55 and 64 mm"):
        thickness(tooth, 32.5e-3)


@pytest.mark.parametrize("teeth, shift, thinning", [(30, 0.0, 0.0), (62, 0.3, 0.0), (17, 0.2, 80e-6), (100, -0.5, 0.0)])
def test_span_by_the_textbook(teeth: int, shift: float, thinning: float) -> None:
    _, tooth = build(teeth=teeth, profile_shift=shift, thinning=thinning)
    k, length = span(tooth)
    m = tooth.module
    # W_k = m cos(alpha) ((k - 1/2) pi + z inv(alpha)) + 2 x m sin(alpha); thinning takes cos(alpha) of itself.
    wanted = m * cos(ALPHA) * ((k - 0.5) * pi + teeth * inv(ALPHA)) + 2 * shift * m * sin(ALPHA) - thinning * cos(ALPHA)
    assert length == pytest.approx(wanted, abs=1e-12)
    # The jaws touch near mid-flank, at equal roll lengths on both flanks.
    assert abs(length / 2 - 0.5 * (tooth.rho_form + tooth.rho_end)) < 0.8 * tooth.base_pitch


def test_span_of_a_handbook() -> None:
    # Tables for 20 degrees, module 1, x = 0: z 30 over 4 teeth 10.7526, z 62 over 7 teeth 20.0589... per mm.
    _, tooth = build(teeth=30, module=1e-3)
    assert span(tooth).teeth == 4
    assert span(tooth).length == pytest.approx(10.7526e-3, abs=1e-7)


def ball_gap(tooth: Profile, pin: float, centre: float) -> float:
    """Smallest distance of a pin, its centre at that radius in the middle of the tooth space, from the flank."""
    flank = tooth.involute(np.linspace(tooth.rho_form, tooth.rho_end, 200001))
    middle = centre * np.array([cos(pi / tooth.teeth), sin(pi / tooth.teeth)])
    return float(np.hypot(*(flank - middle).T).min()) - pin / 2


@pytest.mark.parametrize("name", GEARS)
def test_pins_rest_on_the_flanks(name: str) -> None:
    _, tooth = build(**GEARS[name])
    pin, dimension = over_pins(tooth)
    if isnan(pin):
        assert name == "z150 negative"
        return
    across = (dimension - pin) / (cos(pi / 2 / tooth.teeth) if tooth.teeth % 2 else 1.0)
    assert abs(ball_gap(tooth, pin, across / 2)) < 1e-9
    rho = sqrt((across / 2) ** 2 - tooth.base_radius**2) - pin / 2
    assert tooth.rho_form < rho < tooth.rho_end


@pytest.mark.parametrize("teeth, shift", [(30, 0.0), (31, 0.2), (62, 0.0)])
def test_over_pins_by_the_textbook(teeth: int, shift: float) -> None:
    _, tooth = build(teeth=teeth, profile_shift=shift)
    m, pin = tooth.module, 1.728 * tooth.module
    # inv(phi) = d_p/(z m cos(alpha)) - pi/(2 z) + inv(alpha) + 2 x tan(alpha)/z
    rolled = pin / (teeth * m * cos(ALPHA)) - pi / (2 * teeth) + inv(ALPHA) + 2 * shift * tan(ALPHA) / teeth
    phi = brentq(lambda a: inv(a) - rolled, 0.01, 1.2, xtol=1e-15)
    wanted = teeth * m * cos(ALPHA) / cos(phi) * (cos(pi / 2 / teeth) if teeth % 2 else 1.0) + pin
    found = over_pins(tooth, pin)
    assert found.pin == pin
    assert found.dimension == pytest.approx(wanted, abs=1e-12)


def test_no_gauge_fits() -> None:
    _, tooth = build(teeth=30)
    assert isnan(over_pins(tooth, 0.1e-3).dimension)  # falls to the root
    assert isnan(over_pins(tooth, 9e-3).dimension)  # rests on the tips


def test_chord_of_the_standard_tooth() -> None:
    _, tooth = build(teeth=20)
    across, height = chord(tooth, tooth.reference_radius)
    assert across == pytest.approx(20 * 2e-3 * sin(pi / 40), abs=1e-12)
    assert height == pytest.approx(2e-3 + 20e-3 * (1 - cos(pi / 40)), abs=1e-12)
    assert acos(cos(half_angle_at(tooth, tooth.reference_radius))) == pytest.approx(pi / 40)
