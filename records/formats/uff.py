"""Universal file format, dataset 58 (function at nodal degree of freedom), in text or binary."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Mapping
from math import floor, log10
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Column, Source, first_line, make_column, stacked

_DIRECTIONS = {0: "", 1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"} | {
    sign * (axis + 3): f"{'+' if sign > 0 else '-'}R{name}"
    for axis, name in ((1, "X"), (2, "Y"), (3, "Z"))
    for sign in (1, -1)
}
_TIME = (0, 1, 17)  # abscissa: unknown, general, time
# What begins and ends a dataset: a line of its own, but for the one that follows values in binary.
_MARK = re.compile(rb"(?<![^\r\n])    -1 *(?=[\r\n]|\Z)")
_MARK_AFTER_BYTES = re.compile(rb"[\r\n]*    -1 *(?=[\r\n]|\Z)")
_LINE_END = re.compile(rb"\r?\n|\r")


def read_uff(path: Path) -> Source:
    """Time functions of a universal file. A function's name is its first ID line, with node and direction where
    several share it; functions that agree in all of that are runs. Raises RecordError, also where a dataset is cut."""
    import pyuff

    _check_whole(path)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            file = pyuff.UFF(str(path))
            kinds = [int(kind) for kind in file.get_set_types()]
            sets = [(number, file.read_sets(number)) for number, kind in enumerate(kinds) if kind == 58]
    except Exception as reason:  # the reader raises plain exceptions
        raise RecordError(f"{path} is truncated or no universal file ({first_line(reason)})") from reason
    if not sets:
        raise RecordError(f"{path} holds no dataset 58; it has {', '.join(map(str, kinds)) or 'no dataset at all'}")
    places: dict[str, set[str]] = {}
    for _, one in sets:
        places.setdefault(_title(one), set()).add(_place(one))
    columns, skipped = [], {}
    for number, one in sets:
        name = _title(one)
        if len(places[name]) > 1:
            name = f"{name} {_place(one)}".strip()
        try:
            columns.append(_column(name, one, f"{path}: dataset {number + 1} ({name})"))
        except _NoTime as reason:
            skipped[f"{name} (dataset {number + 1})"] = str(reason)
    return Source(path, "UFF", stacked(columns), {}, skipped)


class _NoTime(ValueError):
    """A dataset that is no signal over time."""


def _check_whole(path: Path) -> None:
    """Refuse a file in which a dataset is begun and not ended: the reader would pass over it without a word."""
    content = path.read_bytes()
    at = number = 0
    while begin := _MARK.search(content, at):
        number += 1
        end = _end(content, begin.end())
        if end is None:
            raise RecordError(f"{path} is truncated: dataset {number}{_named(content, begin.end())} is not ended by -1")
        at = end
    if content[at:].strip() == b"-":
        raise RecordError(f"{path} is truncated: dataset {number + 1} is not ended by -1")


def _end(content: bytes, begin: int) -> int | None:
    """Where the mark ends that closes the dataset whose head line follows `begin`; None if there is none."""
    at = _line_after(content, begin)
    head = content[at : at + 80]
    counts = [head[19:31].strip(), head[31:43].strip()]
    if head[6:7].lower() != b"b" or not all(count.isdigit() for count in counts):
        found = _MARK.search(content, at)
        return found.end() if found else None
    for _ in range(int(counts[0]) + 1):
        at = _line_after(content, at)
    after = at + int(counts[1])
    # Some writers count the values of uneven abscissas wrong: then the next mark is taken.
    found = _MARK_AFTER_BYTES.match(content, after) or _MARK_AFTER_BYTES.search(content, at)
    return found.end() if found else None


def _line_after(content: bytes, at: int) -> int:
    """Where the next line begins; the end of the content if there is none."""
    found = _LINE_END.search(content, at)
    return found.end() if found else len(content)


def _named(content: bytes, begin: int) -> str:
    """ID line 1 of a dataset 58 in brackets, as far as it is there."""
    at = _line_after(content, begin)
    title = _word(content[_line_after(content, at) :][:80].split(b"\n")[0].decode("utf-8", "replace"))
    return f" ({title})" if content[at : at + 6] == b"    58" and title else ""


def _column(name: str, one: Mapping[str, Any], where: str) -> Column:
    if int(one["func_type"]) > 1 or int(one["abscissa_spec_data_type"]) not in _TIME:
        raise _NoTime("is no function of time")
    if int(one["ord_data_type"]) in (5, 6):
        raise _NoTime("holds complex values")
    values, points = np.asarray(one["data"], dtype=np.float64), int(one["num_pts"])
    if values.size < points:
        raise RecordError(f"{where} is truncated: it has {values.size} of {points} values")
    unit = _word(one.get("ordinate_axis_units_lab"))
    if int(one["abscissa_spacing"]) == 0:
        return make_column(name, values[:points], unit=unit, time=np.asarray(one["x"], dtype=np.float64)[:points])
    step = float(one["abscissa_inc"])
    if not step > 0:
        raise RecordError(f"{where} has the abscissa increment {step:g}, which must be positive")
    # The header prints the step with six digits.
    tolerance = 0.51e-5 * 10 ** floor(log10(step)) / step
    return make_column(
        name,
        values[:points],
        unit=unit,
        rate=1.0 / step,
        rate_tolerance=tolerance,
        start=float(one["abscissa_min"]),
    )


def _title(one: Mapping[str, Any]) -> str:
    return _word(one.get("id1")) or _word(one.get("ordinate_axis_lab")) or _place(one)


def _place(one: Mapping[str, Any]) -> str:
    return f"{int(one.get('rsp_node', 0))}:{_DIRECTIONS.get(int(one.get('rsp_dir', 0)), '?')}".rstrip(":")


def _word(text: object) -> str | None:
    word = str(text or "").strip()
    return word if word and word.upper() != "NONE" else None
