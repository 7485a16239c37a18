"""The tabulated law against the lines it was made from; coupling of tooth pairs through the gear bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact.coupling import coupling
from gearbench.fem.contact.curve import curve_at, lone_approach
from gearbench.fem.contact.kinematics import EDGE1, EDGE2, ON_LINE, pair_contact
from gearbench.fem.contact.law import contact_in, find_pairs, make_law, overlaps
from gearbench.fem.contact.line import line_contact
from gearbench.fem.contact.sharing import share_load
from gearbench.fem.contact.static import solve_torque


@pytest.mark.parametrize("swap", [False, True])
def test_curves_interpolate_the_contact_lines(unequal: Any, swap: bool) -> None:
    """At random loads and places; found 3e-4 around the tip edge, 1e-4 elsewhere."""
    law = unequal.law
    slave, master = (law.driven, law.driver) if swap else (law.driver, law.driven)
    ks, km = (law.k2, law.k1) if swap else (law.k1, law.k2)
    curve = law.curves.driven if swap else law.curves.driver
    rng = np.random.default_rng(11)
    worst = {"inside": 0.0, "corner": 0.0}
    for _ in range(12):
        xi = rng.uniform(curve.xi[0], curve.xi[-1])
        force = np.exp(rng.uniform(np.log(5.0), np.log(2e4)))
        u = line_contact(slave, master, ks, km, law.half_plane, law.centre, xi, force).approach
        where = "corner" if xi > slave.rho_end - 2e-4 else "inside"
        worst[where] = max(worst[where], abs(curve_at(curve, xi, force)[0] / u - 1))
    assert worst["inside"] < 3e-4
    assert worst["corner"] < 1e-3


@pytest.mark.parametrize("phase", np.linspace(-0.86, 0.84, 18))
def test_the_gear_nearer_its_tip_is_the_slave(unequal: Any, phase: float) -> None:
    """The law's lone pair against the contact line itself, from one tip edge to the other."""
    law = unequal.law
    touch = 1e-5 / law.driver.rb
    k = pair_contact(
        law.driver,
        law.driven,
        0,
        0,
        phase * law.driver.pitch + touch,
        phase * law.driven.pitch,
        law.centre,
        0.0,
    )
    driver = k.slave == EDGE1 or (k.slave == ON_LINE and law.driver.rho_end - k.xi1 < law.driven.rho_end - k.xi2)
    gears = ((law.driver, law.k1), (law.driven, law.k2))
    (slave, ks), (master, km) = gears if driver else gears[::-1]
    line = line_contact(slave, master, ks, km, law.half_plane, law.centre, k.xi1 if driver else k.xi2, 500.0)
    assert lone_approach(law.curves, k, 500.0)[0] == pytest.approx(line.approach, rel=1e-3)


@pytest.mark.parametrize("force", [1e-4, 1.0, 300.0, 1e4])
def test_curve_slope_is_its_derivative(unequal: Any, force: float) -> None:
    curve = unequal.law.curves.driver
    for xi in np.linspace(curve.xi[0], curve.xi[-1], 7):
        u, slope = curve_at(curve, xi, force)
        h = 1e-5 * force
        found = (curve_at(curve, xi, force + h)[0] - curve_at(curve, xi, force - h)[0]) / (2 * h)
        assert slope == pytest.approx(found, rel=1e-6)
        assert u > 0 and slope > 0


def test_coupling_is_reciprocal_on_both_flank_sides(twins: Any) -> None:
    """Four pairs of which two touch with their back flanks: the flexibility matrix is symmetric (Maxwell)."""
    law = twins.law
    pitch = law.driver.pitch
    pairs = find_pairs(law, 0.3 * pitch, 0.3 * pitch, law.centre, 0.0, 2e-4)
    assert len(pairs) >= 3 and set(pairs["side"]) == {0, 1}
    c = coupling(law, pairs)
    np.testing.assert_array_equal(np.diag(c), 0.0)
    assert np.abs(c - c.T).max() < 1e-3 * np.abs(c).max()


