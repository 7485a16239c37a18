"""Flamant's field against elasticity itself: Hooke's law by finite differences, equilibrium, the free surface."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.fem.gear.flamant import LineLoad

E, NU = 206e9, 0.3
GAUSS, WEIGHT = np.polynomial.legendre.leggauss(40)


def load_at(angle: float) -> LineLoad:
    """A load into a half-plane whose inward normal has this polar angle."""
    into = np.array([np.cos(angle), np.sin(angle)])
    return LineLoad(np.array([0.02, -0.01]), into, -into)


def inside(load: LineLoad, radius: float, polar: float) -> np.ndarray:
    """A point at that angle from the load's direction."""
    c, s = np.cos(polar), np.sin(polar)
    return load.point + radius * (np.array([[c, -s], [s, c]]) @ load.into)


def hooke(gradient: np.ndarray) -> np.ndarray:
    """Plane-stress stress of a displacement gradient."""
    strain = 0.5 * (gradient + gradient.T)
    return E / (1 - NU**2) * ((1 - NU) * strain + NU * np.trace(strain) * np.eye(2))


@pytest.mark.parametrize("angle", [0.0, 1.1, -2.6])
@pytest.mark.parametrize(("radius", "polar"), [(1e-4, 0.3), (1e-3, -1.2), (0.02, 0.0), (0.3, 1.5)])
def test_displacement_and_traction_obey_hookes_law(angle: float, radius: float, polar: float) -> None:
    load = load_at(angle)
    x = inside(load, radius, polar)
    h = 1e-4 * radius
    gradient = np.column_stack(
        [(load.displacement(x + d, E, NU) - load.displacement(x - d, E, NU)) / (2 * h) for d in h * np.eye(2)]
    )
    stress = hooke(gradient)
    found = np.column_stack([load.traction(x, n) for n in np.eye(2)])
    np.testing.assert_allclose(stress, found, atol=1e-6 / radius)


@pytest.mark.parametrize("angle", [0.0, 1.1, -2.6])
@pytest.mark.parametrize("radius", [1e-5, 1e-2])
def test_an_arc_around_the_load_carries_the_unit_force(angle: float, radius: float) -> None:
    load = load_at(angle)
    points = np.array([inside(load, radius, p) for p in GAUSS * np.pi / 2])
    outward = (points - load.point) / radius
    traction = load.traction(points, outward)
    total = (WEIGHT * np.pi / 2 * radius) @ traction
    np.testing.assert_allclose(total, -load.into, atol=1e-12)
    arm = points - load.point
    moment = (WEIGHT * np.pi / 2 * radius) @ (arm[:, 0] * traction[:, 1] - arm[:, 1] * traction[:, 0])
    assert abs(moment) < 1e-12 * radius


def test_the_surface_is_free_and_sinks_by_boussinesqs_logarithm() -> None:
    load = load_at(0.4)
    for side in (-1, 1):
        for distance in (1e-5, 3e-3):
            x = inside(load, distance, side * np.pi / 2)
            assert np.abs(load.traction(x, -load.into)).max() < 1e-12 / distance
            sunk = load.displacement(x, E, NU) @ load.into
            expected = -(2 * np.log(distance) + 1 + NU) / (np.pi * E)
            assert sunk == pytest.approx(expected, rel=1e-12)


def test_the_branch_cut_moves_the_body_as_a_whole() -> None:
    load = load_at(0.4)
    turned = LineLoad(load.point, load.into, np.array([np.cos(-1.6), np.sin(-1.6)]))
    points = np.array([inside(load, r, p) for r in (1e-4, 1e-2) for p in (-1.4, -0.3, 0.8, 1.5)])
    difference = load.displacement(points, E, NU) - turned.displacement(points, E, NU)
    assert np.abs(difference - difference[0]).max() < 1e-12 * np.abs(load.displacement(points, E, NU)).max()
