"""Checks of lists of numbers, each with a sentence that names key, value and limit."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.rig.value import Value, format_number, key_of, unit_of


def items_within(value: Value, name: str, low: float, high: float) -> None:
    """Raise ValueError at the first item of the list field `name` outside low..high (SI)."""
    unit = unit_of(type(value), name)
    for position, item in enumerate(getattr(value, name)):
        if not low <= item <= high:
            raise ValueError(
                f"{key_of(type(value), name)}[{position}] = {_text(item, unit)} must lie between"
                f" {_text(low, unit)} and {_text(high, unit)}"
            )


def equally_long(value: Value, names: Sequence[str]) -> None:
    """Raise ValueError unless all these list fields have the same length."""
    keys = [key_of(type(value), name) for name in names]
    sizes = [len(getattr(value, name)) for name in names]
    if len(set(sizes)) > 1:
        pairs = ", ".join(f"{key} has {size}" for key, size in zip(keys, sizes, strict=True))
        raise ValueError(f"{pairs} values: they must have equally many")


def _text(number: float, unit: str) -> str:
    return f"{float(format_number(number, unit)):g}"
