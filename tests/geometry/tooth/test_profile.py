"""The profile against closed forms and against the envelope of the rolling rack."""

from __future__ import annotations

from math import acos, cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shared.rack import GEARS, build, rack_half_angle

from gearbench.geometry import GeometryError


@pytest.mark.parametrize("name", GEARS)
def test_flank_and_fillet_are_the_envelope_of_the_rack(name: str) -> None:
    gear, tooth = build(**GEARS[name])
    fillet = tooth.fillet(np.linspace(0.02, 1.0, 12) * tooth.beta_form)
    flank = tooth.involute(np.linspace(tooth.rho_form, tooth.rho_end, 12))
    for point in np.concatenate((fillet, flank)):
        radius = float(np.hypot(*point))
        left = rack_half_angle(gear, radius)
        assert radius * abs(left - np.arctan2(point[1], point[0])) < 1e-9
    # Just outside the root circle the rack leaves what the root land's end says.
    assert tooth.fillet(0.0) == pytest.approx(
        tooth.root_radius * np.array([cos(a := pi / tooth.teeth - tooth.root_half_angle), sin(a)]), abs=1e-12
    )


@pytest.mark.parametrize("name", GEARS)
def test_involute_in_closed_form(name: str) -> None:
    gear, tooth = build(**GEARS[name])
    alpha = gear.pressure_angle
    reference = gear.module * gear.teeth / 2
    base = reference * cos(alpha)
    thickness = gear.module * (pi / 2 + 2 * gear.profile_shift * tan(alpha)) - gear.thinning
    for radius in np.linspace(tooth.form_radius, tooth.end_radius, 9)[1:-1]:
        here = acos(base / radius)
        half = thickness / (2 * reference) + (tan(alpha) - alpha) - (tan(here) - here)
        point = tooth.involute(sqrt(radius**2 - base**2))
        assert np.allclose(point, radius * np.array([cos(half), sin(half)]), atol=1e-14)
        assert tooth.thickness(radius) == pytest.approx(2 * radius * half, abs=1e-14)
    assert tooth.thickness(reference) == pytest.approx(thickness, abs=1e-15)
    assert tooth.base_pitch == pytest.approx(pi * gear.module * cos(alpha), abs=1e-15)


@pytest.mark.parametrize("name", GEARS)
def test_normals_are_perpendicular_and_point_out(name: str) -> None:
    _, tooth = build(**GEARS[name])
    s = np.linspace(tooth.s_form, tooth.s_tip, 8000)
    beta = np.linspace(0.0, tooth.beta_form, 8000)
    for points, normals in (
        (tooth.points(s), tooth.normals(s)),
        (tooth.fillet(beta), tooth.fillet_normals(beta)),
    ):
        chord = np.diff(points, axis=0)
        chord /= np.linalg.norm(chord, axis=1)[:, None]
        middle = 0.5 * (normals[1:] + normals[:-1])
        skip = np.einsum("ij,ij->i", normals[1:], normals[:-1]) < 0.999  # the corner of a sharp tip
        assert np.abs(np.einsum("ij,ij->i", chord, middle))[~skip].max() < 2e-3
        # Counter-clockwise of the chord towards the tip lies the tooth space.
        outward = np.sign(np.diff(np.linalg.norm(points, axis=1)))
        turned = chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]
        assert np.all((turned * outward)[~skip] > 0.9)


@pytest.mark.parametrize("name", GEARS)
def test_arc_lengths(name: str) -> None:
    _, tooth = build(**GEARS[name])
    for points, length in (
        (tooth.fillet(np.linspace(0, tooth.beta_form, 20001)), float(tooth.fillet_length(tooth.beta_form))),
        (tooth.points(np.linspace(tooth.s_form, tooth.s_tip, 20001)), tooth.s_tip - tooth.s_form),
    ):
        polygon = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert polygon == pytest.approx(length, rel=1e-6, abs=1e-12)
    inside = np.linspace(0.0, float(tooth.fillet_length(tooth.beta_form)), 50)
    assert np.allclose(tooth.fillet_length(tooth.fillet_beta(inside)), inside, atol=1e-15)


@pytest.mark.parametrize("edge", [0.0, 20e-6, 200e-6])
def test_tip_edge_is_tangent_to_flank_and_tip_circle(edge: float) -> None:
    _, tooth = build(teeth=30, tip_edge_radius=edge)
    centre = tooth.edge_centre
    assert np.hypot(*centre) + edge == pytest.approx(tooth.tip_radius, abs=1e-15)
    end = tooth.involute(tooth.rho_end)
    assert np.allclose(end - edge * tooth.involute_normals(tooth.rho_end), centre, atol=1e-15)
    tip = tooth.points(tooth.s_tip)
    assert np.hypot(*tip) == pytest.approx(tooth.tip_radius, abs=1e-15)
    assert np.arctan2(tip[1], tip[0]) == pytest.approx(tooth.tip_half_angle, abs=1e-13)
    if edge:
        assert np.allclose(tooth.normals(tooth.s_tip), centre / np.hypot(*centre), atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(
    teeth=st.integers(8, 200),
    shift=st.floats(-1.4, 1.9),
    rounding=st.floats(0.0, 0.5),
    dedendum=st.floats(0.9, 1.6),
    alpha=st.floats(14.0, 26.0),
    thinning=st.floats(0.0, 1e-4),
)
def test_fillet_meets_the_involute_in_position_and_direction(
    teeth: int, shift: float, rounding: float, dedendum: float, alpha: float, thinning: float
) -> None:
    try:
        _, tooth = build(
            teeth=teeth,
            profile_shift=shift,
            rack_tip_radius=rounding,
            dedendum=dedendum,
            pressure_angle=radians(alpha),
            thinning=thinning,
            addendum=0.5,
            tip_edge_radius=0.0,
        )
    except GeometryError:
        assume(False)
    assert np.allclose(tooth.fillet(tooth.beta_form), tooth.involute(tooth.rho_form), atol=1e-15)
    below, above = tooth.fillet_normals(tooth.beta_form), tooth.involute_normals(tooth.rho_form)
    corner = above[0] * below[1] - above[1] * below[0]
    assert corner > 0.0 if tooth.undercut else abs(corner) < 1e-13
    # The fillet climbs from the root circle without a loop.
    radii = np.linalg.norm(tooth.fillet(np.linspace(0, tooth.beta_form, 200)), axis=1)
    assert radii[0] == pytest.approx(tooth.root_radius, abs=1e-15)
    assert np.all(np.diff(radii) >= -1e-15)
