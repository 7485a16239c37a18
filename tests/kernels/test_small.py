"""Small dense systems against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.kernels.compiled import compiled
from gearbench.kernels.small import eliminate, invert, solve_in_place


@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 1), (5, 2), (40, 3), (0, 1)])
def test_elimination(n: int, m: int) -> None:
    rng = np.random.default_rng(n)
    a, b = rng.standard_normal((n, n)), rng.standard_normal((n, m))
    np.testing.assert_allclose(eliminate(np.hstack([a, b])), np.linalg.solve(a, b), rtol=1e-9, atol=1e-12)


def test_elimination_changes_rows_at_a_zero_pivot() -> None:
    system = np.array([[0.0, 2.0, 4.0], [1.0, 1.0, 3.0]])
    np.testing.assert_allclose(eliminate(system)[:, 0], [1.0, 2.0])


@compiled
def solved(system: np.ndarray, n: int) -> None:
    solve_in_place(system, n)


@compiled
def inverted(matrix: np.ndarray, inverse: np.ndarray) -> None:
    invert(matrix, inverse)


@pytest.mark.parametrize("n", [1, 2, 7])
def test_solution_in_place_uses_only_its_part(n: int) -> None:
    system = np.random.default_rng(n).standard_normal((9, 9))
    system[0, 0] = 0.0 if n > 1 else 2.0  # rows have to change places
    wanted = np.linalg.solve(system[:n, :n], system[:n, n])
    rest = system[n:].copy()
    solved(system, n)
    np.testing.assert_allclose(system[:n, n], wanted, rtol=1e-9)
    np.testing.assert_array_equal(system[n:], rest)


@pytest.mark.parametrize("n", [1, 3, 8])
def test_inverse(n: int) -> None:
    matrix = np.random.default_rng(n).standard_normal((n, n))
    matrix[0, 0] = 0.0 if n > 1 else 2.0
    wanted, inverse = np.linalg.inv(matrix), np.empty((n, n))
    inverted(matrix.copy(), inverse)
    np.testing.assert_allclose(inverse, wanted, rtol=1e-9, atol=1e-12)
