"""Pair kinematics against hand-written closed forms and against the flanks placed in the world."""

from __future__ import annotations

from collections.abc import Callable
from math import acos, cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

from gearbench.geometry import Pair, Profile, inverse_involute, pair
from gearbench.rig import Gear, Rig

MakeGear = Callable[..., Gear]
MakeRig = Callable[..., Rig]


def rotated(points: np.ndarray, angle: float) -> np.ndarray:
    return points @ np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])


def placed(meshing: Pair, which: str, points: np.ndarray, turn: float) -> np.ndarray:
    """Points of a gear in the world when the driver has turned by `turn` from mesh phase 0."""
    if which == "driver":
        return rotated(points, meshing.driver_angle + turn)
    back = turn * meshing.driver.teeth / meshing.driven.teeth
    return rotated(points, pi + meshing.driven_angle - back) + np.array([meshing.centre_distance, 0.0])


def polygon(tooth: Profile) -> np.ndarray:
    """One tooth as a closed polygon, from root to root."""
    fillet = tooth.fillet(np.linspace(0, tooth.beta_form, 800))
    flank = tooth.points(np.linspace(tooth.s_form, tooth.s_tip, 1600))
    half = np.concatenate((fillet, flank))
    return np.concatenate((half, half[::-1] * [1.0, -1.0]))


def depth_inside(outline: np.ndarray, points: np.ndarray) -> float:
    """How deep the deepest of `points` lies in the polygon (0: none inside)."""
    a, b = outline, np.roll(outline, -1, axis=0)
    deepest = 0.0
    for x, y in points:
        crosses = (a[:, 1] > y) != (b[:, 1] > y)
        left = x < a[crosses, 0] + (y - a[crosses, 1]) * (b - a)[crosses, 0] / (b - a)[crosses, 1]
        if left.sum() % 2:
            deepest = max(deepest, float(np.hypot(*(outline - [x, y]).T).min()))
    return deepest


def test_documented_pair_has_the_documented_contact_ratio(gear: MakeGear, rig: MakeRig) -> None:
    # z 62/62, m 2 mm, 20 deg: ROSS's multi-rotor example states 1.7898.
    one = gear(teeth=62, bore_radius=0.0175, hub_radius=0.0175, tip_edge_radius=0.0)
    found = pair(rig(one, one))
    assert found.contact_ratio == pytest.approx(1.7898, abs=5e-5)
    rounded = pair(rig(gear(teeth=62), gear(teeth=62)))
    assert rounded.contact_ratio_sharp == pytest.approx(found.contact_ratio, abs=1e-14)
    assert rounded.contact_ratio < found.contact_ratio - 0.01


@pytest.mark.parametrize("z1, z2, m", [(62, 62, 2e-3), (20, 40, 3e-3), (50, 150, 1e-3), (18, 54, 3.175e-3)])
def test_contact_ratio_in_closed_form(gear: MakeGear, rig: MakeRig, z1: int, z2: int, m: float) -> None:
    alpha = radians(20)
    found = pair(
        rig(gear(teeth=z1, module=m, tip_edge_radius=0.0), gear(teeth=z2, module=m, tip_edge_radius=0.0))
    )
    path = -(z1 + z2) * m / 2 * sin(alpha)
    for z in (z1, z2):
        path += sqrt((z * m / 2 + m) ** 2 - (z * m / 2 * cos(alpha)) ** 2)
    assert found.base_pitch == pytest.approx(pi * m * cos(alpha), abs=1e-15)
    assert found.contact_ratio * found.base_pitch == pytest.approx(path, abs=1e-12)
    assert found.working_pressure_angle == pytest.approx(alpha, abs=1e-12)
    assert found.centre_distance == pytest.approx((z1 + z2) * m / 2, abs=1e-15)
    assert found.backlash == pytest.approx(0.0, abs=1e-15)
    assert found.clearances == pytest.approx((0.25 * m, 0.25 * m), abs=1e-14)


