"""Contact on the outward corner that undercut leaves: gaps and levers against dense outlines and finite differences,
and a static cycle that is the same from either gear."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact.kinematics import CORNER1, CORNER2, EDGE1, EDGE2, Contact, pair_contact, teeth_of
from gearbench.fem.contact.law import elastic_pair, make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.body import condense
from gearbench.geometry.pair.kinematics import Pair, pair

# Phases after the mate's tip edge has passed the end of its involute: the corner faces the arc.
ON_ARC = np.array([10.2e-3, 11.2e-3, 12.2e-3])


@pytest.fixture(scope="module", params=[(10, 30), (30, 10)])
def meshing(request: pytest.FixtureRequest, rig: Any, gear: Any) -> Pair:
    first, second = (gear(z, hub_radius=5e-3) for z in request.param)
    return pair(rig(first, second))


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    return points @ np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])


def at(meshing: Pair, phase: float, dte: float = 0.0, dy: float = 0.0) -> Contact:
    """Contact of teeth 0, the driver turned by phase and dte."""
    one, two = teeth_of(meshing)
    theta1 = phase * one.pitch + dte / one.rb
    return pair_contact(one, two, 0, 0, theta1, phase * two.pitch, meshing.centre_distance, dy)


def corner_phases(meshing: Pair) -> np.ndarray:
    """Phases at which the corner may touch: from the tip edge of the mate to where contact on the involutes begins."""
    one, two = meshing.driver, meshing.driven
    far = (meshing.line_of_action - max(one.rho_end, two.rho_end)) / meshing.base_pitch
    pinion = one if one.undercut else two
    ends = (
        np.array([far, pinion.rho_form / meshing.base_pitch]) * meshing.base_pitch
        - (meshing.rho_pitch[0 if one.undercut else 1])
    ) / meshing.base_pitch
    return (1 if one.undercut else -1) * np.concatenate(
        (ends[0] + ON_ARC, np.linspace(ends[0] - 6e-3, ends[1] - 0.05, 11))
    )


def distance(meshing: Pair, phase: float) -> float:
    """Least distance of the two working flanks, the pinion's fillet left out: nested grids."""
    shapes = meshing.driver, meshing.driven
    angles = (
        meshing.driver_angle + phase * meshing.driver.pitch_angle,
        pi + meshing.driven_angle - phase * meshing.driven.pitch_angle,
    )
    shift = np.array([meshing.centre_distance, 0.0])
    low = np.array([shape.s_form for shape in shapes])
    high = np.array([shape.s_tip for shape in shapes])
    start, stop = low.copy(), high.copy()
    for turn in range(14):
        count = 500 if turn == 0 else 60
        s1, s2 = (np.linspace(start[i], stop[i], count) for i in (0, 1))
        a, b = turned(shapes[0].points(s1), angles[0]), turned(shapes[1].points(s2), angles[1]) + shift
        d = np.linalg.norm(a[:, None] - b[None], axis=-1)
        i, j = np.unravel_index(np.argmin(d), d.shape)
        best, width = np.array([s1[i], s2[j]]), (stop - start) / 5
        start, stop = np.maximum(best - width / 2, low), np.minimum(best + width / 2, high)
    return float(d.min())


def test_gap_is_the_least_distance_of_the_outlines(meshing: Pair) -> None:
    kinds = set()
    for phase in corner_phases(meshing):
        found = at(meshing, float(phase))
        kinds.add(found.slave)
        assert 0.0 < found.gap == pytest.approx(distance(meshing, float(phase)), abs=2e-9)
    assert kinds == ({EDGE2, CORNER1} if meshing.driver.undercut else {EDGE1, CORNER2})


