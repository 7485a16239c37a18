"""Immutable SI values whose TOML keys carry their unit: `module_mm = 2.0` becomes `Gear.module == 0.002`."""

from __future__ import annotations

from decimal import Decimal, localcontext
from math import isfinite
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

_PI = Decimal("3.14159265358979323846264338327950288419716939937511")

# Factor from the unit in a key's suffix to SI, exact: `2.1` in mm reads as the float nearest to 0.0021.
_FACTORS: dict[str, Decimal] = {
    "": Decimal(1),
    "mm": Decimal("1e-3"),
    "um": Decimal("1e-6"),
    "deg": _PI / 180,
    "gpa": Decimal("1e9"),
    "rpm": _PI / 30,
    "hz": Decimal(1),
    "nm": Decimal(1),
    "n": Decimal(1),
    "kg": Decimal(1),
    "kg_m2": Decimal(1),
    "kg_m3": Decimal(1),
    "n_per_m": Decimal(1),
    "um_per_kn": Decimal("1e-9"),
    "n_s_per_m": Decimal(1),
    "nm_per_rad": Decimal(1),
    "nm_s_per_rad": Decimal(1),
    "m_per_s": Decimal(1),
    "urad": Decimal("1e-6"),
    "us": Decimal("1e-6"),
    "s": Decimal(1),
}

UNITS: dict[str, float] = {unit: float(factor) for unit, factor in _FACTORS.items()}

# The same units as people write them.
SYMBOLS: dict[str, str] = {
    "": "",
    "mm": "mm",
    "um": "um",
    "deg": "deg",
    "gpa": "GPa",
    "rpm": "rpm",
    "hz": "Hz",
    "nm": "N m",
    "n": "N",
    "kg": "kg",
    "kg_m2": "kg m^2",
    "kg_m3": "kg/m^3",
    "n_per_m": "N/m",
    "um_per_kn": "um/kN",
    "n_s_per_m": "N s/m",
    "nm_per_rad": "N m/rad",
    "nm_s_per_rad": "N m s/rad",
    "m_per_s": "m/s",
    "urad": "urad",
    "us": "us",
    "s": "s",
}


class Value(BaseModel):
    """Base of every declarative value: frozen, closed to unknown fields, finite numbers only, in SI.

    `groups` names sets of fields of which a case gives at most one; setting one clears the others.
    `forgets` maps a field to those that go back to their defaults when a variation sets it.
    `common` is the type whose keys may stand directly in the table, for all its sub-tables of that type.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, hide_input_in_errors=True)
    groups: ClassVar[tuple[tuple[str, ...], ...]] = ()
    forgets: ClassVar[dict[str, tuple[str, ...]]] = {}
    common: ClassVar[type[Value] | None] = None


def quantity(default: Any = ..., unit: str = "", *, doc: str, **limits: Any) -> Any:
    """A field in SI with the TOML key `<name>_<unit>`; `limits` (gt, ge, lt, le) and `default` are SI too."""
    if unit not in UNITS:
        raise KeyError(f"unit {unit!r} has no conversion to SI")
    return Field(default, description=doc, json_schema_extra={"unit": unit}, **limits)


def derived(default: Any, *, doc: str) -> Any:
    """A field that no key of a case table sets directly."""
    return Field(default, description=doc, json_schema_extra={"toml": False})


def unit_of(model: type[Value], field: str) -> str:
    """Unit suffix of a field ("" when the key carries none)."""
    extra = model.model_fields[field].json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def key_of(model: type[Value], field: str) -> str:
    """TOML key of a field, unit suffix included."""
    unit = unit_of(model, field)
    return f"{field}_{unit}" if unit else field


def fields_of(model: type[Value]) -> dict[str, tuple[str, FieldInfo]]:
    """TOML key -> (field name, field) of every field that a case file may set."""
    return {
        key_of(model, name): (name, field)
        for name, field in model.model_fields.items()
        if not (isinstance(field.json_schema_extra, dict) and field.json_schema_extra.get("toml") is False)
    }


def to_si(number: Decimal | float, unit: str) -> float:
    """The float nearest to `number` (in `unit`) in SI; not finite when `number` is not."""
    try:
        plain = float(number)
    except OverflowError:
        return float("inf")
    if not isfinite(plain):
        return plain
    with localcontext(prec=60):
        return float(Decimal(repr(number) if isinstance(number, float) else number) * _FACTORS[unit])


def from_si(value: float, unit: str) -> Decimal:
    """The shortest decimal in `unit` that `to_si` turns into exactly `value`."""
    with localcontext(prec=60):
        exact = Decimal(repr(float(value))) / _FACTORS[unit]
    for digits in range(15, 60):
        with localcontext(prec=digits):
            candidate = +exact
        if to_si(candidate, unit) == value:
            return candidate
    return exact


def format_number(value: float, unit: str = "") -> str:
    """A TOML float for an SI value in its unit, as short as exactness allows."""
    number = from_si(value, unit)
    short = repr(float(number))
    return short if Decimal(short) == number else str(number)
