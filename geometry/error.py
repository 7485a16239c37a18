"""The one error of this package."""

from __future__ import annotations


class GeometryError(ValueError):
    """A gear, a pair or a mesh that cannot exist: one sentence with parameter, value and limit."""
