"""Micro-geometry over the whole space of gears: relief takes off, is continuous and monotone, and teeth differ only by
what is given for each of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from shared.gears import likely_gear

from gearbench.geometry import GeometryError, Profile, profile
from gearbench.geometry.tooth.micro import check_micro, excess, profile_excess, relief, teeth_alike
from gearbench.rig import Gear

SETTLED: dict[str, Any] = {
    "deadline": None,
    "derandomize": True,
    "database": None,
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
}
SHAPES = st.sampled_from(["linear", "parabolic"])
PART = st.floats(0.02, 0.98)


@st.composite
def relieved(draw: st.DrawFn) -> tuple[Gear, Profile, float, float]:
    """A gear with tip and root relief within the limits, its profile, and the roll lengths [m] where they start."""
    plain = draw(likely_gear())
    try:
        shape = profile(plain, "rig.driver")
    except GeometryError:
        assume(False)
        raise
    tip, root = (shape.rho_form + draw(PART) * (shape.rho_end - shape.rho_form) for _ in range(2))
    gear = plain.model_copy(
        update={
            "tip_relief": draw(st.floats(0.0, 0.1)) * plain.module,
            "tip_relief_start_diameter": 2 * float(np.hypot(shape.base_radius, tip)),
            "tip_relief_shape": draw(SHAPES),
            "root_relief": draw(st.floats(0.0, 0.1)) * plain.module,
            "root_relief_start_diameter": 2 * float(np.hypot(shape.base_radius, root)),
            "root_relief_shape": draw(SHAPES),
        }
    )
    return gear, shape, tip, root


@settings(max_examples=50, **SETTLED)
@given(relieved())
def test_relief_only_takes_off_and_is_continuous(case: tuple[Gear, Profile, float, float]) -> None:
    gear, shape, tip, root = case
    check_micro(shape, gear, "rig.driver")
    rho = np.linspace(shape.rho_form, shape.rho_end, 1001)
    off = relief(shape, gear, rho)
    tiny = 1e-9 * gear.module
    assert off.max() <= 0.0
    # Steepest: parabolic, twice the mean slope.
    steepest = 2 * (gear.tip_relief / (shape.rho_end - tip) + gear.root_relief / (root - shape.rho_form))
    assert np.abs(np.diff(off)).max() <= steepest * (rho[1] - rho[0]) * (1 + 1e-6) + tiny
    # Nothing where neither has begun; from there it only deepens towards the ends.
    untouched = (rho <= tip) & (rho >= root)
    assert np.abs(off[untouched]).max(initial=0.0) <= tiny
    assert np.diff(off[rho >= max(tip, root)]).max(initial=0.0) <= tiny
    assert np.diff(off[rho <= min(tip, root)]).min(initial=0.0) >= -tiny
    # Full amounts at the ends, by definition, where the other relief does not reach.
    if root <= tip:
        assert np.allclose(off[[0, -1]], [-gear.root_relief, -gear.tip_relief], rtol=1e-9, atol=tiny)


@settings(max_examples=25, **SETTLED)
@given(relieved())
def test_a_parabola_lies_inside_the_straight_line(case: tuple[Gear, Profile, float, float]) -> None:
    gear, shape, *_ = case
    rho = np.linspace(shape.rho_form, shape.rho_end, 101)
    names = ("tip_relief_shape", "root_relief_shape")
    line, parabola = (relief(shape, gear.model_copy(update=dict.fromkeys(names, kind)), rho) for kind in
                      ("linear", "parabolic"))  # fmt: skip
    assert np.all(parabola >= line - 1e-15)


@settings(max_examples=25, **SETTLED)
@given(relieved(), st.integers(-2000, 2000), st.floats(-0.1, 0.1), st.floats(0.0, 0.05))
def test_every_tooth_is_alike_unless_errors_are_given_for_it(
    case: tuple[Gear, Profile, float, float], tooth: int, slope: float, wear: float
) -> None:
    gear, shape, *_ = case
    gear = gear.model_copy(update={"profile_slope": slope * gear.module, "wear": wear * gear.module})
    rho = np.linspace(shape.rho_form, shape.rho_end, 41)
    assert teeth_alike(gear)
    first = excess(shape, gear, 0, rho)
    assert np.array_equal(excess(shape, gear, tooth, rho), first)
    # One tooth with an error of its own: it alone moves, as a whole, and again after a turn.
    which = tooth % gear.teeth
    errors = tuple(2e-6 if k == which else 0.0 for k in range(gear.teeth))
    wrong = gear.model_copy(update={"pitch_error": errors})
    assert not teeth_alike(wrong)
    np.testing.assert_allclose(excess(shape, wrong, tooth + gear.teeth, rho), first + 2e-6, rtol=0, atol=1e-15)
    assert np.array_equal(excess(shape, wrong, tooth + 1, rho), first)
    tilted = gear.model_copy(update={"profile_slope_tooth": errors})
    change = profile_excess(shape, tilted, which, rho) - first
    np.testing.assert_allclose(change, np.linspace(-1e-6, 1e-6, 41), rtol=0, atol=1e-14)


@settings(max_examples=25, **SETTLED)
@given(relieved(), st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=9), st.floats(0.0, 0.3))
def test_a_measured_table_is_followed_and_held_beyond_its_ends(
    case: tuple[Gear, Profile, float, float], heights: list[float], missing: float
) -> None:
    gear, shape, *_ = case
    values = np.array(heights) * gear.module
    low = shape.rho_form + missing * (shape.rho_end - shape.rho_form)
    places = np.linspace(low, shape.rho_end, len(values))
    gear = gear.model_copy(
        update={
            "tip_relief": 0.0,
            "root_relief": 0.0,
            "profile_form": tuple(values),
            "profile_form_roll": tuple(places / shape.base_radius),
        }
    )
    check_micro(shape, gear, "rig.driver")
    found = profile_excess(shape, gear, 0, places)
    np.testing.assert_allclose(found, values, rtol=0, atol=1e-9 * gear.module)
    between = profile_excess(shape, gear, 0, np.linspace(0.0, 1.2 * shape.rho_end, 301))
    assert values.min() - 1e-15 <= between.min() and between.max() <= values.max() + 1e-15
    assert between[0] == values[0] and between[-1] == values[-1]
