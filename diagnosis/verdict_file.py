"""The file of a verdict, verdict.json. Other programs write such files too, so reading checks everything and says what
is wrong in one sentence. Files of version 1 are read as well: their verdict "effect" is "effects" now, and their
standard deviations are intervals."""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

from pydantic import ValidationError

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.verdict import (
    SCHEMA,
    Candidate,
    Confirmed,
    Effect,
    Found,
    Gap,
    Parameter,
    Part,
    Probabilities,
    Share,
    Value,
    Verdict,
)
from gearbench.files import write_text

FORMER = "gearbench-verdict/1"
# A verdict is a page of text; a file beyond this size [bytes] is something else.
LARGEST_FILE = 2**24


def verdict_json(verdict: Verdict) -> str:
    """The text of verdict.json: indented, keys in the order of the fields, ranges as lists."""
    tree = verdict.model_dump(mode="json", by_alias=True)
    for gap in (*tree["gap"], *(tree["confirmed"] or {}).get("gap", ())):
        for name in ("nominal", "recalibrated", "with_effect", "floor"):
            if gap[name] is not None:
                gap[name] = list(gap[name].values())
    for effect in tree["effects"]:
        effect["closes"] = {channel: list(size.values()) for channel, size in effect["closes"].items()}
    return json.dumps(tree, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write_verdict(verdict: Verdict, path: str | Path) -> None:
    """Write verdict.json, replacing `path` in one step. Raises FileError."""
    write_text(path, verdict_json(verdict))


def read_verdict(path: str | Path) -> Verdict:
    """Read and check a verdict of any program. Raises DiagnosisError: one sentence with file, key and limit."""
    source = Path(path)
    if not source.is_file():
        raise DiagnosisError(f"verdict {source} does not exist")
    if source.stat().st_size > LARGEST_FILE:
        raise DiagnosisError(f"verdict {source} has {source.stat().st_size} bytes, at most {LARGEST_FILE}")
    try:
        return parse_verdict(source.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise DiagnosisError(f"verdict {source} is not UTF-8 text") from None
    except DiagnosisError as error:
        raise DiagnosisError(f"verdict {source}: {error}") from None


def parse_verdict(text: str) -> Verdict:
    """The verdict in a JSON text. Raises DiagnosisError: one sentence with key and limit."""
    try:
        tree = json.loads(text, parse_constant=_not_finite, object_pairs_hook=_once)
    except json.JSONDecodeError as error:
        raise DiagnosisError(f"no JSON at line {error.lineno}, column {error.colno}: {error.msg}") from None
    except DiagnosisError:
        raise
    except ValueError as error:
        raise DiagnosisError(f"no usable JSON: {error}") from None
    except RecursionError:
        raise DiagnosisError("JSON nested too deeply for a verdict") from None
    if not isinstance(tree, dict):
        raise DiagnosisError("a verdict is a JSON object with keys in braces")
    if tree.get("schema") == FORMER:
        told = tree.get("verdict")
        tree = {**tree, "schema": SCHEMA, "verdict": "effects" if told == "effect" else told}
    if tree.get("schema") != SCHEMA:
        raise DiagnosisError(f'schema is {json.dumps(tree.get("schema"))}, but a verdict has "{SCHEMA}"')
    try:
        return Verdict.model_validate_json(json.dumps(tree))
    except ValidationError as error:
        raise DiagnosisError(_sentence(error)) from None


def _not_finite(word: str) -> NoReturn:
    raise DiagnosisError(f"holds {word}, but numbers must be finite (use null for what is unknown)")


def _once(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for key, value in pairs:
        if key in tree:
            raise DiagnosisError(f'key "{key}" stands twice in the same object')
        tree[key] = value
    return tree


def _sentence(error: ValidationError) -> str:
    """One sentence from what pydantic found: the first defect, with its dotted key."""
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"] if part != "schema_")
    kind, context = first["type"], first.get("ctx", {})
    if kind == "missing":
        return f"key {where} is missing"
    if kind == "extra_forbidden":
        return f"key {where} is unknown{_nearest(first['loc'])}"
    if kind == "literal_error":
        return f"{where} must be one of {context['expected']}"
    if kind == "value_error":
        words = str(first["msg"]).removeprefix("Value error, ")
        return f"{where}: {words}" if where else words
    words = str(first["msg"]).removeprefix("Input ")
    return f"{where} {words[:1].lower()}{words[1:]}"


# Which values the keys of a verdict hold, for the nearest key to a misspelt one.
_BELOW: dict[str, type[Value]] = {
    "probability": Probabilities,
    "effects": Effect,
    "parameters": Parameter,
    "candidates": Candidate,
    "where": Share,
    "gap": Gap,
    "explained": Part,
    "remainder": Part,
    "structure": Found,
    "confirmed": Confirmed,
}


def _nearest(location: tuple[int | str, ...]) -> str:
    model: type[Value] = Verdict
    for part in location[:-1]:
        model = _BELOW.get(str(part), model)
    known = [field.alias or name for name, field in model.model_fields.items()]
    near = difflib.get_close_matches(str(location[-1]), known, n=1)
    return f"; did you mean {near[0]}?" if near else f"; keys are {', '.join(known)}"
