"""Values that do not go together are questioned: face width with module, torque with both."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import pytest

import gearbench as gb
from gearbench.rig.casefile.smells import nominal_stresses, smells


@pytest.mark.parametrize(("width", "asked"), [(0.7, True), (1.9, True), (2.1, False), (118.0, False), (200.0, True)])
def test_a_face_width_out_of_proportion_is_questioned(width: float, asked: bool) -> None:
    # Module 2 mm: 1 to 60 modules are 2 to 120 mm.
    settings = [f"rig.{side}.face_width_mm={width}" for side in ("driver", "driven")]
    found = smells(gb.read_case("quick_fe", settings))
    assert len(found) == (2 if asked else 0)
    assert all("modules" in sentence and "are both in mm?" in sentence for sentence in found)


@pytest.mark.parametrize(("torque", "asked"), [(1500.0, False), (2200.0, True)])
def test_a_torque_that_nothing_bears_is_questioned(torque: float, asked: bool) -> None:
    # By hand: 4 F_t / (b m) = 8 T / (d b m) reaches 3 GPa at 1860 N m (d 124, b 20, m 2 mm).
    found = smells(gb.read_case("quick_fe", [f"experiment.torque_mean_nm={torque}"]))
    assert len(found) == asked and all("N m and mm?" in sentence for sentence in found)


def test_the_pressure_is_hertz_at_the_pitch_point() -> None:
    # Two equal cylinders of radius r = d sin(alpha)/2: p = sqrt(w E' / (2 pi R)), E' = E/(1-nu^2), 1/R = 2/r.
    rig = gb.read_case("quick_fe").rig
    alpha, radius = 20 * pi / 180, 0.062 * sin(20 * pi / 180)
    load = 100.0 / 0.062 / cos(alpha) / 0.02
    expected = sqrt(load * 206e9 / (1 - 0.3**2) / (2 * pi * (radius / 2)))
    assert nominal_stresses(rig, 100.0)[1] == pytest.approx(expected, rel=1e-12)
