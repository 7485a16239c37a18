"""Numeric attributes of a record: numbers, and of the right kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gearbench.records.errors import RecordError

# Without these the record cannot be cut into periods.
SAMPLING_ATTRIBUTES = ("sampling_rate", "samples_per_period", "periods")
_GEARS = ("driver", "driven")
POSITIVE = (
    *SAMPLING_ATTRIBUTES,
    "mesh_period",
    "working_pressure_angle",
    "periods_averaged",
    *(f"{name}_{gear}" for name in ("teeth", "base_radius", "inertia") for gear in _GEARS),
)
WHOLE = ("samples_per_period", "periods", "periods_averaged", "teeth_driver", "teeth_driven")
FINITE = ("torque_mean", "settling_residual")


def numeric_attribute(attrs: Mapping[str, Any], name: str) -> float | None:
    """A single number, None where it is absent. Raises RecordError for text, lists and what is not finite."""
    if name not in attrs:
        return None
    raw = attrs[name]
    if isinstance(raw, str | bytes) or np.size(raw) != 1:
        raise RecordError(f"attribute {name} = {_shown(raw)} is not a number")
    try:
        value = float(np.asarray(raw).reshape(())[()])
    except (TypeError, ValueError):
        raise RecordError(f"attribute {name} = {_shown(raw)} is not a number") from None
    if not np.isfinite(value):
        raise RecordError(f"attribute {name} = {value:g} must be finite")
    return value


def check_attributes(attrs: Mapping[str, Any]) -> None:
    """Raise RecordError where a numeric attribute that is there is no number of its kind."""
    for name in (*POSITIVE, *FINITE):
        value = numeric_attribute(attrs, name)
        if value is None:
            continue
        if name in POSITIVE and value <= 0:
            raise RecordError(f"attribute {name} = {value:g} must be positive and finite")
        if name in WHOLE and value != round(value):
            raise RecordError(f"attribute {name} = {value:g} must be a whole number")


def _shown(raw: Any) -> str:
    text = " ".join(repr(raw).split())
    return text if len(text) <= 60 else text[:57] + "..."
