"""Quality of curved triangles against triangles whose measures are known."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.geometry import Mesh, quality
from gearbench.geometry.mesh.quality import areas, determinants

STRAIGHT = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
ONE = np.arange(6)[None]


def moved(node: int, by: tuple[float, float]) -> np.ndarray:
    points = STRAIGHT.copy()
    points[node] += by
    return points


def test_straight_triangles() -> None:
    found = quality(Mesh(STRAIGHT, ONE))
    assert (found.elements, found.nodes) == (1, 6)
    assert found.area == pytest.approx(0.5)
    assert found.jacobian == pytest.approx(1.0)
    assert found.angle == pytest.approx(np.pi / 4)
    assert found.widest == pytest.approx(np.pi / 2)
    assert found.aspect == pytest.approx(2 * (1 - np.sqrt(0.5)) / np.sqrt(0.5))  # 2 r/R of the half square
    corners = np.array([[0, 0], [1, 0], [0.5, np.sqrt(0.75)]])
    even = np.concatenate((corners, 0.5 * (corners + corners[[1, 2, 0]])))
    assert quality(Mesh(even, ONE)).aspect == pytest.approx(1.0)
    assert quality(Mesh(even, ONE)).angle == pytest.approx(np.pi / 3)


def test_area_between_parabola_and_chord() -> None:
    # A middle pushed out by h makes the edge a parabola: it adds 2/3 of chord times h.
    assert areas(moved(3, (0.0, -0.12)), ONE)[0] == pytest.approx(0.5 + 2 / 3 * 0.12)


@pytest.mark.parametrize(
    "node, by", [(3, (0.1, 0.15)), (4, (-0.12, -0.1)), (5, (0.2, 0.1)), (3, (-0.2, 0.05))]
)
def test_jacobian_bounds_the_sampled_determinant_from_below(node: int, by: tuple[float, float]) -> None:
    points = moved(node, by)
    steps = np.linspace(0, 1, 101)
    at = np.array([(a, b) for a in steps for b in steps if a + b <= 1 + 1e-12])
    sampled = determinants(points, ONE, at).min() / (2 * areas(points, ONE)[0])
    found = quality(Mesh(points, ONE)).jacobian
    assert found <= sampled + 1e-12
    assert found > sampled - 0.15


def test_a_fold_between_the_nodes_is_seen() -> None:
    points = STRAIGHT.copy()
    points[3:] = (0.22, 0.38), (0.81, 0.76), (-0.02, 0.29)
    # At all six nodes the determinant is positive, yet it falls below zero between them.
    assert determinants(points, ONE, STRAIGHT).min() > 0.1
    inside = np.array([(a, b) for a in np.linspace(0, 1, 21) for b in np.linspace(0, 1, 21) if a + b <= 1])
    assert determinants(points, ONE, inside).min() < -0.2
    assert quality(Mesh(points, ONE)).jacobian < 0


def test_growth_is_the_ratio_of_sizes_across_an_edge() -> None:
    points = np.array(
        [[0, 0], [1, 0], [0, 1], [4, 4], [0.5, 0], [0.5, 0.5], [0, 0.5], [2.5, 2.0], [2.0, 2.5]]
    )
    triangles = np.array([[0, 1, 2, 4, 5, 6], [1, 3, 2, 7, 8, 5]])
    # Areas 0.5 and 3.5.
    assert quality(Mesh(points, triangles)).growth == pytest.approx(np.sqrt(7))
