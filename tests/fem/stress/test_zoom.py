"""Division of quadratic triangles: places and quadratic values kept, sizes reached."""

from __future__ import annotations

import numpy as np

from gearbench.fem.stress.zoom import divided


def longest(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    at = points[triangles[:, :3]]
    return np.linalg.norm(at - np.roll(at, 1, axis=1), axis=2).max(axis=1)


def square() -> tuple[np.ndarray, np.ndarray]:
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 0.5], [0.5, 1], [0, 0.5]], float)
    return np.array([[0, 1, 2, 4, 5, 6], [0, 2, 3, 6, 7, 8]]), 1e-3 * points


def test_sizes_area_and_quadratic_values() -> None:
    triangles, points = square()
    x, y = 1e3 * points.T
    values = np.column_stack([points, x * x - 3 * x * y + 2 * y - 1])
    corner = np.array([1e-3, 0.0])

    def size(at: np.ndarray) -> np.ndarray:
        return 0.05e-3 + 0.5 * np.hypot(*(at - corner).T)

    cells, found = divided(triangles, values, size)
    at = found[:, :2]
    assert np.all(longest(cells, at) <= size(at[cells[:, :3]].mean(axis=1)) * (1 + 1e-9))
    assert longest(cells, at).min() < 0.06e-3 < 0.3e-3 < longest(cells, at).max()
    sides = at[cells[:, 1:3]] - at[cells[:, :1]]
    area = 0.5 * np.linalg.det(sides)
    assert np.all(area > 0) and np.isclose(area.sum(), 1e-6, rtol=1e-12)
    x, y = 1e3 * at.T
    np.testing.assert_allclose(found[:, 2], x * x - 3 * x * y + 2 * y - 1, atol=1e-12)
    # Middles lie between their corners, in the order of the format.
    middles = 0.5 * (at[cells[:, :3]] + at[np.roll(cells[:, :3], -1, axis=1)])
    np.testing.assert_allclose(at[cells[:, 3:]], middles, atol=1e-18)
    assert np.array_equal(np.unique(cells), np.arange(len(found)))


def test_nothing_is_divided_without_need() -> None:
    triangles, points = square()
    cells, found = divided(triangles, points, lambda at: np.full(len(at), np.inf))
    assert np.array_equal(cells, triangles) and np.array_equal(found, points)


def test_curved_edges_stay_curved() -> None:
    triangles, points = square()
    points[4, 1] = -0.1e-3  # the lower edge bulges as a parabola
    _, found = divided(triangles, points, lambda at: np.full(len(at), 0.2e-3))
    x, y = 1e3 * found.T
    below = y < -1e-6
    assert below.sum() >= 7
    edge = np.isclose(y, -0.4 * x * (1 - x), atol=1e-9)
    assert edge.sum() >= 15
