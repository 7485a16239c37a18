"""The contact line: Hertz where the bodies do not bend, and complementarity where they do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact.kernel import POINTS, Kernel
from gearbench.fem.contact.kinematics import Tooth, teeth_of
from gearbench.fem.contact.line import Line, line_contact, log_integral

WIDTH = 0.02
COMPLIANCE = 4 / (np.pi * 206e9 * WIDTH)  # 2/(pi E* b) with 1/E* = 2/E


def rigid_body(tooth: Tooth) -> Kernel:
    """A kernel of nothing: what is left is the half-plane."""
    table = np.zeros((1, POINTS, POINTS))
    modes = np.zeros((0, 20, POINTS))
    return Kernel(table, table, tooth.s_end, tooth.s_tip, 6.0, 0, WIDTH, modes, modes, np.zeros((0, 0, 2, 2, 0, 0)), -1)


def solve(twins: Any, xi: float, force: float) -> Line:
    one, two = teeth_of(twins.pair)
    a = twins.pair.centre_distance
    return line_contact(one, two, rigid_body(one), rigid_body(two), COMPLIANCE, a, xi, force)


@pytest.mark.parametrize("force", [50.0, 2000.0])
@pytest.mark.parametrize("place", [-0.6, 0.0, 0.5])
def test_hertz(twins: Any, place: float, force: float) -> None:
    """Half-width, peak pressure and approach of two cylinders (Johnson 1985, eqs. 4.43-4.45)."""
    total = twins.pair.line_of_action
    xi = 0.5 * total + place * 3e-3
    radius = xi * (total - xi) / total
    half = np.sqrt(2 * COMPLIANCE * force * radius)
    u, slope, edges, q = solve(twins, xi, force)
    middle, pressure = 0.5 * (edges[1:] + edges[:-1]), q / np.diff(edges) / WIDTH
    assert q.sum() == pytest.approx(force, rel=1e-10)
    centre = (q @ middle) / force
    # The second moment of a semi-ellipse is a quarter of its half-width squared.
    spread = (q @ (middle - centre) ** 2 + q @ (np.diff(edges) ** 2) / 12) / force
    assert 2 * np.sqrt(spread) == pytest.approx(half, rel=5e-3)
    assert pressure.max() == pytest.approx(2 * force / (np.pi * half * WIDTH), rel=5e-3)
    assert u == pytest.approx(COMPLIANCE * force * (np.log(2 / half) + 0.5), rel=2e-4)
    # du/dF, the half-width growing with the square root of the force; here the cells are those of one load.
    assert slope == pytest.approx(COMPLIANCE * np.log(2 / half), rel=5e-3)


def test_pressure_is_a_complementarity_solution(twins: Any) -> None:
    """No cell pulls, and unloaded cells lie outside one loaded stretch."""
    for xi in (twins.law.driver.rho_end - 1e-4, twins.law.driver.rho_end + 1e-4):
        q = line_contact(
            twins.law.driver,
            twins.law.driven,
            twins.law.k1,
            twins.law.k2,
            twins.law.half_plane,
            twins.law.centre,
            xi,
            1000.0,
        ).force
        assert q.min() >= 0.0
        loaded = np.nonzero(q > 0)[0]
        assert np.all(np.diff(loaded) == 1)
        assert q.sum() == pytest.approx(1000.0, rel=1e-10)


@pytest.mark.parametrize("corner", [False, True])
def test_slope_is_the_derivative_of_the_approach(twins: Any, corner: bool) -> None:
    law = twins.law
    xi = law.driver.rho_end + (5e-5 if corner else -2e-3)

    def under(force: float) -> Line:
        return line_contact(law.driver, law.driven, law.k1, law.k2, law.half_plane, law.centre, xi, force)

    slope = under(500.0).slope
    found = (under(505.0).approach - under(495.0).approach) / 10.0
    # At a corner the cells are fitted anew to every load: the slope is that of the last fit.
    assert slope == pytest.approx(found, rel=2e-2 if corner else 2e-3)


def test_log_integral() -> None:
    x = np.linspace(-0.3, 0.7, 2_000_001)
    x = 0.5 * (x[1:] + x[:-1])
    assert log_integral(-0.3, 0.7) == pytest.approx(np.mean(np.log(np.abs(x))), abs=1e-6)
    assert log_integral(0.0, 1.0) == pytest.approx(-1.0, abs=1e-15)