def test_levers_are_the_gap_s_derivatives(meshing: Pair) -> None:
    one, two = teeth_of(meshing)
    h, arcs = 1e-7, 0
    for phase in corner_phases(meshing):
        place = (0, 0, phase * one.pitch, phase * two.pitch)

        def gap(a: float = 0.0, b: float = 0.0, y: float = 0.0, place: Any = place) -> float:
            angles = place[2] + a, place[3] + b
            return pair_contact(one, two, *place[:2], *angles, meshing.centre_distance, y).gap

        found = pair_contact(one, two, *place, meshing.centre_distance, 0.0)
        arcs += found.slave in (CORNER1, CORNER2) and (found.s2 > two.s_end or found.s1 > one.s_end)
        assert -(gap(a=h) - gap(a=-h)) / (2 * h) == pytest.approx(found.lever1, rel=1e-5)
        assert (gap(b=h) - gap(b=-h)) / (2 * h) == pytest.approx(found.lever2, rel=1e-5)
        # Moving the driven centre along y opens the pair by the normal's y.
        assert (gap(y=1e-8) - gap(y=-1e-8)) / 2e-8 == pytest.approx(found.ny, rel=1e-5)
    assert arcs >= len(ON_ARC)


def test_a_corner_out_of_reach_is_left_alone(rig: Any, gear: Any) -> None:
    # z 16: undercut a little, but the wheel's tip ends where the flank still is.
    found = pair(rig(gear(16), gear(17, addendum=0.9)))
    assert found.driver.undercut and found.line_of_action - found.driven.rho_end > found.driver.rho_form
    assert all(tooth.corner == -1.0 for tooth in teeth_of(found))


@pytest.mark.validation
def test_static_cycle_of_an_undercut_pair(rig: Any, gear: Any) -> None:
    """Contact comes and goes over the corner without a jump, and the cycle reads the same from the wheel's side."""
    pinion, wheel = gear(10, hub_radius=7e-3, thinning=0.0), gear(30, hub_radius=25e-3, thinning=0.0)
    bench, cycles, smooth = rig(pinion, wheel), [], []
    condensed = [condense(one, bench.material, modes=2) for one in (pinion, wheel)]
    begin = corner_phases(pair(bench))[-1] + 0.05 + 1.0  # where the involutes begin to touch
    for order in (1, -1):
        meshing = elastic_pair(rig(*(pinion, wheel)[::order]))
        law = make_law(meshing, *condensed[::order], bench.material)
        torque = [400 * meshing.driver.base_radius]
        cycles.append(static_cycle(law, order * np.linspace(0.0, 1.0, 161), torque=torque))
        smooth.append(static_cycle(law, order * np.linspace(begin - 0.15, begin + 0.02, 281), torque=torque))
    one, other = (cycle.transmission_error[0] for cycle in cycles)
    assert other == pytest.approx(one, rel=1e-2)
    # Loaded, two pairs carry longer than the involutes alone would let them.
    double = (cycles[0].load_share[0] > 0).sum(axis=1) == 2
    assert double.mean() > pair(bench).contact_ratio - 1 + 0.03
    # One pair is softer than two, which have more than a fifth and less than half of the load each.
    assert 1.3 < one.max() / one.min() < 2.2
    for cycle in smooth:
        te, share = cycle.transmission_error[0], cycle.load_share[0].min(axis=1)
        assert share[0] == 0 and share[-1] > 0.2
        assert np.abs(np.diff(te)).max() < 0.02 * te.max() and np.abs(np.diff(share)).max() < 0.02


@pytest.mark.validation
def test_equal_undercut_gears_change_roles(rig: Any, gear: Any) -> None:
    """Both flanks end on corners, and before a tip edge passes its mate's corner it lies on the flank beyond. Seen in a
    mirror driver and driven gear of an equal pair change roles: T1 at a phase is T2 at the mirrored one."""
    both = gear(16, profile_shift=-0.2, hub_radius=10e-3)
    bench = rig(both, both)
    meshing = elastic_pair(bench)
    condensed = condense(both, bench.material, modes=2)
    law = make_law(meshing, condensed, condensed, bench.material)
    assert law.driver.corner >= 0 and law.driven.corner >= 0
    for dte in (8e-6, 20e-6):
        phase = np.linspace(-0.5, 0.5, 41)
        one = static_cycle(law, phase, dte=[dte])
        other = static_cycle(law, -phase - dte / meshing.base_pitch, dte=[dte])
        assert one.torque_driver[0] == pytest.approx(other.torque_driven[0], rel=1e-9)
        assert one.torque_driven[0] == pytest.approx(other.torque_driver[0], rel=1e-9)
    # Tip edges pushed far off the line of action take several percent of one of the torques.
    ratio = one.torque_driven[0] / one.torque_driver[0]
    assert ratio.min() < 0.98 and ratio.max() > 1.02
