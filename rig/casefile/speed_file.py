"""A course of speeds in a file of its own: `[experiment.speed_table] file = "course.csv"`.

Two columns, named by their keys: `time_s` and `driver_rpm`. Commas, semicolons, tabs or blanks part them; lines that
begin with `#` are comments; further columns are left alone.
"""

from __future__ import annotations

import re
from decimal import Decimal, InvalidOperation
from pathlib import Path

from gearbench.rig.casefile.toml import Table, read_bytes
from gearbench.rig.errors import CaseError

COLUMNS = ("time_s", "driver_rpm")


def include_speeds(document: Table, folder: Path) -> None:
    """Replace the `file` of the speed tables in `document`, of its experiment and of its conditions, by the columns in
    that file, relative to `folder`. Raises CaseError."""
    conditions = document.get("condition")
    places = [("experiment", document.get("experiment"))]
    places += [(f"condition[{k}]", one) for k, one in enumerate(conditions)] if isinstance(conditions, list) else []
    for where, experiment in places:
        table = experiment.get("speed_table") if isinstance(experiment, dict) else None
        if isinstance(experiment, dict) and isinstance(table, dict) and "file" in table:
            experiment["speed_table"] = _read(table, f"{where}.speed_table", folder)


def _read(table: Table, where: str, folder: Path) -> Table:
    name = table["file"]
    if not isinstance(name, str) or not name:
        raise CaseError(f"{where}.file must name a CSV file with the columns {' and '.join(COLUMNS)}")
    given = sorted(table.keys() - {"file"})
    if given:
        raise CaseError(f"{where} has both file and {given[0]}: give one of them")
    path = folder / name
    what = f"speed file {where}.file ="
    try:
        text = read_bytes(path, what, "CSV").decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(f"{what} {path} is not UTF-8 text (byte {error.start})") from error
    rows = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    head = _cells(rows[0][1]) if rows else []
    missing = [column for column in COLUMNS if column not in head]
    if missing:
        raise CaseError(f"{what} {path} has no column {missing[0]}: its first line must name {' and '.join(COLUMNS)}")
    at = [head.index(column) for column in COLUMNS]
    values: list[list[Decimal]] = [[], []]
    for number, line in rows[1:]:
        cells = _cells(line)
        if len(cells) != len(head):
            raise CaseError(f"{what} {path}, line {number}: {len(cells)} values, the first line names {len(head)}")
        for column, place in zip(values, at, strict=True):
            column.append(_number(cells[place], f"{what} {path}, line {number}: {head[place]}"))
    return {column: found for column, found in zip(COLUMNS, values, strict=True)}


def _cells(line: str) -> list[str]:
    parts = re.split(r"[,;\t]", line) if re.search(r"[,;\t]", line) else line.split()
    return [part.strip().strip("\"'").strip() for part in parts]


def _number(cell: str, where: str) -> Decimal:
    try:
        return Decimal(cell)
    except InvalidOperation:
        raise CaseError(f"{where} = {cell!r} must be a number") from None
