"""The tip edge that meets an undercut tooth: followed as far as any other edge, by contact lines of its own."""

from __future__ import annotations

from math import acos
from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact.curve import edge_reach, lone_approach
from gearbench.fem.contact.kinematics import EDGE1, Contact, edge_contact, teeth_of
from gearbench.fem.contact.law import EDGE_SEPARATION, elastic_pair, make_law
from gearbench.fem.contact.line import gap_to_master, line_contact, touching_point
from gearbench.fem.gear.body import condense


@pytest.mark.parametrize("teeth", [(30, 10), (10, 30)])
def test_it_is_followed_until_it_has_left_the_line_of_action(rig: Any, gear: Any, teeth: tuple[int, int]) -> None:
    """By the gap of the edge where ideal involutes would just touch: 0.05 modules, or the edge has turned over."""
    meshing = elastic_pair(rig(*(gear(z, hub_radius=5e-3) for z in teeth)))
    one, two = teeth_of(meshing)
    slave, master = (one, two) if two.corner >= 0.0 else (two, one)
    assert master.corner >= 0.0 > slave.corner
    a, separation = meshing.centre_distance, EDGE_SEPARATION * meshing.driver.module
    reach = edge_reach(slave, master, a, separation)
    alpha = acos((slave.rb + master.rb) / a)
    rolled = meshing.line_of_action - reach
    turns = reach / slave.rb - alpha - slave.psi, rolled / master.rb - alpha - master.psi
    edge = edge_contact(slave, master, *turns, a, 0.0)
    turned = slave.edge_radius * edge.moved >= slave.s_tip - slave.s_end - 1e-6
    assert edge.gap == pytest.approx(separation, rel=0.01) or turned
    assert edge.gap > 0.1 * separation and edge.foot > master.corner


def test_it_touches_where_it_is_nearest_from_its_beginning_on(rig: Any, gear: Any) -> None:
    """Also at the very end of the involute: where the line of action has ended before, the edge touches beside it."""
    meshing = elastic_pair(rig(gear(30, hub_radius=5e-3), gear(10, hub_radius=5e-3)))
    slave, master = teeth_of(meshing)
    a = meshing.centre_distance
    assert slave.rho_end > meshing.line_of_action
    for beyond in (0.0, 1e-6, 2e-5):
        touch = touching_point(slave, master, slave.rho_end + beyond, a)
        near = np.linspace(slave.s_end - 20e-6, slave.s_tip, 400)
        gaps = [gap_to_master(slave, master, touch.angle, a, s)[0] for s in near]
        assert min(gaps) == pytest.approx(touch.reference, abs=1e-9)


@pytest.mark.validation
def test_it_yields_as_its_contact_line(rig: Any, gear: Any) -> None:
    """Within 0.5 %, at places and loads between those of the table; the corner's curve was 30 % too stiff."""
    case = rig(gear(30, hub_radius=15e-3), gear(10, hub_radius=5e-3))
    gears = [condense(one, case.material, 0.8e-3, 2) for one in (case.driver, case.driven)]
    law = make_law(elastic_pair(case), gears[0], gears[1], case.material)
    assert law.driven.corner >= 0.0
    for part in (0.13, 0.37, 0.71):
        xi = law.driver.rho_end + part * (law.reach1 - law.driver.rho_end)
        for force in (150.0, 4000.0):
            line = line_contact(law.driver, law.driven, law.k1, law.k2, law.half_plane, law.centre, xi, force)
            at = Contact(0.0, EDGE1, xi, 1e-3, law.driver.s_end, law.driven.s_form, 0.0, 0.0, 0.0, 1.0)
            assert lone_approach(law.curves, at, force)[0] == pytest.approx(line.approach, rel=5e-3)
