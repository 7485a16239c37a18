"""Pressed strips of a half-plane: against Flamant's line load, integrated, and below a Hertzian pressure."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.fem.gear.elasticity import PlaneModuli
from gearbench.fem.gear.flamant import LineLoad
from gearbench.fem.stress.pressure import Strips
from gearbench.fem.stress.recovery import principal

MODULI = PlaneModuli(2.06e11, 0.3)
INTO = np.array([np.cos(0.7), np.sin(0.7)])
ALONG = np.array([INTO[1], -INTO[0]])
BRANCH = -np.array([np.cos(1.1), np.sin(1.1)])
MIDDLE = np.array([0.01, 0.02])


def strip(half: float = 1e-3, mean: float = 1e8, slope: float = 3e10) -> Strips:
    return Strips(MIDDLE[None], INTO[None], BRANCH[None], *(np.array([v]) for v in (half, mean, slope)))


def points() -> np.ndarray:
    """Points inside, and two outside beyond the strip's ends, where a fillet or a neighbour may be."""
    rng = np.random.default_rng(0)
    inside = rng.uniform(-5e-3, 5e-3, 20)[:, None] * ALONG + rng.uniform(1e-4, 5e-3, 20)[:, None] * INTO
    return MIDDLE + np.concatenate([inside, np.array([[-3e-3], [3e-3]]) * ALONG - 1e-4 * INTO])


def test_stress_and_displacement_are_the_integral_of_line_loads() -> None:
    one, x = strip(), points()
    stress, moved = np.zeros((len(x), 3)), np.zeros_like(x)
    for at, weight in zip(*np.polynomial.legendre.leggauss(400), strict=True):
        xi = 1e-3 * at
        force = (1e8 + 3e10 * xi) * 1e-3 * weight
        load = LineLoad(MIDDLE + xi * ALONG, INTO, BRANCH)
        moved += force * load.displacement(x, MODULI.modulus, MODULI.poisson)
        on_x = load.traction(x, np.tile([1.0, 0.0], (len(x), 1)))
        on_y = load.traction(x, np.tile([0.0, 1.0], (len(x), 1)))
        stress += force * np.column_stack([on_x[:, 0], on_y[:, 1], on_x[:, 1]])
    np.testing.assert_allclose(one.stress(x), stress, atol=1e-10 * np.abs(stress).max())
    # A rigid translation is free: it is taken back where the hub is held.
    apart = one.displacement(x, MODULI) - moved
    np.testing.assert_allclose(apart - apart[0], 0.0, atol=1e-10 * np.abs(moved).max())


def test_resultant() -> None:
    one = strip()
    np.testing.assert_allclose(one.force, 2e5 * INTO)
    xi, weight = np.polynomial.legendre.leggauss(4)
    at = MIDDLE + 1e-3 * xi[:, None] * ALONG
    pressure = (1e8 + 3e10 * 1e-3 * xi)[:, None] * INTO
    moment = np.sum(1e-3 * weight * (at[:, 0] * pressure[:, 1] - at[:, 1] * pressure[:, 0]))
    assert one.moment[0] == pytest.approx(moment, rel=1e-12)
    turned = one.turned(np.array([[0.0, -1.0], [1.0, 0.0]]))
    assert turned.moment[0] == pytest.approx(moment, rel=1e-12)
    # Far away a strip is a line load at its centre of pressure.
    x, normal = MIDDLE + 0.3 * (INTO + 0.5 * ALONG), np.array([[0.6, 0.8]])
    xx, yy, xy = one.stress(x[None])[0]
    exact = np.array([xx * 0.6 + xy * 0.8, xy * 0.6 + yy * 0.8])
    np.testing.assert_allclose(one.traction(x[None], normal)[0], exact, rtol=1e-4)


def hertz(cells: int) -> Strips:
    """Unit half-width and peak pressure on y = 0, the body below (y < 0)."""
    edges = np.cos(np.pi * np.arange(cells, -1, -1) / cells)
    s, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)

    def integral(x: np.ndarray) -> np.ndarray:
        return 0.5 * (x * np.sqrt(np.maximum(1 - x**2, 0)) + np.arcsin(x))

    mean = np.diff(integral(edges)) / (2 * half)
    many = np.ones((cells, 1))
    # Into the body is -y, so the strip's own coordinate runs to -x.
    rise = -np.gradient(mean, s)
    return Strips(np.column_stack([s, 0 * s]), many * [0.0, -1.0], many * [0.0, 1.0], half, mean, rise)


def test_hertz_pressure_gives_mcewens_stress_below_the_surface() -> None:
    # McEwen (1949), on the axis of symmetry.
    depth = np.linspace(0.0, 2.0, 201)
    x = np.column_stack([0 * depth, -depth])
    stress = hertz(28).stress(x)
    root = np.sqrt(1 + depth**2)
    np.testing.assert_allclose(stress[:, 1], -1 / root, atol=4e-3)
    np.testing.assert_allclose(stress[:, 0], -((1 + 2 * depth**2) / root - 2 * depth), atol=8e-3)
    shear = 0.5 * -np.diff(principal(stress), axis=1)[:, 0]
    assert shear.max() == pytest.approx(0.300, abs=1e-3)
    assert depth[shear.argmax()] == pytest.approx(0.786, abs=0.011)
