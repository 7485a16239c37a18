"""JSON schema of the case file: every key with unit, default, limits and what it means."""

from __future__ import annotations

from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from gearbench.rig.casefile.case import Case
from gearbench.rig.casefile.reader import kind_of, table_type
from gearbench.rig.experiment import Experiment
from gearbench.rig.value import SYMBOLS, Value, fields_of, from_si, unit_of

_LIMITS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}


def case_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of a case file's keys; numbers are in the unit of their key."""
    schema = _table(Case, full=True)
    gears = schema["properties"]["rig"]["properties"]
    for side in ("driver", "driven"):
        gears[side] = {
            "description": gears[side]["description"],
            "oneOf": [{"type": "string", "description": "gear file, relative to the case file"}, gears[side]],
        }
    variation = _table(Experiment, full=False)
    for experiment in (schema["properties"]["experiment"], variation):
        experiment["properties"]["speed_table"] = _or_file(experiment["properties"]["speed_table"])
    variation["properties"] = {"name": {"type": "string", "description": "names the record"}} | variation["properties"]
    schema["properties"]["condition"] = {
        "type": "array",
        "description": "named variations of the experiment: the keys that differ",
        "items": variation | {"required": ["name"]},
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "gearbench case"} | schema


def _or_file(table: dict[str, Any]) -> dict[str, Any]:
    """A table that may name a file in place of its columns."""
    name = {"type": "string", "minLength": 1, "description": "CSV file of the columns, relative to the case file"}
    other = {"type": "object", "properties": {"file": name}, "required": ["file"], "additionalProperties": False}
    return {"description": table["description"], "oneOf": [table, other]}


def _table(model: type[Value], full: bool) -> dict[str, Any]:
    """Schema of one table; `full` = False leaves out what is required."""
    properties = {key: _field(info, unit_of(model, name), full) for key, (name, info) in fields_of(model).items()}
    required = [key for key, (_, info) in fields_of(model).items() if info.is_required()]
    if model.common is not None:
        shared = {
            key: _field(info, unit_of(model.common, name), full)
            for key, (name, info) in fields_of(model.common).items()
        }
        properties = shared | properties
        required = []  # either the common keys or those of each sub-table
        for name, info in model.model_fields.items():
            if table_type(info) is model.common:
                properties[name] = properties[name] | {"required": []}
    schema: dict[str, Any] = {"type": "object", "properties": properties, "additionalProperties": False}
    return schema | ({"required": required} if full else {})


def _field(info: FieldInfo, unit: str, full: bool) -> dict[str, Any]:
    inner = table_type(info)
    text = {"description": info.description or ""}
    if inner is not None:
        return text | _table(inner, full)
    kind = kind_of(info.annotation)
    if unit:
        text["unit"] = SYMBOLS[unit]
    schema: dict[str, Any] = text | _type(kind, info, unit)
    if info.default is not None and not info.is_required():
        schema["default"] = _default(info.default, unit)
    return schema


def _type(kind: Any, info: FieldInfo, unit: str) -> dict[str, Any]:
    if get_origin(kind) is Literal:
        return {"enum": list(get_args(kind))}
    if kind is str:
        return {"type": "string", "minLength": 1}
    if get_origin(kind) is tuple:
        parts = get_args(kind)
        array = {"type": "array", "items": _type(parts[0], info, unit)}
        return array if Ellipsis in parts else array | {"minItems": len(parts), "maxItems": len(parts)}
    plain: dict[str, Any] = {"type": "integer" if kind is int else "number"}
    for rule in info.metadata:
        for name, word in _LIMITS.items():
            limit = getattr(rule, name, None)
            if limit is not None:
                plain[word] = limit if kind is int else _number(limit, unit)
    spread = {"type": "object", "required": ["value", "sd"], "additionalProperties": False}
    spread["properties"] = {
        "value": plain,
        "sd": {"type": "number", "minimum": 0, "description": "standard deviation"},
    }
    return {"oneOf": [plain, spread]}


def _default(value: Any, unit: str) -> Any:
    if isinstance(value, tuple):
        return [_default(item, unit) for item in value]
    return value if isinstance(value, str | int) else _number(value, unit)


def _number(value: float, unit: str) -> float:
    return float(from_si(value, unit))
