"""The search for the lowest point, on functions whose lowest point is known."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest

from gearbench.bench import BenchError
from gearbench.bench.study.minimise import minimise


def test_the_worst_of_two_valleys_lies_where_they_cross() -> None:
    """|x - 1| and |x - 4| + 1 are equal at x = 3, which is no smooth point of their maximum."""
    found = minimise(lambda p: np.array([abs(p[0] - 1), abs(p[0] - 4) + 1]), [(0.0, 10.0)])
    assert found.points[found.best] == pytest.approx([3.0], abs=0.02)
    assert found.aim[found.best] == pytest.approx(2.0, abs=0.02)
    # Within 10 %, aim 2.2: from x = 2.8 to x = 3.2.
    assert found.flat[0] == pytest.approx((2.8, 3.2), abs=0.05)


def test_the_mean_is_another_question() -> None:
    found = minimise(lambda p: np.array([(p[0] - 1) ** 2, (p[0] - 4) ** 2]), [(0.0, 10.0)], "mean")
    assert found.points[found.best] == pytest.approx([2.5], abs=0.02)


def test_the_deeper_of_two_minima_is_found() -> None:
    """A shallow valley at 2, a narrower and deeper one at 8, which descent from the middle would miss."""

    def two(p: tuple[float, ...]) -> np.ndarray:
        return np.array([5 - 3 * np.exp(-((p[0] - 2) ** 2)) - 4 * np.exp(-2 * (p[0] - 8) ** 2)])

    found = minimise(two, [(0.0, 10.0)])
    assert found.points[found.best] == pytest.approx([8.0], abs=0.02)


def test_a_bound_is_reached() -> None:
    found = minimise(lambda p: np.array([2.0 - p[0]]), [(0.0, 1.0)])
    assert found.points[found.best].tolist() == [1.0]
    assert found.flat[0] == (pytest.approx(0.9), 1.0)


def test_two_keys_in_a_slanting_valley() -> None:
    def valley(p: tuple[float, ...]) -> np.ndarray:
        x, y = p[0] - 3.3, p[1] - 0.123
        return np.array([1 + x**2 + 100 * (y - 0.1 * x) ** 2])

    found = minimise(valley, [(0.0, 10.0), (-1.0, 1.0)])
    assert found.aim[found.best] == pytest.approx(1.0, abs=1e-3)
    assert found.points[found.best] == pytest.approx([3.3, 0.123], abs=0.03)
    assert found.scanned == 81


def test_three_keys() -> None:
    found = minimise(lambda p: np.array([1 + sum((one - 0.3) ** 2 for one in p)]), [(0.0, 1.0)] * 3)
    assert found.points[found.best] == pytest.approx([0.3] * 3, abs=0.02)


@pytest.mark.parametrize("keys", [1, 2])
def test_points_without_a_result_are_walked_around(keys: int) -> None:
    """Beyond 0.5 there is nothing; the lowest point lies beside it."""

    def half(p: tuple[float, ...]) -> np.ndarray:
        return np.array([nan if p[0] > 0.5 else 1 + (p[0] - 0.45) ** 2 + sum((one - 0.2) ** 2 for one in p[1:])])

    found = minimise(half, [(0.0, 1.0)] * keys)
    assert found.points[found.best][0] == pytest.approx(0.45, abs=0.02)
    assert found.flat[0][1] <= 0.5


def test_the_same_question_gets_the_same_answer() -> None:
    ask = [minimise(lambda p: np.array([np.sin(5 * p[0]) + p[1] ** 2]), [(0.0, 3.0), (-1.0, 1.0)]) for _ in range(2)]
    assert (ask[0].points == ask[1].points).all() and ask[0].best == ask[1].best


def test_nothing_anywhere_is_said() -> None:
    with pytest.raises(BenchError, match="no point"):
        minimise(lambda p: np.array([nan]), [(0.0, 1.0)])
    with pytest.raises(BenchError, match="at most 6"):
        minimise(lambda p: np.array([1.0]), [(0.0, 1.0)] * 7)
