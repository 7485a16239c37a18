"""Immutable SI values whose TOML keys carry their unit: `module_mm = 2.0` becomes `Gear.module == 0.002`."""

from __future__ import annotations

from math import pi
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

# Factor from the unit in a key's suffix to SI.
UNITS: dict[str, float] = {
    "": 1.0,
    "mm": 1e-3,
    "um": 1e-6,
    "deg": pi / 180.0,
    "gpa": 1e9,
    "rpm": pi / 30.0,
    "hz": 1.0,
    "nm": 1.0,
    "n": 1.0,
    "kg": 1.0,
    "kg_m2": 1.0,
    "kg_m3": 1.0,
    "n_per_m": 1.0,
    "n_s_per_m": 1.0,
    "s": 1.0,
}


class Value(BaseModel):
    """Base of every declarative value: frozen, closed to unknown fields, finite numbers only; attributes in SI."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def quantity(default: Any = ..., unit: str = "", *, doc: str, **limits: Any) -> Any:
    """A field in SI whose TOML key is `<name>_<unit>`; `limits` (gt, ge, lt, le) and `default` are SI as well."""
    if unit not in UNITS:
        raise KeyError(f"unit {unit!r} has no conversion to SI")
    return Field(default, description=doc, json_schema_extra={"unit": unit}, **limits)


def unit_of(model: type[Value], field: str) -> str:
    """Unit suffix of a field ("" when the key carries none)."""
    extra = model.model_fields[field].json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def key_of(model: type[Value], field: str) -> str:
    """TOML key of a field, unit suffix included."""
    unit = unit_of(model, field)
    return f"{field}_{unit}" if unit else field
