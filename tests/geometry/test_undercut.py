"""Undercut: the trochoid ends the involute where the rolling rack leaves off, and pairs run on what is left."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import atan2, cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq
from shared.rack import build, rack_half_angle
from shared.rolling import outline, overlap

from gearbench.geometry import GeometryError, Profile, pair, profile
from gearbench.geometry.pair.interference import with_tip
from gearbench.rig import Gear, Rig

MakeGear = Callable[..., Gear]
MakeRig = Callable[..., Rig]

CASES = [(8, 0.0, 0.38), (10, 0.0, 0.0), (12, -0.3, 0.2), (20, -0.7, 0.38), (30, -1.2, 0.38), (17, -0.01, 0.38)]


@pytest.mark.parametrize("teeth, shift, rounding", CASES)
def test_form_radius_is_where_the_rack_leaves_the_involute(teeth: int, shift: float, rounding: float) -> None:
    gear, tooth = build(teeth=teeth, profile_shift=shift, rack_tip_radius=rounding, tip_edge_radius=0.0)
    assert tooth.undercut and tooth.form_radius > tooth.base_radius

    def removed(radius: float) -> float:
        """How much of the involute the rack takes off at a radius, along the circle."""
        return radius * (float(tooth.half_angle(radius)) - rack_half_angle(gear, radius))

    # The rack leaves the involute outside the form circle and takes some of it inside.
    assert abs(removed(tooth.form_radius + 1e-6)) < 1e-9
    for part in (0.3, 0.7):
        inside = tooth.base_radius + part * (tooth.form_radius - tooth.base_radius)
        assert removed(inside) > 1e-12
        assert removed(inside) == pytest.approx(depth_of_cut(tooth, inside), abs=1e-9)


def depth_of_cut(tooth: Profile, radius: float) -> float:
    beta = brentq(lambda value: np.hypot(*tooth.fillet(value)) - radius, 0.0, tooth.beta_form)
    x, y = tooth.fillet(beta)
    return radius * (float(tooth.half_angle(radius)) - atan2(y, x))


def test_undercut_begins_where_the_textbook_says() -> None:
    # With a sharp rack x_min = h_f - z sin^2(alpha)/2 (ISO 21771 and every textbook; h_f in modules).
    for teeth, dedendum in ((10, 1.0), (14, 1.0), (17, 1.25)):
        limit = dedendum - teeth * sin(radians(20)) ** 2 / 2
        common = {"teeth": teeth, "dedendum": dedendum, "rack_tip_radius": 0.0, "addendum": 0.5}
        assert not build(profile_shift=limit + 1e-9, **common)[1].undercut
        below = build(profile_shift=limit - 1e-4, **common)[1]
        assert below.undercut
        # There the form circle jumps from the base circle to half of the virtual roll length.
        assert below.rho_form == pytest.approx(0.5e-4 * below.module / sin(radians(20)), rel=1e-2)


@pytest.mark.parametrize("by", [1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2])
def test_a_slight_undercut_is_as_exact_as_a_deep_one(by: float) -> None:
    limit = 1.25 - 17 * sin(radians(20)) ** 2 / 2
    gear, tooth = build(teeth=17, profile_shift=limit - by, rack_tip_radius=0.0)
    assert tooth.undercut or by < 1e-8
    assert np.allclose(tooth.fillet(tooth.beta_form), tooth.involute(tooth.rho_form), rtol=0, atol=1e-15)
    for rho in tooth.rho_form + np.array([0.0, 1e-6, 1e-4]):
        point = tooth.involute(rho)
        radius = float(np.hypot(*point))
        assert radius * abs(rack_half_angle(gear, radius) - atan2(point[1], point[0])) < 1e-10


def test_contact_begins_at_the_form_circle(gear: MakeGear, rig: MakeRig) -> None:
    found = pair(rig(gear(teeth=10), gear(teeth=30)))
    # Without undercut the wheel's tip would reach beyond the tangent point of the line of action.
    assert found.line_of_action < found.driven.rho_end
    assert found.active_driver[0] == found.driver.rho_form
    assert found.active_driven[1] == found.line_of_action - found.driver.rho_form
    alpha, m = radians(20), 2e-3
    tip = sqrt((6 * m) ** 2 - (5 * m * cos(alpha)) ** 2)
    assert found.contact_ratio_sharp == pytest.approx((tip - found.driver.rho_form) / (pi * m * cos(alpha)), rel=1e-12)
    turned = pair(rig(gear(teeth=30), gear(teeth=10)))
    assert turned.active_driver == pytest.approx(found.active_driven)
    assert turned.contact_ratio == pytest.approx(found.contact_ratio, rel=1e-12)


def test_a_pair_without_enough_involute_is_refused(gear: MakeGear, rig: MakeRig) -> None:
    with pytest.raises(GeometryError, match=r"contact ratio of 0\.\d+ .*: at least 1$"):
        pair(rig(gear(teeth=8), gear(teeth=30)))


TURNS = np.linspace(-0.6, 0.4, 601)


@pytest.mark.parametrize("first, second", [((10, 0.0), (30, 0.0)), ((12, -0.2), (40, 0.0))])
def test_undercut_gives_way_to_the_wheel(
    gear: MakeGear, rig: MakeRig, first: tuple[int, float], second: tuple[int, float]
) -> None:
    found = pair(rig(*(gear(teeth=z, profile_shift=x) for z, x in (first, second))))
    assert found.driver.undercut
    assert overlap(found, outline(found.driven)[40:], outline(found.driver), TURNS) < 1e-6


@pytest.mark.parametrize("teeth", [10, 14])
def test_a_tip_longer_than_the_rack_cuts_into_the_undercut_flank(gear: MakeGear, rig: MakeRig, teeth: int) -> None:
    pinion = gear(teeth=teeth, rack_tip_radius=0.45)
    wheel = {"teeth": 62, "tip_edge_radius": 0.0, "dedendum": 1.3}
    with pytest.raises(GeometryError, match=r"tip_diameter_mm = 128\.45 interferes: the tip cuts 21\.1 um") as error:
        pair(rig(pinion, gear(**wheel, tip_diameter=128.45e-3)))
    found = re.search(r"at most (\S+) with", str(error.value))
    assert found and 128 < float(found.group(1)) < 128.4
    allowed = pair(rig(pinion, gear(**wheel, tip_diameter=float(found.group(1)) * 1e-3)))
    assert overlap(allowed, outline(allowed.driven)[40:], outline(allowed.driver), TURNS) < 1e-6
    long = with_tip(allowed.driven, 64.225e-3)
    assert overlap(allowed, outline(long)[40:], outline(allowed.driver), TURNS) == pytest.approx(21e-6, rel=0.5)


def test_profile_of_a_severed_tooth_is_refused(gear: MakeGear) -> None:
    with pytest.raises(GeometryError, match="cuts the teeth off"):
        profile(gear(teeth=6, profile_shift=-1.0, dedendum=1.2, hub_radius=1e-4))


def test_a_trochoid_that_winds_behind_the_gear_is_refused_too() -> None:
    # Polar angles beyond 180 degrees: z 5 at 10.3 degrees, x = -0.5.
    with pytest.raises(GeometryError, match=r"profile_shift = -0\.5 .* at least"):
        build(
            teeth=5,
            module=0.2e-3,
            pressure_angle=0.1796875,
            profile_shift=-0.5,
            dedendum=1.5,
            rack_tip_radius=0.0,
            tip_edge_radius=0.0,
            hub_radius=0.2e-3,
        )
