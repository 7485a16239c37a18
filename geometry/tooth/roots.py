"""A root of a function of one variable, without the second that loading `scipy.optimize` takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

STEPS = 100


def bracketed_root(function: Callable[[float], Any], low: float, high: float, *, xtol: float, rtol: float) -> float:
    """Root between two points where the function differs in sign, to `xtol` + `rtol` times the root.

    Brent's method (Algorithms for Minimization without Derivatives, 1973, chapter 4) with the steps and the stopping
    rule of `scipy.optimize.brentq`, whose values it returns to the last bit. Raises ValueError without a change of
    sign, and RuntimeError after STEPS steps.
    """
    before, now = float(low), float(high)
    f_before, f_now = float(function(before)), float(function(now))
    if f_before == 0.0:
        return before
    if f_now == 0.0:
        return now
    if not (f_before < 0.0) != (f_now < 0.0):
        raise ValueError("the function has the same sign at both ends")
    other, f_other, step, last = 0.0, 0.0, 0.0, 0.0
    for _ in range(STEPS):
        if f_now != 0.0 and (f_before < 0.0) != (f_now < 0.0):
            other, f_other = before, f_before
            step = last = now - before
        if abs(f_other) < abs(f_now):
            before, now, other = now, other, now
            f_before, f_now, f_other = f_now, f_other, f_now
        tolerance = (xtol + rtol * abs(now)) / 2
        half = (other - now) / 2
        if f_now == 0.0 or abs(half) < tolerance:
            return now
        step, last = _next_step((before, now, other), (f_before, f_now, f_other), (step, last), half, tolerance)
        before, f_before = now, f_now
        now += step if abs(step) > tolerance else (tolerance if half > 0.0 else -tolerance)
        f_now = float(function(now))
    raise RuntimeError(f"no root found in {STEPS} steps")


def _next_step(
    x: tuple[float, float, float],
    f: tuple[float, float, float],
    steps: tuple[float, float],
    half: float,
    tolerance: float,
) -> tuple[float, float]:
    """The step to take, and the one that the next is judged by: by secant or inverse quadratic where that gains
    enough, else half the bracket."""
    (before, now, other), (f_before, f_now, f_other), (step, last) = x, f, steps
    if not (abs(last) > tolerance and abs(f_now) < abs(f_before)):
        return half, half
    if before == other:
        tried = -f_now * (now - before) / (f_now - f_before)
    else:
        d_before = (f_before - f_now) / (before - now)
        d_other = (f_other - f_now) / (other - now)
        tried = -f_now * (f_other * d_other - f_before * d_before) / (d_other * d_before * (f_other - f_before))
    if 2 * abs(tried) < min(abs(last), 3 * abs(half) - tolerance):
        return tried, step
    return half, half
