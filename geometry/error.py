"""The one error of this package."""

from __future__ import annotations

from math import ceil, floor


class GeometryError(ValueError):
    """A gear, a pair or a mesh that cannot exist: one sentence with parameter, value and limit."""


def at_least(value: float, decimals: int) -> str:
    """A lower limit as text, rounded up so that the printed number is itself allowed."""
    scale = 10**decimals
    return f"{ceil(value * scale) / scale:.{decimals}f}"


def at_most(value: float, decimals: int) -> str:
    """An upper limit as text, rounded down so that the printed number is itself allowed."""
    scale = 10**decimals
    return f"{floor(value * scale) / scale:.{decimals}f}"
