"""Properties of every gear that can exist, and of the refusals of those that cannot.

The examples are the same in every run; each test's number of them bounds its time.
"""

from __future__ import annotations

import re
from math import atan2, pi

import numpy as np
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import simpson
from shared.gears import any_gear, likely_gear, likely_pair
from shared.rack import rack_half_angle
from shared.rolling import outline, overlap

from gearbench.geometry import (
    GeometryError,
    Profile,
    data_sheet,
    full_mesh,
    gear_area,
    pair,
    profile,
    quality,
    sector_area,
    sector_mesh,
)
from gearbench.geometry.tooth.measure import over_pins, span
from gearbench.rig import Gear, Rig

SETTLED = {
    "deadline": None,
    "derandomize": True,
    "database": None,
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
}


def made(gear: Gear) -> Profile:
    """The gear's profile; gears that cannot exist are no examples."""
    try:
        return profile(gear, "rig.driver")
    except GeometryError:
        assume(False)
        raise


def is_a_sentence(text: str) -> bool:
    """Whether a refusal names a key with its value and says a limit, in one line."""
    named = re.match(r"rig\.(driver\.|driven\.)?[a-z_]+ ", text) and re.search(r" = -?\d", text)
    limited = re.search(r"at least|at most|must|no profile_shift helps|leaves no", text)
    return bool(named and limited) and "\n" not in text and "nan" not in text and len(text) < 320


@settings(max_examples=120, **SETTLED)
@given(any_gear())
def test_any_gear_is_made_or_refused_in_a_sentence(gear: Gear) -> None:
    try:
        tooth = profile(gear, "rig.driver")
    except GeometryError as error:
        assert is_a_sentence(str(error)), str(error)
        return
    assert 0 < tooth.root_radius <= tooth.form_radius + 1e-15 and tooth.form_radius < tooth.end_radius
    assert tooth.end_radius <= tooth.tip_radius * (1 + 1e-12) and tooth.tip_half_angle > 0
    assert gear.bore_radius <= gear.hub_radius < tooth.root_radius


@settings(max_examples=50, **SETTLED)
@given(likely_pair())
def test_any_pair_is_made_or_refused_in_a_sentence(rig: Rig) -> None:
    try:
        found = pair(rig)
    except GeometryError as error:
        assert is_a_sentence(str(error)), str(error)
        return
    assert found.contact_ratio >= 1 and found.backlash > -1e-12 and min(found.clearances) > -1e-12
    for tooth, (start, stop) in ((found.driver, found.active_driver), (found.driven, found.active_driven)):
        assert tooth.rho_form - 1e-12 <= start < stop <= tooth.rho_end + 1e-12
        assert not np.isinf(span(tooth).length) and not np.isinf(over_pins(tooth).dimension)
    for row in data_sheet(rig):
        assert not np.isinf(row.value) or "sliding" in row.name


@settings(max_examples=12, **SETTLED)
@given(likely_pair())
def test_no_pair_that_is_made_overlaps(rig: Rig) -> None:
    try:
        found = pair(rig)
    except GeometryError:
        assume(False)
    turn = 2 * pi / found.driver.teeth
    for side in (found, pair(rig.model_copy(update={"driver": rig.driven, "driven": rig.driver}))):
        turns = np.linspace(-1.5, 1.5, 241) * (turn if side is found else 2 * pi / side.driver.teeth)
        # Samples of the outline lie apart; the circular distance of steep fillets magnifies that.
        assert overlap(side, outline(side.driven)[40::4], outline(side.driver), turns) < 1e-3 * rig.driver.module


@settings(max_examples=15, **SETTLED)
@given(likely_gear(), st.floats(0.02, 0.98), st.floats(0.0, 1.0))
def test_every_profile_is_the_envelope_of_its_rack(gear: Gear, low: float, high: float) -> None:
    tooth = made(gear)
    for x, y in (tooth.fillet(low * tooth.beta_form), tooth.involute(_between(tooth, high))):
        radius = float(np.hypot(x, y))
        assert radius * abs(rack_half_angle(gear, radius) - atan2(y, x)) < 1e-9


def _between(tooth: Profile, part: float) -> float:
    return tooth.rho_form + part * (tooth.rho_end - tooth.rho_form)


def area_by_fans(tooth: Profile) -> float:
    """Area of the whole gear: triangles from the centre to the outline, sampled densely along each piece."""
    total = tooth.tip_radius**2 * tooth.tip_half_angle + tooth.root_radius**2 * tooth.root_half_angle
    turn = np.linspace(0.0, 1.0, 4001)
    # Even steps in roll length and in the tangent of the rack's normal resolve both ends.
    slope = np.linspace(0.0, np.tan(tooth.beta_form), 40001)
    bend = tooth.s_end + turn * (tooth.s_tip - tooth.s_end)
    for points in (tooth.fillet(np.arctan(slope)), tooth.involute(_between_all(tooth, turn)), tooth.points(bend)):
        x, y = points.T
        step = np.arange(len(x), dtype=float)
        # From root to tip the left flank turns clockwise; an undercut fillet turns back on its way.
        total -= float(simpson(x * np.gradient(y, step) - y * np.gradient(x, step), x=step))
    return tooth.teeth * total


def _between_all(tooth: Profile, part: np.ndarray) -> np.ndarray:
    return tooth.rho_form + part * (tooth.rho_end - tooth.rho_form)


@settings(max_examples=10, **SETTLED)
@given(likely_gear())
def test_the_mesh_of_every_gear_is_valid(gear: Gear) -> None:
    tooth = made(gear)
    mesh = sector_mesh(tooth, gear)
    found = quality(mesh)
    assert found.jacobian > 0.2
    assert np.degrees(found.angle) > 1.0
    exact = sector_area(tooth, gear.hub_radius)
    assert abs(found.area / exact - 1) < 5e-6
    assert abs(gear_area(tooth)[0] / area_by_fans(tooth) - 1) < 1e-6
    angle = 2 * pi / gear.teeth
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    scale = tooth.tip_radius
    assert np.abs(mesh.points[mesh.cut_low] @ turn.T - mesh.points[mesh.cut_high]).max() < 1e-15 * max(1.0, scale)
    assert np.abs(mesh.points[mesh.mirror] - mesh.points * [1.0, -1.0]).max() < 1e-15


@settings(max_examples=5, **SETTLED)
@given(likely_gear(), st.integers(5, 24))
def test_every_tooth_is_the_first_one_turned(gear: Gear, teeth: int) -> None:
    gear = gear.model_copy(update={"teeth": teeth, "hub_radius": 0.3 * gear.module})
    tooth = made(gear)
    sector = sector_mesh(tooth, gear)
    whole = full_mesh(sector)
    for k in range(teeth):
        angle = 2 * pi * k / teeth
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        assert np.abs(whole.points[whole.node_of[k]] - sector.points @ turn.T).max() < 4e-15 * tooth.tip_radius + 1e-18
    found = quality(whole)
    assert found.jacobian > 0.2
    area = teeth * sector_area(tooth, gear.hub_radius)
    assert abs(found.area / area - 1) < 5e-6
