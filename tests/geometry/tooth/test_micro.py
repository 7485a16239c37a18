"""Micro-geometry against its definitions: amounts where they are given, shapes between, tables, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.geometry import GeometryError
from gearbench.geometry.tooth.micro import (
    check_micro,
    excess,
    profile_excess,
    relief,
    roll_length,
    slope_excess,
    teeth_alike,
)
from gearbench.geometry.tooth.profile import Profile, profile
from gearbench.rig import Gear

START = 63e-3  # of tip relief; the tip circle is 66 mm, the reference circle 60 mm


def gear(**changes: Any) -> Gear:
    data = {"teeth": 20, "module": 3e-3, "face_width": 0.02, "hub_radius": 0.02}
    return Gear(**{**data, **changes})


@pytest.fixture(scope="module")
def shape() -> Profile:
    return profile(gear())


def test_roll_length_is_that_of_the_involute(shape: Profile) -> None:
    rho = np.linspace(shape.rho_form, shape.rho_end, 7)
    radius = np.hypot(*shape.involute(rho).T)
    np.testing.assert_allclose(roll_length(shape, 2 * radius), rho, rtol=1e-12)
    assert np.isnan(roll_length(shape, shape.base_radius))


@pytest.mark.parametrize(("kind", "power"), [("linear", 1), ("parabolic", 2)])
def test_reliefs_are_full_at_the_ends_and_zero_before_they_start(shape: Profile, kind: str, power: int) -> None:
    both = gear(
        tip_relief=20e-6, tip_relief_start_diameter=START, tip_relief_shape=kind,
        root_relief=8e-6, root_relief_start_diameter=58e-3, root_relief_shape=kind,
    )  # fmt: skip
    tip, root = float(roll_length(shape, START)), float(roll_length(shape, 58e-3))
    places = [shape.rho_form, root, 0.5 * (root + tip), tip, 0.5 * (tip + shape.rho_end), shape.rho_end]
    expected = [-8e-6, 0.0, 0.0, 0.0, -20e-6 * 0.5**power, -20e-6]
    np.testing.assert_allclose(relief(shape, both, places), expected, rtol=1e-12, atol=1e-20)


def test_slope_is_the_rise_from_form_circle_to_tip(shape: Profile) -> None:
    ends = slope_excess(shape, 7e-6, [shape.rho_form, shape.rho_end])
    np.testing.assert_allclose(ends, [-3.5e-6, 3.5e-6], rtol=1e-12)
    per_tooth = gear(profile_slope=2e-6, profile_slope_tooth=tuple(1e-6 * i for i in range(20)))
    for tooth in (0, 5, 25):
        rise = np.diff(profile_excess(shape, per_tooth, tooth, [shape.rho_form, shape.rho_end]))[0]
        assert rise == pytest.approx((2 + tooth % 20) * 1e-6, rel=1e-12)


def test_form_tables_over_diameter_and_over_roll_agree(shape: Profile) -> None:
    diameter = np.linspace(56.5e-3, 66e-3, 40)
    height = 3e-6 * np.sin(diameter / 1e-3)
    over_diameter = gear(profile_form=tuple(height), profile_form_diameter=tuple(diameter))
    roll = np.sqrt((diameter / 2) ** 2 - shape.base_radius**2) / shape.base_radius
    over_roll = gear(profile_form=tuple(height), profile_form_roll=tuple(roll))
    rho = np.linspace(shape.rho_form, shape.rho_end, 23)
    np.testing.assert_allclose(excess(shape, over_diameter, 0, rho), excess(shape, over_roll, 0, rho), atol=1e-18)
    np.testing.assert_allclose(excess(shape, over_roll, 0, roll[3:5] * shape.base_radius), height[3:5], rtol=1e-9)


def test_wear_takes_material_off_and_pitch_errors_add_it(shape: Profile) -> None:
    rho = np.linspace(shape.rho_form, shape.rho_end, 5)
    roll = (0.5 * shape.rho_form / shape.base_radius, 1.1 * shape.rho_end / shape.base_radius)
    worn = gear(
        wear=1e-6, wear_depth=(0.0, 4e-6), wear_roll=roll, wear_tooth=(2.0, *[0.0] * 19),
        pitch_error=tuple(1e-6 * i for i in range(20)),
    )  # fmt: skip
    depth = 1e-6 + 4e-6 * (rho / shape.base_radius - roll[0]) / (roll[1] - roll[0])
    np.testing.assert_allclose(excess(shape, worn, 0, rho), -2 * depth, rtol=1e-12)
    np.testing.assert_allclose(excess(shape, worn, 3, rho), 3e-6, rtol=1e-12)
    assert teeth_alike(gear(wear=1e-6)) and not teeth_alike(worn)


def test_an_ideal_gear_has_no_excess(shape: Profile) -> None:
    rho = np.linspace(0.0, 2 * shape.rho_end, 9)
    assert not excess(shape, gear(), 4, rho).any() and teeth_alike(gear())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tip_relief": 1e-5, "tip_relief_start_diameter": 70e-3}, ["tip_relief_start_diameter_mm = 70", "between"]),
        ({"root_relief": 1e-5, "root_relief_start_diameter": 50e-3}, ["root_relief_start_diameter_mm = 50", "form"]),
        (
            {"profile_form": (0.0, 1e-6), "profile_form_diameter": (64e-3, 65e-3)},
            ["profile_form_diameter_mm runs from 64 to 65 mm", "at least 50%"],
        ),
        ({"wear_depth": (0.0, 1e-6), "wear_roll": (1.0, 1.2)}, ["wear_roll_deg runs from 57.2958", "covers 0%"]),
    ],
)
def test_what_misses_the_flank_is_refused(shape: Profile, changes: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(GeometryError) as caught:
        check_micro(shape, gear(**changes), "rig.driver")
    assert str(caught.value).startswith("rig.driver.")
    for word in words:
        assert word in str(caught.value)
