"""From SI values back to TOML text."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from gearbench.rig.experiment import Condition, Experiment
from gearbench.rig.value import Value, fields_of, format_number, unit_of


def write_text(text: str) -> str:
    """A TOML basic string. JSON escapes are TOML escapes but for DEL, which TOML does not allow bare."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def write_value(value: Any, unit: str, path: str, uncertainty: Mapping[str, float]) -> str:
    """One value in its unit, with its standard deviation where the path has one."""
    if isinstance(value, str):
        return write_text(value)
    if isinstance(value, tuple):
        return "[" + ", ".join(write_value(v, unit, f"{path}.{i}", uncertainty) for i, v in enumerate(value)) + "]"
    text = str(value) if isinstance(value, int) else format_number(value, unit)
    if path in uncertainty:
        return f"{{ value = {text}, sd = {format_number(uncertainty[path], unit)} }}"
    return text


def write_lines(model: type[Value], value: Value, path: str, uncertainty: Mapping[str, float]) -> list[str]:
    """`key = value` lines of the fields of one table, sub-tables left out."""
    lines = []
    for key, (name, _) in fields_of(model).items():
        held = getattr(value, name)
        if held is not None and not isinstance(held, Value):
            lines.append(f"{key} = {write_value(held, unit_of(model, name), f'{_dot(path)}{name}', uncertainty)}")
    return lines


def write_tables(
    model: type[Value], value: Value, path: str, uncertainty: Mapping[str, float], without: Sequence[str] = ()
) -> str:
    """One table and all its sub-tables but those in `without`. Table names carry no unit, so `path` is their TOML name
    as well."""
    lines = write_lines(model, value, path, uncertainty)
    header = [f"[{path}]"] if path and lines else []
    text = "".join(f"{line}\n" for line in [*header, *lines])
    text += "\n" if text else ""
    for name, _ in fields_of(model).values():
        held = getattr(value, name)
        if isinstance(held, Value) and name not in without:
            text += write_tables(type(held), held, f"{_dot(path)}{name}", uncertainty)
    return text


def write_conditions(conditions: Sequence[Condition], uncertainty: Mapping[str, float]) -> str:
    """[[condition]] tables with every key of their experiment."""
    text = ""
    for number, condition in enumerate(conditions):
        experiment, path = condition.experiment, f"conditions.{number}.experiment"
        lines = [
            f"name = {write_text(condition.name)}",
            *write_lines(Experiment, experiment, path, uncertainty),
        ]
        text += "[[condition]]\n" + "".join(f"{line}\n" for line in lines) + "\n"
        if experiment.multisine is not None:
            inner = write_lines(type(experiment.multisine), experiment.multisine, f"{path}.multisine", uncertainty)
            text += "[condition.multisine]\n" + "".join(f"{line}\n" for line in inner) + "\n"
    return text


def _dot(path: str) -> str:
    return f"{path}." if path else ""
