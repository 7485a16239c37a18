"""Every gear that cannot exist is refused in one sentence with key, value and limit; the limit itself is
allowed."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import radians
from typing import Any

import numpy as np
import pytest

from gearbench.geometry import GeometryError, body, data_sheet, pair, profile
from gearbench.geometry.pair.interference import fillet_clearance, with_tip
from gearbench.rig import Gear, Rig

MakeGear = Callable[..., Gear]
MakeRig = Callable[..., Rig]

ALONE = {
    "cut off": (
        {"teeth": 9, "profile_shift": -1.2, "dedendum": 1.4, "rack_tip_radius": 0.0, "addendum": 1.5},
        r"profile_shift = -1\.2 cuts the teeth off .*: at least (\S+) with",
        "profile_shift",
        1,
    ),
    "all thinned away": (
        {"thinning": 4.2e-3, "hub_radius": 1e-3},
        r"thinning_um = 4200 leaves nothing of the teeth: it must stay below (\S+)$",
        "",
        0,
    ),
    "hub too small": (
        {"hub_radius": 1e-6},
        r"hub_radius_mm = 0\.001 is too small to be meshed: at least (\S+) \(0\.001 modules\)",
        "hub_radius",
        1e-3,
    ),
    "nothing left of the involute": (
        {"teeth": 30, "profile_shift": -1.5, "tip_diameter": 56.2e-3, "tip_edge_radius": 0.0},
        r"tip_diameter_mm = 56\.2 leaves no involute: .* form diameter of (\S+) mm",
        "tip_diameter",
        1e-3,
    ),
    "pointed": (
        {"profile_shift": 0.6, "tip_diameter": 50e-3, "tip_edge_radius": 0.0},
        r"tip_diameter_mm = 50 makes the teeth pointed: it must stay below (\S+) mm",
        "tip_diameter",
        1e-3,
    ),
    "tip inside form circle": (
        {"tip_diameter": 37.6e-3, "tip_edge_radius": 0.0},
        r"tip_diameter_mm = 37\.6 leaves no involute: .* (\S+) mm",
        "tip_diameter",
        1e-3,
    ),
    "edge too large": (
        {"tip_edge_radius": 700e-6, "module": 1e-3},
        r"tip_edge_radius_um = 700 does not fit .* stay below (\S+) um",
        "tip_edge_radius",
        1e-6,
    ),
    "edge too small": (
        {"tip_edge_radius": 1e-8},
        r"tip_edge_radius_um = 0\.01 is too small .* at least (\S+)$",
        "tip_edge_radius",
        1e-6,
    ),
    "rack tip too round": (
        {"rack_tip_radius": 0.55},
        r"rack_tip_radius = 0\.55 does not fit .* at most (\S+) with",
        "rack_tip_radius",
        1,
    ),
    "rack tooth pointed": (
        {"dedendum": 2.3, "rack_tip_radius": 0.0, "teeth": 90},
        r"dedendum = 2\.3 makes the rack tooth pointed: at most (\S+) at",
        "dedendum",
        1,
    ),
    "hub beyond root": (
        {"hub_radius": 0.018},
        r"hub_radius_mm = 18 .* at most (\S+), that is",
        "hub_radius",
        1e-3,
    ),
    "bore beyond hub": (
        {"hub_radius": 0.01, "bore_radius": 0.011},
        r"bore_radius_mm = 11 .* at most hub_radius_mm = (\S+)$",
        "bore_radius",
        1e-3,
    ),
}


@pytest.mark.parametrize("name", ALONE)
def test_gear_refusals_name_a_limit_that_is_allowed(gear: MakeGear, name: str) -> None:
    changes, pattern, field, unit = ALONE[name]
    with pytest.raises(GeometryError) as error:
        profile(gear(**changes), "rig.driver")
    found = re.search(r"^rig\.driver\." + pattern, str(error.value))
    assert found, str(error.value)
    limit = float(found.group(1)) * unit
    if not field:  # another refusal stands there
        return
    # A limit that excludes itself ("must stay below") is printed to some digits short of it.
    profile(gear(**{**changes, field: limit}))


PAIRED: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any], str, str, float]] = {
    "module": (
        {},
        {"module": 2.5e-3},
        {},
        r"rig\.driven\.module_mm = 2\.5 must equal .* = (\S+)$",
        "module",
        1e-3,
    ),
    "pressure angle": (
        {},
        {"pressure_angle": radians(22.5)},
        {},
        r"rig\.driven\.pressure_angle_deg = 22\.5 must equal .* = (\S+)$",
        "pressure_angle",
        radians(1),
    ),
    "jammed": (
        {},
        {},
        {"centre_distance": 59.9e-3},
        r"rig\.centre_distance_mm = 59\.9 jams .* at least (\S+) mm",
        "",
        1e-3,
    ),
    "jammed, thinned": (
        {"thinning": 50e-6},
        {},
        {"centre_distance": 59.9e-3},
        r"rig\.centre_distance_mm = 59\.9 jams .* at least (\S+) mm",
        "",
        1e-3,
    ),
    "clearance": (
        {"teeth": 60, "rack_tip_radius": 0.0},
        {"teeth": 60, "tip_diameter": 125.1e-3},
        {},
        r"rig\.driven\.tip_diameter_mm = 125\.1 reaches into the root of rig\.driver: at most (\S+) with",
        "tip_diameter",
        1e-3,
    ),
    "interference": (
        {"teeth": 18, "dedendum": 1.25, "rack_tip_radius": 0.38},
        {"teeth": 100, "tip_diameter": 204.6e-3},
        {},
        r"rig\.driven\.tip_diameter_mm = 204\.6 inter.* form circle of rig\.driver .* at most (\S+) with",
        "tip_diameter",
        1e-3,
    ),
    "fillet": (
        {"teeth": 17, "profile_shift": 0.4, "rack_tip_radius": 0.4},
        {"teeth": 45, "tip_diameter": 94.45e-3},
        {},
        r"rig\.driven\.tip_diameter_mm = 94\.45 interferes: the tip cuts .* rig\.driver; at most (\S+) with",
        "tip_diameter",
        1e-3,
    ),
}


@pytest.mark.parametrize("name", PAIRED)
def test_pair_refusals_name_a_limit_that_is_allowed(gear: MakeGear, rig: MakeRig, name: str) -> None:
    driver, driven, common, pattern, field, unit = PAIRED[name]
    driven = {"teeth": 40, **driven}
    with pytest.raises(GeometryError) as error:
        pair(rig(gear(**driver), gear(**driven), **common))
    found = re.search("^" + pattern, str(error.value))
    assert found, str(error.value)
    limit = float(found.group(1)) * unit
    if field:
        driven[field] = limit
    else:
        common = {"centre_distance": limit}
    pair(rig(gear(**driver), gear(**driven), **common))


def test_a_rack_that_reaches_the_centre(gear: MakeGear) -> None:
    with pytest.raises(GeometryError, match=r"dedendum = 1\.5 leaves no root circle: at most 1\.4000 with teeth = 5"):
        profile(gear(teeth=5, profile_shift=-1.0, dedendum=1.5, hub_radius=1e-4, rack_tip_radius=0.1))


def test_impossible_centre_distance(gear: MakeGear, rig: MakeRig) -> None:
    with pytest.raises(GeometryError, match=r"^rig\.centre_distance_mm = 37 is impossible: .* 37\.587"):
        pair(rig(gear(), gear(), centre_distance=37e-3))


def test_shifts_that_leave_no_centre_distance(gear: MakeGear, rig: MakeRig) -> None:
    low = gear(teeth=70, profile_shift=-1.5)
    with pytest.raises(
        GeometryError, match=r"profile_shift = -3 leaves no centre distance .* exceed -2\.866"
    ):
        pair(rig(low, low))


def test_contact_ratio_below_one(gear: MakeGear, rig: MakeRig) -> None:
    stub = gear(teeth=24, addendum=0.5)
    with pytest.raises(GeometryError, match=r"gives a contact ratio of 0\.\d+ .* at least 1$"):
        pair(rig(stub, stub))
    pair(rig(gear(teeth=24, addendum=0.7), gear(teeth=24, addendum=0.7)))


@pytest.mark.parametrize("key, value", [("mass", 0.1), ("inertia", 1e-6)])
def test_totals_below_the_finite_element_body(gear: MakeGear, rig: MakeRig, key: str, value: float) -> None:
    light = gear(**{key: value})
    with pytest.raises(GeometryError) as error:
        data_sheet(rig(gear(), light))
    found = re.search(rf"^rig\.driven\.{key}_kg\S* = {value:g} is less .* at least (\S+)$", str(error.value))
    assert found
    body(profile(light), gear(**{key: float(found.group(1)) * (1 + 1e-5)}), 7810.0)


@pytest.mark.validation
def test_fillet_interference_is_real(gear: MakeGear, rig: MakeRig) -> None:
    """The refused tip does lie inside the mate's tooth at some rotation, as deep as the sentence says."""
    # A pair that is allowed, then the driven tip lengthened by hand.
    allowed = pair(rig(*(gear(**change) for change in FILLET)))
    place = (allowed.centre_distance, allowed.working_pressure_angle)
    driven = with_tip(allowed.driven, FILLET_TIP / 2)
    cut = -fillet_clearance(allowed.driver, driven, *place)
    assert cut > 1e-6
    beta = np.linspace(0, allowed.driver.beta_form, 2000)
    fillet = allowed.driver.fillet(beta)
    corner = driven.points(np.linspace(driven.s_end, driven.s_tip, 60))
    deepest = 0.0
    for turn in np.linspace(-0.25, 0.1, 1500):
        back = turn * allowed.driver.teeth / allowed.driven.teeth
        world = _turn(corner, np.pi + allowed.driven_angle - back) + np.array([place[0], 0.0])
        own = _turn(world, -(allowed.driver_angle + turn))
        # Inside the tooth: at the same radius the point stands at a smaller polar angle than the fillet.
        radius, angle = np.hypot(*own.T), np.arctan2(own[:, 1], own[:, 0])
        bound = np.interp(radius, np.hypot(*fillet.T), np.arctan2(fillet[:, 1], fillet[:, 0]))
        within = (radius < allowed.driver.form_radius) & (angle < bound)
        for point in own[within]:
            deepest = max(deepest, float(np.hypot(*(fillet - point).T).min()))
    assert deepest == pytest.approx(cut, rel=0.03)


FILLET = (
    {"teeth": 17, "profile_shift": 0.4, "rack_tip_radius": 0.4},
    {"teeth": 45, "tip_diameter": 94.2e-3},
)
FILLET_TIP = 94.6e-3


def _turn(points: np.ndarray, angle: float) -> np.ndarray:
    cosine, sine = np.cos(angle), np.sin(angle)
    return points @ np.array([[cosine, sine], [-sine, cosine]])
