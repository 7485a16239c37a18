"""A study: which keys of a case vary, over what, and which results are wanted. The words of `--vary` are read here."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from pydantic import model_validator

from gearbench.rig.errors import CaseError
from gearbench.rig.value import Value, quantity

Sample = Literal["grid", "lhs", "sobol"]
SAMPLES: tuple[Sample, ...] = ("grid", "lhs", "sobol")

_FORMS = "KEY=V1,V2,.. or KEY=LOW:HIGH:COUNT or KEY=LOW:HIGH or KEY=normal(MEAN,SD)"
_NORMAL = re.compile(r"normal\(([^,()]*),([^,()]*)\)", re.IGNORECASE)
_MOST_LEVELS = 1_000_000


@dataclass(frozen=True)
class Axis:
    """What varies: `keys` (dotted, unit included) that move together, and over what, in the unit of the key.

    kind "levels": `levels` as TOML spells them; "range": `count` evenly spaced levels from `low` to `high`;
    "interval": anything between them; "normal": mean `low`, standard deviation `high`.
    """

    keys: tuple[str, ...]
    kind: Literal["levels", "range", "interval", "normal"]
    levels: tuple[str, ...] = ()
    low: float = 0.0
    high: float = 0.0
    count: int = 0

    @property
    def name(self) -> str:
        """The column that it has in a table."""
        return "+".join(self.keys)


def parse_axis(text: str) -> Axis:
    """An axis from the words of `--vary`. Raises CaseError, one sentence, for what is not of one of the forms."""
    left, equals, right = text.partition("=")
    keys = tuple(key.strip() for key in left.split("+"))
    right = right.strip()
    if not equals or not right or not all(re.fullmatch(r"\w+(\.\w+)*", key) for key in keys):
        raise CaseError(f"--vary {text!r} must read {_FORMS}")
    if len(set(keys)) < len(keys):
        raise CaseError(f"--vary {text!r} names a key twice")
    if right.lower().startswith("normal"):
        return _normal(text, keys, right)
    if ":" in right and not right.startswith(('"', "'", "[")):
        return _between(text, keys, right.split(":"))
    levels = tuple(_split(right))
    if not all(levels):
        raise CaseError(f"--vary {text!r} has an empty value between its commas")
    if len(set(levels)) < len(levels):
        raise CaseError(f"--vary {text!r} names a value twice")
    return Axis(keys, "levels", levels)


def _normal(text: str, keys: tuple[str, ...], right: str) -> Axis:
    found = _NORMAL.fullmatch(right)
    if found is None:
        raise CaseError(f"--vary {text!r} must read KEY=normal(MEAN,SD)")
    mean, sd = (_number(text, part) for part in found.groups())
    if sd <= 0:
        raise CaseError(f"--vary {text!r}: the standard deviation {sd:g} must be greater than 0")
    return Axis(keys, "normal", low=mean, high=sd)


def _between(text: str, keys: tuple[str, ...], parts: list[str]) -> Axis:
    if len(parts) not in (2, 3):
        raise CaseError(f"--vary {text!r} must read KEY=LOW:HIGH:COUNT or KEY=LOW:HIGH")
    low, high = (_number(text, part) for part in parts[:2])
    if not low < high:
        raise CaseError(f"--vary {text!r}: {low:g} must be less than {high:g}")
    if len(parts) == 2:
        return Axis(keys, "interval", low=low, high=high)
    if not re.fullmatch(r"\s*\d{1,9}\s*", parts[2]) or not 2 <= int(parts[2]) <= _MOST_LEVELS:
        raise CaseError(f"--vary {text!r}: the count {parts[2]} must be a whole number from 2 to {_MOST_LEVELS}")
    return Axis(keys, "range", low=low, high=high, count=int(parts[2]))


def _number(text: str, part: str) -> float:
    try:
        value = float(part)
    except ValueError:
        raise CaseError(f"--vary {text!r}: {part.strip()!r} must be a number ({_FORMS})") from None
    if not isfinite(value):
        raise CaseError(f"--vary {text!r}: {part.strip()} must be a finite number")
    return value


def _split(text: str) -> list[str]:
    """Parts between commas that stand outside of brackets and quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in "[{":
            depth += 1
        elif letter in "]}":
            depth -= 1
        if letter == "," and not depth and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


class Study(Value):
    """What `campaign` varies of this case, how members are drawn and what is wanted of each."""

    vary: tuple[str, ...] = quantity((), doc="what varies, each as --vary has it: KEY=V1,V2 | LOW:HIGH:COUNT | ..")
    of: tuple[str, ...] = quantity((), doc="results wanted of each member; empty: te-peak-to-peak")
    sample: Sample = quantity("grid", doc="every combination of levels, a Latin hypercube, or a Sobol design")
    size: int = quantity(64, ge=2, le=2**24, doc="members of lhs; base points of sobol, a power of 2")
    seed: int = quantity(0, ge=0, le=2**63 - 1, doc="seed of lhs, sobol and of the intervals of the indices")
    torque: float | None = quantity(None, "nm", gt=0.0, doc="load of static results; absent: the experiment's mean")
    positions: int = quantity(64, ge=8, le=65_536, doc="mesh phases of a mesh cycle of static results")
    cycles: int = quantity(1, ge=1, le=8192, doc="mesh cycles of static results, where teeth differ")

    @model_validator(mode="after")
    def _readable(self) -> Study:
        names = [key for text in self.vary for key in parse_axis(text).keys]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{name} varies twice")
        return self
