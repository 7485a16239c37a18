"""Exact gaps, levers and contact points against dense profiles, finite differences and rigid-body statics."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact.kinematics import EDGE1, EDGE2, ON_LINE, Contact, pair_contact, teeth_of
from gearbench.geometry.pair.kinematics import Pair, pair

MIRROR = np.array([1.0, -1.0])


@pytest.fixture(scope="module")
def meshing(rig: Any, gear: Any) -> Pair:
    """Unequal gears with profile shift and a large tip edge, 0.1 mm apart from their zero-backlash distance."""
    driver = gear(20, profile_shift=0.2, tip_edge_radius=8e-5)
    wheel = gear(30, profile_shift=-0.1, tip_edge_radius=1.2e-4)
    return pair(rig(driver, wheel, centre_distance=0.0754))


def at(meshing: Pair, side: int, tooth: int, theta1: float, theta2: float, dx: float = 0.0, dy: float = 0.0) -> Contact:
    one, two = teeth_of(meshing)
    return pair_contact(one, two, side, tooth, theta1, theta2, meshing.centre_distance + dx, dy)


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


class Flanks:
    """Both flanks in the world, as functions of arc length, at a rigid position (docs/physics.md,
    "Axes, signs, zeros")."""

    def __init__(self, meshing: Pair, side: int, tooth: int, position: tuple[float, ...]) -> None:
        theta1, theta2, dx, dy = position
        one, two = meshing.driver, meshing.driven
        self.angle1 = meshing.driver_angle + theta1 - tooth * one.pitch_angle
        self.angle2 = np.pi + meshing.driven_angle - theta2 + (tooth + side) * two.pitch_angle
        self.centre = np.array([meshing.centre_distance + dx, dy])
        self.one, self.two = one, two
        self.mirror = MIRROR if side else np.ones(2)

    def first(self, s: np.ndarray) -> np.ndarray:
        return turned(self.one.points(s) * self.mirror, self.angle1)

    def second(self, s: np.ndarray) -> np.ndarray:
        return turned(self.two.points(s) * self.mirror, self.angle2) + self.centre

    def distance(self) -> tuple[float, float, float]:
        """Least distance of the two flanks and where: nested grids, each a fifth of the last."""
        low = np.array([self.one.s_form, self.two.s_form])
        high = np.array([self.one.s_tip, self.two.s_tip])
        start, stop = low.copy(), high.copy()
        for turn in range(13):
            count = 400 if turn == 0 else 60
            s1, s2 = np.linspace(start[0], stop[0], count), np.linspace(start[1], stop[1], count)
            d = np.linalg.norm(self.first(s1)[:, None] - self.second(s2)[None], axis=-1)
            i, j = np.unravel_index(np.argmin(d), d.shape)
            best = np.array([s1[i], s2[j]])
            width = (stop - start) / 5
            start, stop = np.maximum(best - width / 2, low), np.minimum(best + width / 2, high)
        return float(d.min()), float(best[0]), float(best[1])


# Mesh phase of the tooth pair; both tip edges carry at the ends.
PHASES = [-0.93, -0.86, -0.8, -0.4, 0.0, 0.35, 0.7, 0.78, 0.85]


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.0), (4e-5, -3e-5)])
def test_gap_is_the_least_distance_of_the_profiles(
    meshing: Pair, side: int, phase: float, dx: float, dy: float
) -> None:
    one, two = teeth_of(meshing)
    # Working flanks opened by 15 um; back flanks stand apart by the backlash less as much.
    theta1, theta2 = phase * one.pitch - 1.5e-5 / one.rb, phase * two.pitch
    found = at(meshing, side, 0, theta1, theta2, dx, dy)
    least, s1, s2 = Flanks(meshing, side, 0, (theta1, theta2, dx, dy)).distance()
    assert found.gap > 0
    assert found.gap == pytest.approx(least, abs=1e-10)
    assert found.s1 == pytest.approx(s1, abs=2e-7)
    assert found.s2 == pytest.approx(s2, abs=2e-7)


def test_the_phases_reach_both_tip_edges(meshing: Pair) -> None:
    one, two = teeth_of(meshing)
    slaves = {at(meshing, 0, 0, p * one.pitch - 1e-5 / one.rb, p * two.pitch).slave for p in PHASES}
    assert slaves == {ON_LINE, EDGE1, EDGE2}


@pytest.mark.parametrize("phase", [-0.3, 0.0, 0.41])
def test_front_and_back_gaps_share_the_backlash(meshing: Pair, phase: float) -> None:
    one, two = teeth_of(meshing)
    front = at(meshing, 0, 0, phase * one.pitch, phase * two.pitch)
    assert front.gap == pytest.approx(0.0, abs=1e-15)
    backs = [at(meshing, 1, j, phase * one.pitch, phase * two.pitch) for j in range(-3, 4)]
    on_line = [k.gap for k in backs if k.slave == ON_LINE]
    assert on_line
    np.testing.assert_allclose(on_line, meshing.backlash_normal, rtol=1e-10)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("opening", [2e-5, -2e-5])
def test_levers_and_normals_are_the_gaps_derivatives(meshing: Pair, side: int, phase: float, opening: float) -> None:
    one, two = teeth_of(meshing)
    sign = 1 - 2 * side
    q = np.array([phase * one.pitch - opening / one.rb, phase * two.pitch, 1e-5, 2e-5])
    found = at(meshing, side, 0, *q)
    step = np.array([1e-6, 1e-6, 1e-7, 1e-7])
    slopes = [
        (at(meshing, side, 0, *(q + d)).gap - at(meshing, side, 0, *(q - d)).gap) / (2 * d.sum()) for d in np.diag(step)
    ]
    assert slopes[0] == pytest.approx(-sign * found.lever1, rel=1e-5)
    assert slopes[1] == pytest.approx(sign * found.lever2, rel=1e-5)
    assert slopes[2:] == pytest.approx([found.nx, found.ny], abs=1e-5)
    assert np.hypot(found.nx, found.ny) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("phase", PHASES)
def test_action_is_reaction(meshing: Pair, side: int, phase: float) -> None:
    """F n on the driven gear and -F n on the driver have no moment together about the driver's centre."""
    one, two = teeth_of(meshing)
    dx, dy = 3e-5, -2e-5
    k = at(meshing, side, 0, phase * one.pitch, phase * two.pitch, dx, dy)
    # lever1 = X x n and lever2 = -(X - O2) x n on the working side, both reversed on the back side.
    arm = (meshing.centre_distance + dx) * k.ny - dy * k.nx
    assert (1 - 2 * side) * (k.lever1 + k.lever2) == pytest.approx(arm, rel=1e-12)


