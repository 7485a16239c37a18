"""Small dense and arrow-shaped systems against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.kernels.small import arrow_factor, arrow_solve, arrow_times, eliminate, plus, times


@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 1), (5, 2), (40, 3), (0, 1)])
def test_elimination(n: int, m: int) -> None:
    rng = np.random.default_rng(n)
    a, b = rng.standard_normal((n, n)), rng.standard_normal((n, m))
    np.testing.assert_allclose(eliminate(np.hstack([a, b])), np.linalg.solve(a, b), rtol=1e-9, atol=1e-12)


def test_elimination_changes_rows_at_a_zero_pivot() -> None:
    system = np.array([[0.0, 2.0, 4.0], [1.0, 1.0, 3.0]])
    np.testing.assert_allclose(eliminate(system)[:, 0], [1.0, 2.0])


def test_arrow() -> None:
    rng = np.random.default_rng(4)
    corner, diagonal = rng.standard_normal((3, 9)), 20.0 + rng.random(12)
    matrix = np.diag(diagonal)
    matrix[:3, 3:], matrix[3:, :3] = corner, corner.T
    x = rng.standard_normal(12)
    np.testing.assert_allclose(arrow_times(diagonal, corner, x), matrix @ x)
    half = np.diag(diagonal) + 0.5 * (matrix - np.diag(diagonal))
    factor = arrow_factor(diagonal, corner, 0.5)
    np.testing.assert_allclose(factor, np.linalg.inv(half)[:3, :3], rtol=1e-9)
    np.testing.assert_allclose(arrow_solve(factor, diagonal, corner, 0.5, x), np.linalg.solve(half, x), rtol=1e-9)


def test_products() -> None:
    rng = np.random.default_rng(5)
    a, x = rng.standard_normal((4, 6)), rng.standard_normal(6)
    np.testing.assert_allclose(times(a, x), a @ x)
    np.testing.assert_allclose(plus(x, -2.0, a[0]), x - 2 * a[0])