def test_shifted_pair_without_backlash(gear: MakeGear, rig: MakeRig) -> None:
    # DIN 3960 / ISO 21771 by hand: inv alpha_w = inv alpha + 2 tan(alpha) (x1 + x2)/(z1 + z2).
    found = pair(rig(gear(teeth=20, profile_shift=0.4), gear(teeth=45, profile_shift=0.25, addendum=0.95)))
    alpha = radians(20)
    aw = found.working_pressure_angle
    assert tan(aw) - aw == pytest.approx(tan(alpha) - alpha + 2 * tan(alpha) * 0.65 / 65, abs=1e-15)
    assert found.centre_distance == pytest.approx(65e-3 * cos(alpha) / cos(aw), abs=1e-15)
    assert found.backlash == pytest.approx(0.0, abs=1e-15)


def test_backlash_of_thinning_and_of_centre_distance(gear: MakeGear, rig: MakeRig) -> None:
    thin = pair(rig(gear(teeth=30, thinning=40e-6), gear(teeth=50, thinning=70e-6)))
    assert thin.backlash == pytest.approx(110e-6, abs=1e-12)
    assert thin.backlash_normal == pytest.approx(110e-6 * cos(radians(20)), abs=1e-12)
    wide = pair(rig(gear(teeth=30), gear(teeth=50), centre_distance=80.2e-3))
    alpha, aw = radians(20), acos(80 / 80.2 * cos(radians(20)))
    opened = 2 * 80.2e-3 * ((tan(aw) - aw) - (tan(alpha) - alpha))
    assert wide.backlash == pytest.approx(opened, abs=1e-12)


@pytest.mark.parametrize("distance", [None, 51.9e-3])
def test_flanks_touch_on_the_line_of_action(gear: MakeGear, rig: MakeRig, distance: float | None) -> None:
    found = pair(
        rig(gear(teeth=17, profile_shift=0.3), gear(teeth=34, profile_shift=0.1), centre_distance=distance)
    )
    pitch = np.array([found.pitch_radii[0], 0.0])
    first, last = found.active_driver
    for rho in np.linspace(first, last, 7):
        turn = (rho - found.rho_pitch[0]) / found.driver.base_radius
        other = found.line_of_action - rho
        one = placed(found, "driver", found.driver.involute(rho), turn)
        two = placed(found, "driven", found.driven.involute(other), turn)
        assert np.allclose(one, two, atol=1e-15)
        # The normal there is the line of action: through the pitch point, inclined by the working pressure
        # angle.
        normal = rotated(found.driver.involute_normals(rho), found.driver_angle + turn)
        assert np.allclose(
            normal, [sin(found.working_pressure_angle), cos(found.working_pressure_angle)], atol=1e-14
        )
        assert abs(np.cross(np.append(one - pitch, 0), np.append(normal, 0))[2]) < 1e-15
    assert placed(found, "driver", found.driver.involute(found.rho_pitch[0]), 0.0) == pytest.approx(pitch)
    assert found.active_driven == pytest.approx((found.line_of_action - last, found.line_of_action - first))


def test_driven_flank_of_an_allowed_pair_never_enters_the_driver(gear: MakeGear, rig: MakeRig) -> None:
    found = pair(rig(gear(teeth=20), gear(teeth=40)))
    outline, tip = polygon(found.driver), found.driven.points(np.linspace(0.9, 1, 40) * found.driven.s_tip)
    for turn in np.linspace(-0.3, 0.3, 61):
        world = placed(found, "driven", tip, turn)
        own = rotated(world, -(found.driver_angle + turn))
        assert depth_inside(outline, own) < 2e-7


def test_inverse_involute() -> None:
    for angle in (1e-4, 0.05, 0.35, 0.8, 1.3, 1.55):
        assert inverse_involute(tan(angle) - angle) == pytest.approx(angle, rel=1e-7)
    assert inverse_involute(0.0) == 0.0
    with pytest.raises(ValueError, match="at least 0"):
        inverse_involute(-1e-3)


def test_face_width_is_the_smaller(gear: MakeGear, rig: MakeRig) -> None:
    assert pair(rig(gear(face_width=0.016), gear(face_width=0.02))).face_width == 0.016