def test_the_same_force_on_both_flanks_of_a_tooth_squeezes_it_only(twins: Any) -> None:
    """A push from behind moves the working flank outward, the one from the front inward."""
    law = twins.law
    pairs = find_pairs(law, 0.0, 0.0, law.centre, 0.0, 2e-4)
    c = coupling(law, pairs)
    (front,) = np.flatnonzero((pairs["side"] == 0) & (pairs["tooth"] == 0) & (pairs["slave"] == ON_LINE))
    for p, pair in enumerate(pairs):
        if pair["side"] == 1 and pair["tooth"] in (0, -1):
            # The driver's tooth 0 (or the driven one) is bent forward: overlap of the working flanks grows.
            assert c[front, p] < 0


def test_shared_load_closes_every_gap(unequal: Any) -> None:
    """In double contact: the overlap of each pair is its own approach and the other's coupling."""
    law = unequal.law
    dte = 2e-5
    theta1 = 0.5 * law.driver.pitch + dte / law.driver.rb
    pairs = find_pairs(law, theta1, 0.5 * law.driven.pitch, law.centre, 0.0, 2e-5)
    c = coupling(law, pairs)
    load = share_load(law.curves, pairs, overlaps(pairs), c, 1.0, np.zeros(len(pairs)))
    assert load.converged and load.active.sum() == 2
    assert np.all(load.force[~load.active] == 0.0)
    for p, (gap, force, active) in enumerate(zip(pairs["gap"], load.force, load.active, strict=True)):
        approach = lone_approach(law.curves, contact_in(pairs, p), force)[0] if active else 0.0
        left = -gap - c[p] @ load.force - approach
        assert abs(left) < 1e-9 * dte if active else left <= 1e-12
    assert np.all(np.linalg.eigvalsh(0.5 * (load.flexibility + load.flexibility.T)) > 0)


def test_given_curves_are_taken_over(twins: Any) -> None:
    again = make_law(twins.pair, *twins.gears, twins.rig.material, curves=twins.law.curves[:2])
    assert again.curves.driver is twins.law.curves.driver
    assert again.reach1 == twins.law.reach1


@pytest.mark.parametrize("margin", [2e-5, 2e-4])
def test_no_pair_is_overlooked(unequal: Any, margin: float) -> None:
    """Against a search of all teeth within half a turn of the pitch point, at positions all over the cycle."""
    law = unequal.law
    rng = np.random.default_rng(2)
    for _ in range(200):
        phase = rng.uniform(-40.0, 40.0)
        theta1 = phase * law.driver.pitch + rng.uniform(-1e-4, 5e-5) / law.driver.rb
        theta2 = phase * law.driven.pitch
        dx, dy = law.centre + rng.uniform(-2e-5, 5e-5), rng.uniform(-5e-5, 5e-5)
        expected = set()
        for side in (0, 1):
            for j in range(round(phase) - 4, round(phase) + 5):
                k = pair_contact(law.driver, law.driven, side, j, theta1, theta2, dx, dy)
                reach = {ON_LINE: np.inf, EDGE1: law.reach1, EDGE2: law.reach2}[k.slave]
                on = (k.xi1 if k.slave == EDGE1 else k.xi2) <= reach
                if k.gap < margin and on and k.s1 >= law.driver.s_form and k.s2 >= law.driven.s_form:
                    expected.add((side, j))
        pairs = find_pairs(law, theta1, theta2, dx, dy, margin)
        assert set(zip(pairs["side"], pairs["tooth"], strict=True)) == expected


@pytest.mark.parametrize("more", [1e-9, -4e-10])
@pytest.mark.parametrize("phase", [0.1, 0.5, 0.9])
def test_what_all_pairs_share_is_added_to_the_transmission_error(unequal: Any, more: float, phase: float) -> None:
    """At the same torque every pair carries what it did, and the driver turns on by c F."""
    law, torque = unequal.law, 90.0
    plain, found = (solve_torque(one, phase, torque) for one in (law, law._replace(shared=more)))
    assert found - plain == pytest.approx(more * torque / law.driver.rb, rel=2e-3)
