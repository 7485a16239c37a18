"""ISO 6336-3 root stress: section against the true fillet, factors against another programme, Lewis limit."""

from __future__ import annotations

from math import cos, pi, tan

import numpy as np
import pytest
from scipy.optimize import brentq

from gearbench.geometry import pair, profile
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.stiffness.iso6336_root import (
    correction_factor,
    form_factor,
    generating_shift,
    lever_arm,
    root_section,
    root_stress,
)
from gearbench.rig import Gear, Rig, Support, Supports

ALPHA = pi / 9


def rack(gear: Gear) -> tuple[float, float, float, float, float]:
    return gear.teeth, generating_shift(gear), gear.dedendum, gear.rack_tip_radius, gear.pressure_angle


def make_gear(teeth: int, shift: float, **changes: float) -> Gear:
    filled = {"module": 4e-3, "face_width": 0.04, "hub_radius": 1e-3 * teeth, "tip_edge_radius": 0.0, **changes}
    return Gear(teeth=teeth, profile_shift=shift, **filled)


GEARS = {
    "spur": make_gear(25, 0.2),
    "large": make_gear(100, -0.3),
    "rack D": make_gear(19, 0.5, dedendum=1.4, rack_tip_radius=0.39, addendum=0.9),
    "thinned": make_gear(30, 0.0, thinning=80e-6),
    "25 degrees": make_gear(30, 0.1, pressure_angle=25 * pi / 180, rack_tip_radius=0.25),
    "undercut": make_gear(12, 0.0),
}


@pytest.mark.parametrize("name", GEARS)
def test_section_and_lever_are_those_of_the_true_tooth(name: str) -> None:
    """The fillet's point with a tangent of 30 degrees to the axis is searched on the generated profile."""
    gear = GEARS[name]
    tooth = profile(gear)
    assert tooth.undercut == (name == "undercut")

    def slope(beta: float) -> float:
        x, y = tooth.fillet_normals(beta)
        return float(np.arctan2(y, x)) - pi / 3

    beta = brentq(slope, 0.0, tooth.beta_form, xtol=1e-15)
    x, y = tooth.fillet(beta)
    section = root_section(*rack(gear))
    assert section.chord * gear.module == pytest.approx(2 * y, rel=1e-10)
    assert section.radius * gear.module == pytest.approx(float(tooth.fillet_radius(beta)), rel=1e-9)
    rho = 0.3 * tooth.rho_form + 0.7 * tooth.rho_end
    point = tooth.involute(rho)
    normal = tooth.involute_normals(rho)
    # Line of action against the tooth's axis.
    crossing = point[0] - point[1] * normal[0] / normal[1]
    diameter = 2 * np.hypot(*point) / gear.module
    lever, angle = lever_arm(section, *rack(gear), diameter)
    assert lever * gear.module == pytest.approx(crossing - x, rel=1e-9)
    assert tan(angle) == pytest.approx(normal[0] / normal[1], rel=1e-9)


def test_factors_of_another_programme() -> None:
    """DIN 3990-11 (load at the tip, the same section and factors) by the programme din3990, its stored example:
    z = 19/104, x = 0.5/0.15, m = 4 mm, rack with 0.25 m radius. It stops its iteration of theta early."""
    wanted = ((19, 0.5, 88 / 4, 8.748743, 1.316148, 8.174658, 2.246336, 1.914726),)
    wanted += ((104, 0.15, 425.2 / 4, 9.239505, 1.325999, 7.834246, 2.161657, 2.008782),)
    for teeth, shift, diameter, chord, radius, lever, form, correction in wanted:
        tool = (teeth, shift, 1.25, 0.25, ALPHA)
        section = root_section(*tool)
        arm, angle = lever_arm(section, *tool, diameter)
        found = (
            4 * section.chord,
            4 * section.radius,
            4 * arm,
            form_factor(section.chord, arm, angle, ALPHA),
            correction_factor(section.chord, arm, section.radius),
        )
        assert found == pytest.approx((chord, radius, lever, form, correction), rel=1.1e-4)


def test_form_factor_is_bending_of_the_section() -> None:
    """Nominal stress without stress concentration: moment over section modulus of a rectangle."""
    force, width, module, chord, lever, angle = 1e4, 0.04, 4e-3, 8e-3, 7e-3, 0.4
    bending = force * cos(angle) * lever / (width * chord**2 / 6)
    tangential = force * cos(ALPHA)
    form = form_factor(chord / module, lever / module, angle, ALPHA)
    assert tangential / (width * module) * form == pytest.approx(bending, rel=1e-12)


def make_rig(driver: Gear, driven: Gear) -> Rig:
    support = Support(stiffness=1e8)
    return Rig(driver=driver, driven=driven, support=Supports(driver=support, driven=support))


def test_pair_takes_the_load_at_the_outer_point_of_single_contact() -> None:
    rig = make_rig(make_gear(20, 0.3), make_gear(40, -0.1))
    meshing = pair(rig)
    force = 5e3
    found = root_stress(rig, meshing, "driver", force)
    # ISO 6336-3, d_en: from the tip back along the path of contact by (eps - 1) base pitches.
    tooth = meshing.driver
    outer = tooth.rho_end - (meshing.contact_ratio - 1) * meshing.base_pitch
    point, normal = tooth.involute(outer), tooth.involute_normals(outer)
    beta = brentq(
        lambda b: float(np.arctan2(*tooth.fillet_normals(b)[::-1])) - pi / 3, 0.0, tooth.beta_form, xtol=1e-15
    )
    x, y = tooth.fillet(beta)
    lever = point[0] - point[1] * normal[0] / normal[1] - x
    bending = force * normal[1] * lever / (meshing.face_width * (2 * y) ** 2 / 6)
    assert found.lever == pytest.approx(lever, rel=1e-9)
    assert found.stress == pytest.approx(bending * found.correction, rel=1e-9)
    assert found.notes == ()
    other = root_stress(rig, meshing, "driven", force)
    mirrored = make_rig(rig.driven, rig.driver)
    assert other == root_stress(mirrored, pair(mirrored), "driver", force)


def test_contact_ratio_of_two_is_refused() -> None:
    rig = make_rig(
        make_gear(60, 0.0, addendum=1.3, dedendum=1.6, rack_tip_radius=0.2),
        make_gear(60, 0.0, addendum=1.3, dedendum=1.6, rack_tip_radius=0.2),
    )
    with pytest.raises(LumpedError, match="must be below 2"):
        root_stress(rig, pair(rig), "driver", 1e3)


def test_sharp_notches_are_noted() -> None:
    rig = make_rig(make_gear(60, 0.5, rack_tip_radius=0.0), make_gear(30, 0.0))
    assert "q_s" in root_stress(rig, pair(rig), "driver", 1e3).notes[0]
