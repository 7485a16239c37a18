"""Pair kinematics over the whole space of gears against a second formulation: the least distance of both flanks as
points, and virtual work."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from shared.gears import likely_pair

from gearbench.fem.contact.kinematics import APART, Contact, pair_contact, teeth_of
from gearbench.geometry import GeometryError
from gearbench.geometry.pair.kinematics import Pair, pair
from gearbench.rig import Rig

Array = NDArray[np.float64]
SETTLED: dict[str, Any] = {
    "deadline": None,
    "derandomize": True,
    "database": None,
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
}
OPEN = 40e-6  # gaps beyond are none of contact's business [m]
MIRROR = np.array([1.0, -1.0])
GOLDEN = 0.6180339887498949


@st.composite
def positions(draw: st.DrawFn) -> tuple[Pair, int, float, tuple[float, float, float]]:
    """A pair that runs, the side in contact, a mesh phase, and by how much the driver is turned back and the driven
    centre displaced [m]."""
    rig: Rig = draw(likely_pair())
    try:
        meshing = pair(rig)
    except GeometryError:
        assume(False)
        raise
    small = st.floats(-8e-6, 8e-6)
    moved = draw(st.tuples(st.floats(1e-6, 2e-5), small, small))
    return meshing, draw(st.integers(0, 1)), draw(st.floats(-1.0, 1.0)), moved


def rigid(meshing: Pair, side: int, phase: float, moved: tuple[float, float, float]) -> tuple[float, float]:
    """Rotations [rad] of driver and driven gear: on the back side the driver is first turned through the backlash."""
    back = max(meshing.backlash_normal, 0.0) - moved[0] if side else moved[0]
    return phase * meshing.driver.pitch_angle - back / meshing.driver.base_radius, phase * meshing.driven.pitch_angle


def flank(meshing: Pair, gear: int, tooth: int, side: int, angle: float, centre: Array, s: Array) -> Array:
    """Points of a flank in the world (docs/physics.md, "Axes, signs, zeros"), gears drawn from their profiles."""
    shape = (meshing.driver, meshing.driven)[gear]
    points = shape.points(s) * (MIRROR if side else 1.0)
    if gear == 0:
        turn = meshing.driver_angle + angle - tooth * shape.pitch_angle
    else:
        turn = pi + meshing.driven_angle - angle + (tooth + side) * shape.pitch_angle
    c, s_ = cos(turn), sin(turn)
    return points @ np.array([[c, s_], [-s_, c]]) + centre


def distance(meshing: Pair, side: int, tooth: int, angles: tuple[float, float], centre: Array) -> float:
    """Least distance [m] of two flanks: for many points of one the nearest of the other by golden sections, about the
    best of them again, ever closer."""
    one, two = meshing.driver, meshing.driven
    start, stop = one.s_form, one.s_tip
    best = np.inf
    for turn in range(5):
        s = np.linspace(start, stop, 120 if turn == 0 else 41)
        points = flank(meshing, 0, tooth, side, angles[0], np.zeros(2), s)

        def apart(other: Array, points: Array = points) -> Array:
            return np.hypot(*(flank(meshing, 1, tooth, side, angles[1], centre, other) - points).T)

        coarse = np.linspace(two.s_form, two.s_tip, 80)
        all_apart = np.stack([apart(np.full(len(s), at)) for at in coarse])
        middle = coarse[np.argmin(all_apart, axis=0)]
        low = np.maximum(middle - (coarse[1] - coarse[0]), two.s_form)
        high = np.minimum(middle + (coarse[1] - coarse[0]), two.s_tip)
        for _ in range(24):
            left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
            nearer = apart(left) < apart(right)
            low, high = np.where(nearer, low, left), np.where(nearer, right, high)
        least = apart(0.5 * (low + high))
        i = int(np.argmin(least))
        best = min(best, float(least[i]))
        width = s[1] - s[0]
        start, stop = max(s[i] - width, one.s_form), min(s[i] + width, one.s_tip)
    return best


def near(meshing: Pair, side: int, angles: tuple[float, float], centre: Array) -> list[tuple[int, Contact]]:
    """Open pairs whose contact lies on both flanks."""
    one, two = teeth_of(meshing)
    found = []
    for tooth in range(-4, 5):
        k = pair_contact(one, two, side, tooth, *angles, *centre)
        on = k.s1 >= one.s_form and k.s2 >= two.s_form and k.s1 < one.s_tip and k.s2 < two.s_tip
        if 0.0 < k.gap < OPEN and on:
            found.append((tooth, k))
    return found


@settings(max_examples=8, **SETTLED)
@given(positions())
def test_gap_is_the_least_distance(place: tuple[Pair, int, float, tuple[float, float, float]]) -> None:
    meshing, side, phase, moved = place
    angles = rigid(meshing, side, phase, moved)
    centre = np.array([meshing.centre_distance + moved[1], moved[2]])
    for tooth, k in near(meshing, side, angles, centre):
        least = distance(meshing, side, tooth, angles, centre)
        assert abs(k.gap - least) < 2e-10, (tooth, k, least)


@pytest.mark.validation
@settings(max_examples=40, **SETTLED)
@given(positions())
def test_levers_do_the_gap_s_virtual_work(place: tuple[Pair, int, float, tuple[float, float, float]]) -> None:
    meshing, side, phase, moved = place
    one, two = teeth_of(meshing)
    angles = rigid(meshing, side, phase, moved)
    centre = np.array([meshing.centre_distance + moved[1], moved[2]])
    sign = -1.0 if side else 1.0
    h = 2e-9
    for tooth, k in near(meshing, side, angles, centre):

        def gap(a: float = 0.0, b: float = 0.0, x: float = 0.0, y: float = 0.0, tooth: int = tooth) -> Contact:
            return pair_contact(one, two, side, tooth, angles[0] + a, angles[1] + b, centre[0] + x, centre[1] + y)

        steps = (("a", h), ("b", h), ("x", 1e-10), ("y", 1e-10))
        ends = [gap(**{name: step}) for name, size in steps for step in (-size, size)]
        if any(end.slave != k.slave or end.gap >= APART for end in ends):
            continue  # at a switch between two kinds of contact
        rate = [(ends[i + 1].gap - ends[i].gap) / 2 for i in (0, 2, 4, 6)]
        assert abs(rate[0] / h + sign * k.lever1) < 2e-5 * one.rb + 1e-9
        assert abs(rate[1] / h - sign * k.lever2) < 2e-5 * two.rb + 1e-9
        assert abs(rate[2] / 1e-10 - k.nx) < 1e-4 and abs(rate[3] / 1e-10 - k.ny) < 1e-4
        assert abs(np.hypot(k.nx, k.ny) - 1.0) < 1e-12