@pytest.mark.parametrize("end", [-1, 1])
def test_contact_goes_over_to_the_tip_edge_without_a_jump(meshing: Pair, end: int) -> None:
    one, two = teeth_of(meshing)
    switch = None
    for low, high in pairwise(np.linspace(0, end * 1.0, 400)):
        before, after = (at(meshing, 0, 0, p * one.pitch + 1e-5 / one.rb, p * two.pitch) for p in (low, high))
        if before.slave == ON_LINE and after.slave != ON_LINE:
            switch = low, high
            break
    assert switch is not None
    low, high = switch
    for _ in range(60):
        middle = 0.5 * (low + high)
        k = at(meshing, 0, 0, middle * one.pitch + 1e-5 / one.rb, middle * two.pitch)
        low, high = (middle, high) if k.slave == ON_LINE else (low, middle)
    inner, outer = (at(meshing, 0, 0, p * one.pitch + 1e-5 / one.rb, p * two.pitch) for p in (low, high))
    assert (inner.slave, outer.slave) == (ON_LINE, EDGE2 if end < 0 else EDGE1)
    for name in ("gap", "s1", "s2", "xi1", "xi2"):
        # Overlap displaces the foot on the line of action by half of it: 5 um of roll, at most.
        assert getattr(inner, name) == pytest.approx(getattr(outer, name), abs=1e-11 if name == "gap" else 6e-6)
    for name in ("lever1", "lever2", "nx", "ny"):
        assert getattr(inner, name) == pytest.approx(getattr(outer, name), rel=1e-6)


def test_teeth_follow_one_another_by_one_pitch(meshing: Pair) -> None:
    one, two = teeth_of(meshing)
    for side in (0, 1):
        first = at(meshing, side, 0, 0.2 * one.pitch, 0.2 * two.pitch)
        second = at(meshing, side, 1, 1.2 * one.pitch, 1.2 * two.pitch)
        assert first == pytest.approx(second, abs=1e-12)
