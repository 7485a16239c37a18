"""Roots against SciPy's own Brent, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from math import atan, cos, exp, nan, tanh

import numpy as np
import pytest
from scipy.optimize import brentq

from gearbench.geometry.tooth.roots import bracketed_root

FUNCTIONS: list[tuple[Callable[[float], float], float, float]] = [
    (lambda x: x * x - 2.0, 0.0, 2.0),
    (lambda x: cos(x) - x, 0.0, 1.5),
    (lambda x: x - atan(x) - 0.01, 0.0, 2.01),
    (lambda x: (x - 1.0) ** 3 + 1e-3 * (x - 1.0), -3.0, 2.5),
    (lambda x: tanh(40.0 * (x - 0.3)), 0.0, 1.0),
    (lambda x: exp(-x) - 1e-6, 0.0, 40.0),
    (lambda x: x, 0.0, 1.0),
    (lambda x: x - 1.0, 0.0, 1.0),
    (lambda x: 3.0 - x, 5.0, 1.0),
]


@pytest.mark.parametrize("rtol", [1e-15, 1e-6])
@pytest.mark.parametrize("number", range(len(FUNCTIONS)))
def test_root_is_that_of_scipy(number: int, rtol: float) -> None:
    function, low, high = FUNCTIONS[number]
    expected = brentq(function, low, high, xtol=1e-15, rtol=rtol)
    assert bracketed_root(function, low, high, xtol=1e-15, rtol=rtol) == expected


def test_random_quintics() -> None:
    rng = np.random.default_rng(5)
    compared = 0
    for _ in range(200):
        polynomial = np.polynomial.Polynomial(rng.normal(size=6))
        if polynomial(-2.0) * polynomial(2.0) < 0.0:
            expected = brentq(polynomial, -2.0, 2.0, xtol=1e-15, rtol=1e-15)
            assert bracketed_root(polynomial, -2.0, 2.0, xtol=1e-15, rtol=1e-15) == expected
            compared += 1
    assert compared > 80


def test_no_change_of_sign_is_an_error() -> None:
    with pytest.raises(ValueError, match="same sign"):
        bracketed_root(lambda x: x * x + 1.0, -1.0, 1.0, xtol=1e-9, rtol=1e-9)
    with pytest.raises((ValueError, RuntimeError)):
        bracketed_root(lambda x: nan, -1.0, 1.0, xtol=1e-9, rtol=1e-9)
