"""ISO 1328-1:2013: values worked by hand from its formulas, its rounding, and drawn errors inspected against them."""

from __future__ import annotations

from math import cos
from typing import Any

import numpy as np
import pytest

from gearbench.geometry import GeometryError
from gearbench.geometry.tooth.iso1328 import drawn_gear, rounded_tolerance, tolerances
from gearbench.geometry.tooth.micro import profile_excess
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Gear


def gear(**changes: Any) -> Gear:
    data = {"teeth": 40, "module": 3e-3, "face_width": 0.02, "hub_radius": 0.04}
    return Gear(**{**data, **changes})


@pytest.mark.parametrize(
    ("raw", "shown"),
    [(12.4, 12), (12.5, 13), (10.2, 10), (9.8, 10), (9.74, 9.5), (5.2, 5), (5.25, 5.5), (4.94, 4.9), (0.05, 0.1)],
)
def test_rounding(raw: float, shown: float) -> None:
    assert rounded_tolerance(raw) == pytest.approx(shown, abs=1e-12)


@pytest.mark.parametrize(
    ("module", "teeth", "grade", "expected"),
    [
        # d = 120, m = 3, grade 5: f_p .12 + 1.2 + 5 = 6.32; F_p .24 + 6.025 + 2.1 + 12 = 20.365; F_r 18.328;
        # f_Halpha 1.2 + .12 + 4 = 5.32; f_falpha 1.65 + 5 = 6.65; F_alpha 8.516.
        (3e-3, 40, 5, (6.5, 20.0, 18.0, 5.5, 6.5, 8.5)),
        # d = 20, m = 1, grade 8, 2 sqrt(2) times 5.42; 15.1997; 13.6797; 4.42; 5.55; 7.0951.
        (1e-3, 20, 8, (15.0, 43.0, 39.0, 13.0, 16.0, 20.0)),
        # grade 1, a quarter of 6.32; 20.365; 18.328; 5.32; 6.65; 8.516.
        (3e-3, 40, 1, (1.6, 5.0, 4.6, 1.3, 1.7, 2.1)),
        # d = 2000, m = 20, grade 6, sqrt(2) times 2 + 8 + 5; 4 + 24.597 + 14 + 12 = 54.597; 49.137; 14; 16; 21.260.
        (20e-3, 100, 6, (21.0, 77.0, 69.0, 20.0, 23.0, 30.0)),
    ],
)
def test_tolerances(module: float, teeth: int, grade: int, expected: tuple[float, ...]) -> None:
    found = tolerances(module, teeth, grade)
    values = (
        found.single_pitch, found.cumulative_pitch, found.runout, found.profile_slope, found.profile_form,
        found.profile_total,
    )  # fmt: skip
    assert [1e6 * value for value in values] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("module", "teeth", "grade", "name", "published"),
    [
        # Values in um that a public calculator of ISO 1328-1:2013, checked against the standard's own page, gives for
        # m 3, z 40, class 6 (github.com, test_iso1328_flank_tolerances_class_6): formulas 5, 6 and 9.
        (3e-3, 40, 6, "single_pitch", 9.0),
        (3e-3, 40, 6, "cumulative_pitch", 29.0),
        (3e-3, 40, 6, "profile_total", 12.0),
    ],
)
def test_published_values(module: float, teeth: int, grade: int, name: str, published: float) -> None:
    assert 1e6 * getattr(tolerances(module, teeth, grade), name) == pytest.approx(published, abs=1e-9)


def test_pitch_tolerances_grow_linearly_with_the_module() -> None:
    # At the same diameter, grade 9 (four times grade 5): 0.4 and 0.7 um a mm of module.
    small, large = tolerances(2.5e-3, 400, 9), tolerances(25e-3, 40, 9)
    assert 1e6 * (large.single_pitch - small.single_pitch) == pytest.approx(4 * 0.4 * 22.5, abs=1.0)
    assert 1e6 * (large.cumulative_pitch - small.cumulative_pitch) == pytest.approx(4 * 0.7 * 22.5, abs=1.0)


@pytest.mark.parametrize("grade", [1, 5, 8, 11])
@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_drawn_errors_use_the_grade_and_do_not_exceed_it(grade: int, seed: int) -> None:
    drawn = drawn_gear(gear(iso_grade=grade, iso_seed=seed))
    limits = tolerances(3e-3, 40, grade)
    # An inspection about the axis: arcs on the reference circle, the eccentric teeth included.
    angle = 2 * np.pi * np.arange(40) / 40
    arcs = np.array(drawn.pitch_error) + drawn.runout / 2 * np.cos(angle - drawn.runout_phase)
    arcs = arcs / cos(drawn.pressure_angle)
    pitch = [
        np.abs(np.diff([arcs[-1], *arcs])).max() / limits.single_pitch,
        np.ptp(arcs) / limits.cumulative_pitch,
        drawn.runout / limits.runout,
    ]
    assert 0.69 < max(pitch) <= 1.0
    shape = profile(drawn)
    rho = np.linspace(shape.rho_form, shape.rho_end, 400)
    slope, form, total = [], [], []
    for tooth in range(40):
        trace = profile_excess(shape, drawn, tooth, rho)
        line = np.polyval(np.polyfit(rho, trace, 1), rho)
        slope.append(abs(line[-1] - line[0]) / limits.profile_slope)
        form.append(np.ptp(trace - line) / limits.profile_form)
        total.append(np.ptp(trace) / limits.profile_total)
    assert max(slope) <= 1.0 and max(form) <= 1.0 and max(total) <= 1.0
    assert max(*slope, *form, *total) > 0.6


def test_the_seed_decides_and_a_gear_without_grade_stays() -> None:
    assert drawn_gear(gear()) is not None and drawn_gear(gear()) == gear()
    assert drawn_gear(gear(iso_grade=7, iso_seed=3)) == drawn_gear(gear(iso_grade=7, iso_seed=3))
    assert drawn_gear(gear(iso_grade=7, iso_seed=3)) != drawn_gear(gear(iso_grade=7, iso_seed=4))
    drawn = drawn_gear(gear(iso_grade=7))
    assert drawn.iso_grade is None and drawn_gear(drawn) == drawn


def test_outside_the_standard() -> None:
    with pytest.raises(GeometryError, match=r"rig\.driven: ISO 1328-1 .* module_mm = 0\.4 mm: between 0\.5 and 70"):
        tolerances(0.4e-3, 40, 6, "rig.driven")
