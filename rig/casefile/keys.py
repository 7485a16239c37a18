"""What a dotted key of a case is, without a value for it: for whoever will set it later, many times over."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args, get_origin

from gearbench.rig.casefile.case import Case
from gearbench.rig.casefile.reader import Reader, kind_of, table_type
from gearbench.rig.errors import CaseError
from gearbench.rig.value import SYMBOLS, Value, fields_of, unit_of


class Key(NamedTuple):
    """What may be set: a whole number, a number, a text (also the file of a gear); `unit` as people write it."""

    kind: Literal["whole", "number", "text"]
    unit: str
    words: str


def key_of_case(dotted: str) -> Key:
    """The value behind a dotted key such as rig.driver.tip_relief_um or rig.driven.pitch_error_um.3.

    Raises CaseError, with the nearest key, for one that is none and for a table.
    """
    model: type[Value] = Case
    parts, where = dotted.split("."), ""
    for depth, part in enumerate(parts):
        known = fields_of(model) | (fields_of(model.common) if model.common else {})
        if part not in known:
            Reader(Case).table(model, {part: None}, where, "")  # raises, with the nearest key
        owner = model if part in fields_of(model) or model.common is None else model.common
        name, info = known[part]
        where = f"{where}.{part}" if where else part
        inner, rest = table_type(info), parts[depth + 1 :]
        if inner is not None:
            model = inner
            if not rest and where in ("rig.driver", "rig.driven"):
                return Key("text", "", info.description or "")
            continue
        kind = kind_of(info.annotation)
        if get_origin(kind) is tuple and len(rest) == 1 and rest[0].isdecimal():
            kind, rest = get_args(kind)[0], []
        if rest:
            raise CaseError(f"{dotted}: {where} is a value and not a table")
        unit = SYMBOLS[unit_of(owner, name)]
        return Key("whole" if kind is int else "number" if kind is float else "text", unit, info.description or "")
    raise CaseError(f"{dotted} is a table: name one of its keys, such as {dotted}.{next(iter(fields_of(model)))}")
