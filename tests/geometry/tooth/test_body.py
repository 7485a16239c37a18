"""Areas, masses and inertias against integrals that do not use the outline's quadrature."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import pi

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from gearbench.geometry import Profile, body, gear_area, profile, sector_area
from gearbench.rig import Gear

MakeGear = Callable[..., Gear]


def half_angle(tooth: Profile, radius: float) -> float:
    """Polar angle up to which the half tooth is solid at `radius`: involute in closed form, the rest
    tabulated."""
    if tooth.form_radius <= radius <= tooth.end_radius:
        roll = np.sqrt((radius / tooth.base_radius) ** 2 - 1)
        return tooth.psi_b - (roll - np.arctan(roll))
    if radius > tooth.end_radius:
        centre = tooth.edge_centre
        reach = np.hypot(*centre)
        cosine = (radius**2 + reach**2 - tooth.edge_radius**2) / (2 * radius * reach)
        return float(np.arctan2(centre[1], centre[0]) + np.arccos(min(1.0, cosine)))
    low, high = 0.0, tooth.beta_form
    if np.hypot(*tooth.fillet(low)) < radius < np.hypot(*tooth.fillet(high)):
        low = brentq(lambda beta: np.hypot(*tooth.fillet(beta)) - radius, low, high, xtol=1e-15)
    elif np.hypot(*tooth.fillet(high)) <= radius:
        low = high
    point = tooth.fillet(low)
    return float(np.arctan2(point[1], point[0]))


def integral(tooth: Profile, power: int) -> float:
    """Integral of r^power over the whole gear without bore, by rings."""

    def ring(radius: float) -> float:
        return 2 * tooth.teeth * half_angle(tooth, radius) * radius ** (power + 1)

    marks = [tooth.root_radius, tooth.form_radius, tooth.end_radius, tooth.tip_radius]
    rings = sum(quad(ring, a, b, epsabs=0, epsrel=1e-11, limit=200)[0] for a, b in pairwise(marks))
    return rings + 2 * pi * tooth.root_radius ** (power + 2) / (power + 2)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        pytest.param({"teeth": 62, "thinning": 60e-6}, marks=pytest.mark.validation),
        {"teeth": 12, "profile_shift": 0.5},
        {"teeth": 30, "rack_tip_radius": 0.0},
    ],
)
def test_area_and_second_moment_by_rings(gear: MakeGear, changes: dict[str, float]) -> None:
    tooth = profile(gear(**changes))
    area, second = gear_area(tooth)
    assert area == pytest.approx(integral(tooth, 0), rel=1e-9)
    assert second == pytest.approx(integral(tooth, 2), rel=1e-9)
    hub = 0.4 * tooth.root_radius
    assert sector_area(tooth, hub) * tooth.teeth == pytest.approx(area - pi * hub**2, rel=1e-12)


def test_masses_add_up(gear: MakeGear) -> None:
    one = gear(teeth=62, bore_radius=0.0175, hub_radius=0.03)
    made = body(profile(one), one, 7810.0)
    disc = 7810.0 * 0.02 * pi * (0.03**2 - 0.0175**2)
    assert made.mass_hub == pytest.approx(disc, rel=1e-12)
    assert made.inertia_hub == pytest.approx(disc * (0.03**2 + 0.0175**2) / 2, rel=1e-12)
    assert made.mass == pytest.approx(made.mass_fe + made.mass_hub, rel=1e-14)
    # ROSS states 1.736 kg and 3.6025e-3 kg m^2 for the ring up to the reference circle.
    assert made.mass == pytest.approx(1.736, rel=0.02)
    assert made.inertia == pytest.approx(3.6025e-3, rel=0.03)


def test_given_totals_leave_the_difference_to_the_hub(gear: MakeGear) -> None:
    one = gear(mass=1.0, inertia=1e-3)
    made = body(profile(one), one, 7810.0)
    assert (made.mass, made.inertia) == (1.0, 1e-3)
    assert made.mass_hub == pytest.approx(1.0 - made.mass_fe, rel=1e-14)
    assert made.inertia_hub == pytest.approx(1e-3 - made.inertia_fe, rel=1e-14)
    assert made.mass_fe == pytest.approx(7810 * 0.02 * made.area, rel=1e-14)
