"""Where formed flanks touch: a slope's gain written down, and ends of involutes that touch with their edges."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.geometry import pair
from gearbench.geometry.pair.touching import touching_excess
from gearbench.geometry.tooth.micro import profile_excess
from gearbench.rig import Gear, Rig, Support, Supports


def make_rig(driver: dict[str, Any] | None = None, driven: dict[str, Any] | None = None) -> Rig:
    gear = {"module": 3e-3, "face_width": 0.02, "thinning": 30e-6}
    support = Support(stiffness=1e8)
    return Rig(
        driver=Gear(teeth=20, hub_radius=16e-3, **gear, **(driver or {})),
        driven=Gear(teeth=30, hub_radius=25e-3, **gear, **(driven or {})),
        support=Supports(driver=support, driven=support),
    )


def excess_at(rig: Rig, rho: np.ndarray) -> np.ndarray:
    return touching_excess(pair(rig), (rig.driver, rig.driven), rho)


@pytest.mark.parametrize("side", ["driver", "driven"])
def test_a_linear_relief_gains_half_its_slope_squared_times_the_radius(side: str) -> None:
    start = {"driver": 62e-3, "driven": 92e-3}[side]
    rig = make_rig(**{side: {"tip_relief": 20e-6, "tip_relief_start_diameter": start}})
    meshing = pair(rig)
    shape = getattr(meshing, side)
    # On the relief, away from its start and from the tip by more than contact moves.
    first = np.sqrt(start**2 / 4 - shape.base_radius**2)
    own = np.linspace(first, shape.rho_end, 9)[3:-3]
    mate = meshing.line_of_action - own
    slope = 20e-6 / (shape.rho_end - first) * shape.base_radius / own  # over the way along the flank
    expected = -20e-6 * (own - first) / (shape.rho_end - first) + 0.5 * slope**2 / (1 / own + 1 / mate)
    found = excess_at(rig, own if side == "driver" else mate)
    np.testing.assert_allclose(found, expected, atol=3e-8)
    assert (0.5 * slope**2 / (1 / own + 1 / mate)).min() > 1.5e-7


def test_flanks_that_slope_little_touch_where_the_involutes_do() -> None:
    rig = make_rig({"profile_slope": 4e-6}, {"profile_slope": -3e-6})
    meshing = pair(rig)
    rho = np.linspace(*meshing.active_driver, 50)[1:-1]
    expected = profile_excess(meshing.driver, rig.driver, 0, rho)
    expected += profile_excess(meshing.driven, rig.driven, 0, meshing.line_of_action - rho)
    np.testing.assert_allclose(excess_at(rig, rho), expected, atol=1.5e-8)


def test_a_hollow_is_bridged_and_wear_of_the_whole_flank_is_not() -> None:
    """Over a notch narrower than the flanks' curvature bridges, contact goes on from one edge to the other."""
    rig = make_rig()
    meshing = pair(rig)
    place = meshing.rho_pitch[0]
    angles = tuple((place + np.array([-3e-3, -5e-5, 0.0, 5e-5, 3e-3])) / meshing.driver.base_radius)
    notched = make_rig({"profile_form": (0.0, 0.0, -20e-6, 0.0, 0.0), "profile_form_roll": angles})
    assert -1e-6 < excess_at(notched, np.array([place]))[0] < 0.0
    worn = make_rig({"wear": 5e-6}, {"wear": 2e-6})
    rho = np.linspace(*meshing.active_driver, 30)
    np.testing.assert_allclose(excess_at(worn, rho), -7e-6, atol=1e-12)


def test_before_the_path_begins_the_mates_edge_touches_further_up_the_flank() -> None:
    """A foot of the driver that stands proud closes the gap by what it has where the edge is, not where the involute's
    foot would touch."""
    rig = make_rig({"profile_form": (8e-6, 0.0), "profile_form_diameter": (56.6e-3, 66e-3)})
    meshing = pair(rig)
    begin, end = meshing.active_driver[0], meshing.driven.rho_end
    before = begin - 0.05 * meshing.base_pitch
    one, two = before, meshing.line_of_action - before
    # The way that the driven flank lacks, and where it leads on the driver's.
    way = (two**2 - end**2) / (2 * meshing.driven.base_radius)
    there = np.sqrt(one**2 + 2 * meshing.driver.base_radius * way)
    expected = profile_excess(meshing.driver, rig.driver, 0, np.array([there]))[0]
    assert there - begin > 0.1 * meshing.base_pitch
    assert excess_at(rig, np.array([before]))[0] == pytest.approx(expected, abs=1e-7)
