"""From a table with units in its keys to SI fields, checked key by key."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from math import isfinite
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from gearbench.rig.casefile.meanings import meant
from gearbench.rig.errors import CaseError
from gearbench.rig.value import SYMBOLS, Value, fields_of, format_number, key_of, to_si, unit_of

_LIMITS = (
    ("gt", "greater than", lambda value, limit: value > limit),
    ("ge", "at least", lambda value, limit: value >= limit),
    ("lt", "less than", lambda value, limit: value < limit),
    ("le", "at most", lambda value, limit: value <= limit),
)


@dataclass
class Reader:
    """Reads tables into SI fields; collects the standard deviations (SI) it meets, by dotted field path."""

    root: type[Value]
    uncertainty: dict[str, float] = field(default_factory=dict)

    def table(self, model: type[Value], table: Any, where: str, path: str, partial: bool = False) -> dict[str, Any]:
        """SI fields of `model` from `table`; `where` is its dotted TOML key, `path` its dotted field path.

        `partial` leaves missing keys to the caller. Raises CaseError at the first bad key.
        """
        if not isinstance(table, Mapping):
            raise CaseError(f"{where} = {show(table)} must be a table")
        known = fields_of(model)
        common = fields_of(model.common) if model.common else {}
        for key in table:
            if key not in known and key not in common:
                raise CaseError(self._unknown(model, key, where, [*known, *common]))
        result: dict[str, Any] = {}
        for key, (name, info) in known.items():
            inner = table_type(info)
            if inner is not None and inner is model.common:
                result[name] = self._with_common(inner, table, key, where, f"{_dot(path)}{name}")
            elif key in table:
                place = f"{_dot(where)}{key}"
                result[name] = self.value(info, unit_of(model, name), table[key], place, f"{_dot(path)}{name}")
            elif info.is_required() and not partial:
                raise CaseError(f"{_dot(where)}{key} is missing ({info.description or 'a table'})")
        return result

    def _with_common(
        self, inner: type[Value], table: Mapping[str, Any], key: str, where: str, path: str
    ) -> dict[str, Any]:
        own = table.get(key, {})
        shared = {name: table[name] for name in fields_of(inner) if name in table}
        result = self.table(inner, shared, where, path, partial=True)
        if isinstance(own, Mapping):
            for name in own.keys() & fields_of(inner).keys():
                self._forget(f"{path}.{fields_of(inner)[name][0]}")
        result |= self.table(inner, own, f"{_dot(where)}{key}", path, partial=True)
        for name, (attribute, info) in fields_of(inner).items():
            if info.is_required() and attribute not in result:
                raise CaseError(f"{where}.{name} is missing ({info.description}; or {where}.{key}.{name} for one gear)")
        return result

    def _forget(self, path: str) -> None:
        """Drop the standard deviations of a field, or of all in a table, that is given again."""
        for known in [one for one in self.uncertainty if one == path or one.startswith(f"{path}.")]:
            del self.uncertainty[known]

    def value(self, info: FieldInfo, unit: str, raw: Any, where: str, path: str) -> Any:
        """One field's value in SI."""
        kind = kind_of(info.annotation)
        inner = table_type(info)
        if inner is not None:
            return self.table(inner, raw, where, path)
        if get_origin(kind) is Literal:
            return _choice(raw, get_args(kind), where)
        if kind is str:
            return _text(raw, where)
        if get_origin(kind) is tuple:
            return self._list(info, unit, raw, where, path)
        return self._number(info, unit, raw, where, path, whole=kind is int)

    def _list(self, info: FieldInfo, unit: str, raw: Any, where: str, path: str) -> tuple[Any, ...]:
        items = get_args(kind_of(info.annotation))
        if items[0] is str:
            if not isinstance(raw, list):
                raise CaseError(f"{where} = {show(raw)} must be a list of texts")
            return tuple(_text(item, f"{where}[{i}]") for i, item in enumerate(raw))
        if not isinstance(raw, list):
            raise CaseError(f"{where} = {show(raw)} must be a list of numbers")
        if Ellipsis not in items and len(raw) != len(items):
            raise CaseError(f"{where} = {show(raw)} must have {len(items)} numbers")
        return tuple(
            self._number(info, unit, item, f"{where}[{i}]", f"{path}.{i}", whole=items[0] is int)
            for i, item in enumerate(raw)
        )

    def _number(self, info: FieldInfo, unit: str, raw: Any, where: str, path: str, whole: bool) -> float:
        if isinstance(raw, Mapping):
            if set(raw) != {"value", "sd"}:
                raise CaseError(f"{where} = {show(raw)} must be a number or {{ value = .., sd = .. }}")
            spread = _plain(raw["sd"], unit, f"{where}.sd", whole=False)
            if spread < 0:
                raise CaseError(f"{where}.sd = {show(raw['sd'])} must be at least 0{_in(unit)}")
            self.uncertainty[path] = spread
            raw, where = raw["value"], f"{where}.value"
        value = _plain(raw, unit, where, whole)
        for limit_name, words, holds in _LIMITS:
            for rule in info.metadata:
                limit = getattr(rule, limit_name, None)
                if limit is not None and not holds(value, limit):
                    raise CaseError(f"{where} = {show(raw)} must be {words} {_limit(limit, unit)}{_in(unit)}")
        return value

    def _unknown(self, model: type[Value], key: str, where: str, known: list[str]) -> str:
        place = f"{_dot(where)}{key}"
        if key.startswith(("helix", "beta", "helical")):
            return f"{place}: helical gears are not supported: spur gears only"
        if key.startswith(("web", "rim")) and "hub_radius_mm" in known:
            return (
                f"{place}: webs and rims are not modelled: a gear is as thick as its face width from hub_radius_mm to"
                " the teeth, so give a thin rim by hub_radius_mm, and a web's masses by mass_kg and inertia_kg_m2"
            )
        if any(word in key for word in ("crown", "lead", "face_form", "end_relief")):
            return f"{place}: what varies across the face width is not supported: the gears are plane models"
        stems = {unit_key: unit_key for unit_key in known}
        for owner in (model, model.common):
            stems |= {name: key_of(owner, name) for name in owner.model_fields} if owner else {}
        matching = [stem for stem in stems if key == stem or key.startswith(f"{stem}_")]
        if matching:
            right = stems[max(matching, key=len)]
            return f"{place} is not a known key: it is spelt {right}"
        meaning = meant(key)
        if meaning in known:
            return f"{place} is not a known key: did you mean {meaning}?"
        if meaning and (homes := _homes(self.root, meaning, "")):
            return f"{place} is not a known key: did you mean {' or '.join(homes)}?"
        close = difflib.get_close_matches(key, known, n=1, cutoff=0.7)
        if close:
            return f"{place} is not a known key: did you mean {close[0]}?"
        homes = [home for home in _homes(self.root, key, "") if home != place]
        if homes:
            return f"{place} is not a known key: it belongs to {' or '.join(homes)}"
        loose = difflib.get_close_matches(key, known, n=1, cutoff=0.0)
        return f"{place} is not a known key: the nearest is {loose[0]}"


