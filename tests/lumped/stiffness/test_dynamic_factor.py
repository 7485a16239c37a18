"""K_v of ISO 6336-1 Method B: its parts against what they stand for, and its steps in speed."""

from __future__ import annotations

from math import pi, sqrt

import pytest

from gearbench.lumped.stiffness.dynamic_factor import deviations, dynamic_factor, factors, resonance_speed


def test_resonance_is_where_teeth_meet_at_the_natural_frequency_of_two_masses_on_a_spring() -> None:
    stiffness, masses, teeth = 20.0, (0.05, 0.12), 24  # N/(mm um), kg/mm
    hertz = sqrt(stiffness * 1e9 * (1 / (masses[0] * 1e3) + 1 / (masses[1] * 1e3))) / (2 * pi)
    assert resonance_speed(teeth, stiffness, masses) * teeth / 60 == pytest.approx(hertz, rel=1e-12)


def test_deviations_are_measured_in_deflections_of_the_tooth() -> None:
    b = deviations(300.0, 15.0, base_pitch=5.0, profile=8.0, tip_relief=20.0)
    assert b == pytest.approx((0.25, 0.4, 0.0))
    assert deviations(300.0, 15.0).relief == 1.0


@pytest.mark.parametrize("ratio", [1.2, 1.7, 2.4, 3.0])
def test_k_v_grows_from_one_peaks_and_comes_down_without_steps_above_resonance(ratio: float) -> None:
    b = deviations(300.0, 15.0, base_pitch=5.0, profile=8.0)
    assert dynamic_factor(0.0, 300.0, ratio, b) == 1.0
    slow, middle, peak = (dynamic_factor(n, 300.0, ratio, b) for n in (0.2, 0.4, 1.0))
    assert middle - 1 == pytest.approx(2 * (slow - 1)) and 1 < middle < peak
    for border in (1.15, 1.5):
        below, above = (dynamic_factor(border + step, 300.0, ratio, b) for step in (-1e-9, 1e-9))
        assert below == pytest.approx(above, rel=1e-6)
    assert dynamic_factor(1.3, 300.0, ratio, b) < peak


def test_resonance_begins_earlier_under_light_load() -> None:
    heavy, light = deviations(300.0, 15.0), deviations(25.0, 15.0)
    assert dynamic_factor(0.80, 300.0, 1.6, heavy) < dynamic_factor(0.90, 300.0, 1.6, heavy) == 1.9
    assert dynamic_factor(0.66, 25.0, 1.6, light) < dynamic_factor(0.68, 25.0, 1.6, light) == 1.9


def test_relief_that_fits_the_load_leaves_no_dynamics_of_ideal_teeth() -> None:
    b = deviations(300.0, 15.0, tip_relief=20.0)
    assert dynamic_factor(0.5, 300.0, 1.6, b) == dynamic_factor(1.0, 300.0, 1.6, b) == 1.0


def test_the_factors_of_the_table_meet_where_its_columns_do() -> None:
    # At a contact ratio of 2 the table's columns agree as far as its two digits go, and v7 is continuous.
    for one, two in zip(factors(2.0), factors(2.0 + 1e-9), strict=True):
        assert one == pytest.approx(two, abs=0.07)
    for border in (1.5, 2.5):
        assert factors(border - 1e-9).v7 == pytest.approx(factors(border + 1e-9).v7, abs=1e-6)
