"""Attributes of a record, each of its kind: numbers that may be computed with, and text."""

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
# No quantity of a rig in SI units is larger; products of what is smaller do not overflow.
LARGEST = 1e30
TEXT = (
    "schema",
    "support_direction",
    "driven_boundary",
    "mesh_phase_origin",
    "condition",
    "model",
    "warnings",
    "provenance",
)


def numeric_attribute(attrs: Mapping[str, Any], name: str) -> float | None:
    """A single number, None where it is absent. Raises RecordError for text, lists and what is not finite."""
    if name not in attrs:
        return None
    raw = attrs[name]
    if isinstance(raw, str | bytes | list | tuple) or np.size(raw) != 1 or np.iscomplexobj(raw):
        raise RecordError(f"attribute {name} = {_shown(raw)} is not a number")
    try:
        value = float(np.asarray(raw).reshape(())[()])
    except (TypeError, ValueError):
        raise RecordError(f"attribute {name} = {_shown(raw)} is not a number") from None
    if not np.isfinite(value):
        raise RecordError(f"attribute {name} = {value:g} must be finite")
    return value


def check_attributes(attrs: Mapping[str, Any]) -> None:
    """Raise RecordError where an attribute that is there is not of its kind."""
    for name in TEXT:
        if not isinstance(attrs.get(name, ""), str):
            raise RecordError(f"attribute {name} = {_shown(attrs[name])} is not text")
    _check_phases(attrs)
    for name in (*POSITIVE, *FINITE):
        value = numeric_attribute(attrs, name)
        if value is None:
            continue
        if name in POSITIVE and value <= 0:
            raise RecordError(f"attribute {name} = {value:g} must be positive and finite")
        if abs(value) > LARGEST or (name in POSITIVE and value < 1 / LARGEST):
            raise RecordError(f"attribute {name} = {value:g} must lie between {1 / LARGEST:g} and {LARGEST:g}")
        if name in WHOLE and value != round(value):
            raise RecordError(f"attribute {name} = {value:g} must be a whole number")


def _check_phases(attrs: Mapping[str, Any]) -> None:
    """mesh_phase: one number, or one for each realisation."""
    if "mesh_phase" not in attrs:
        return
    try:
        phases = np.asarray(attrs["mesh_phase"], dtype=float)
    except (TypeError, ValueError):
        phases = np.array([])
    text = isinstance(attrs["mesh_phase"], str | bytes)
    if text or phases.ndim > 1 or not phases.size or not np.isfinite(phases).all():
        raise RecordError(f"attribute mesh_phase = {_shown(attrs['mesh_phase'])} is no number of cycles")


def _shown(raw: Any) -> str:
    text = " ".join(repr(raw).split())
    return text if len(text) <= 60 else text[:57] + "..."