def _homes(model: type[Value], key: str, where: str) -> list[str]:
    found = []
    for name, (_, info) in fields_of(model).items():
        inner = table_type(info)
        if name == key:
            found.append(f"{_dot(where)}{name}")
        elif inner is not None:
            found += _homes(inner, key, f"{_dot(where)}{name}")
    return found


def _dot(where: str) -> str:
    return f"{where}." if where else ""


def _in(unit: str) -> str:
    return f" {SYMBOLS[unit]}" if unit else ""


def _limit(limit: float, unit: str) -> str:
    return f"{float(format_number(limit, unit)):g}"


def kind_of(annotation: Any) -> Any:
    """The type of a field's value: its annotation without `| None`."""
    if get_origin(annotation) in (Union, UnionType):
        return next(part for part in get_args(annotation) if part is not type(None))
    return annotation


def table_type(info: FieldInfo) -> type[Value] | None:
    """The Value behind a field that is a table, else None."""
    kind = kind_of(info.annotation)
    return kind if isinstance(kind, type) and issubclass(kind, Value) else None


def _choice(raw: Any, allowed: tuple[Any, ...], where: str) -> Any:
    if not isinstance(raw, str) or raw not in allowed:
        close = difflib.get_close_matches(raw, allowed, n=1) if isinstance(raw, str) else []
        hint = f" (did you mean {show(close[0])}?)" if close else ""
        raise CaseError(f"{where} = {show(raw)} must be {' or '.join(show(one) for one in allowed)}{hint}")
    return raw


def _text(raw: Any, where: str) -> str:
    if not isinstance(raw, str) or not raw.strip():
        raise CaseError(f"{where} = {show(raw)} must be a text that is not empty")
    return raw


def _plain(raw: Any, unit: str, where: str, whole: bool) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float | Decimal):
        raise CaseError(f"{where} = {show(raw)} must be a number{f' in {SYMBOLS[unit]}' if unit else ''}")
    if whole and not isinstance(raw, int):
        raise CaseError(f"{where} = {show(raw)} must be a whole number")
    value: float = to_si(raw, unit)
    if not isfinite(value):
        raise CaseError(f"{where} = {show(raw)} must be a finite number{f' in {SYMBOLS[unit]}' if unit else ''}")
    return int(raw) if whole else value


def show(raw: Any) -> str:
    """A raw TOML value as the file would spell it, shortened to one readable line."""
    if isinstance(raw, bool):
        text = str(raw).lower()
    elif isinstance(raw, str):
        text = '"' + " ".join(raw.split()) + '"'
    elif isinstance(raw, Mapping):
        text = "{ " + ", ".join(f"{key} = {show(value)}" for key, value in raw.items()) + " }" if raw else "{}"
    elif isinstance(raw, list):
        text = "[" + ", ".join(show(value) for value in raw[:8]) + (", ..]" if len(raw) > 8 else "]")
    elif isinstance(raw, Decimal) and raw.is_nan():
        text = "nan"
    else:
        try:
            text = str(raw)
        except ValueError:  # an integer of thousands of digits
            text = "a very long number"
    return text if len(text) <= 80 else text[:77] + "..."
