"""Text tables (CSV, TSV and their kin): a head, then rows of numbers.

The head names the columns, with units in brackets behind the names (`angle [deg]`, `M1 (Nm)`), or in a row of
their own below. Lines above it and comments (`#`, `%`) are passed over. A comma may be the decimal sign where it
is not the separator, or where cells are in quotes; exponents may be written with D.
"""

from __future__ import annotations

import contextlib
import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Source, make_column
from gearbench.records.formats.unit_words import is_unit

_LONGEST_HEAD = 200  # lines
_COMMENTS = ("#", "%", "//")
_NAME_UNIT = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))\s*$")
# A unit in brackets, or a name with its unit behind it, in a head whose cells are divided by blanks.
_BETWEEN_BLANKS = re.compile(r"[\[(][^\])]*[\])]|[^\s\[(]+(?:\s*(?:\[[^\]]*\]|\([^)]*\)))?")
_FORTRAN = re.compile(r"(?<=[0-9.])[dD](?=[+-]?[0-9])")
_NO_NUMBER = ("", "nan", "na", "n/a", "-", "inf", "-inf", "+inf")


@dataclass(frozen=True)
class _Layout:
    """How the table is written: separator (None: blanks), decimal comma, first line of numbers."""

    separator: str | None
    comma: bool
    first: int

    def cells(self, line: str) -> list[str]:
        """Cells of a line, without quotes and blanks around them."""
        parts = line.split(self.separator)
        if '"' in line and self.separator is not None:  # a separator within quotes is none
            with contextlib.suppress(csv.Error):  # of a quote that a long line does not close
                parts = next(csv.reader([line], delimiter=self.separator, skipinitialspace=True))
        return [part.strip().strip("\"'").strip() for part in parts]

    def numbers(self, line: str) -> list[float] | None:
        """The numbers of a line, empty cells as NaN; None if there is a cell that is no number."""
        found = []
        for cell in self.cells(line):
            try:
                found.append(float("nan") if cell.lower() in _NO_NUMBER else float(self.plain(cell)))
            except ValueError:
                return None
        return found

    def plain(self, text: str) -> str:
        """Text with a decimal point and exponents with E."""
        text = text.replace(",", ".") if self.comma else text
        return _FORTRAN.sub("E", text)


def read_text(path: Path) -> Source:
    """Columns of a text table with a head. Raises RecordError naming line and column of what is no number."""
    text = _decoded(path)
    lines = text.splitlines()
    layout = _layout(path, lines)
    width = len(layout.numbers(lines[layout.first]) or ())
    names, units = _head(path, lines[: layout.first], layout, width)
    rows = [line for line in lines[layout.first :] if line.strip() and not line.lstrip().startswith(_COMMENTS)]
    data = _numbers(path, rows, layout, names)
    columns = [
        make_column(name, data[:, number], unit=unit)
        for number, (name, unit) in enumerate(zip(names, units, strict=True))
    ]
    return Source(path, "text", tuple(columns))


def _decoded(path: Path) -> str:
    content = path.read_bytes()
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", "replace")
    if b"\0" in content[:4096]:
        raise RecordError(f"{path} is no text: it holds zero bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")  # micro and degree signs of older programs


def _layout(path: Path, lines: list[str]) -> _Layout:
    """The layout under which two successive lines hold the same, largest number of numbers."""
    best: tuple[int, _Layout] | None = None
    layouts = (("\t", False), (";", False), (",", False), ("\t", True), (";", True), (",", True), (None, False))
    for separator, comma in layouts:
        layout = _Layout(separator, comma, 0)
        for number in range(min(len(lines) - 1, _LONGEST_HEAD)):
            here, below = layout.numbers(lines[number]), layout.numbers(lines[number + 1])
            if here is None or below is None or len(here) != len(below) or np.isnan(here).all():
                continue
            if best is None or len(here) > best[0]:
                best = len(here), _Layout(separator, comma, number)
            break
    if best is None:
        raise RecordError(f"{path} has no table of numbers in its first {_LONGEST_HEAD} lines")
    return best[1]


def _head(path: Path, lines: list[str], layout: _Layout, width: int) -> tuple[list[str], list[str | None]]:
    """Names and units from the lines above the numbers."""
    above = [line for line in lines if line.strip()]
    texts = [line.strip().lstrip("#%").strip() for line in above]
    if not texts:
        raise RecordError(f"{path} has no head: the first line must name the columns, like `time [s], angle [deg]`")
    last = _head_cells(texts[-1], layout, width)
    while last and not last[-1]:
        last.pop()  # a separator at the end of every line
    before = _head_cells(texts[-2], layout, width) if len(texts) > 1 else []
    while before and not before[-1]:
        before.pop()
    if 1 < len(last) < len(before) and _are_units(last):
        last += [""] * (len(before) - len(last))
    if len(before) == len(last) and len(last) > 1 and _are_units(last):
        return before, [unit.strip("[]()") or None for unit in last]
    names: list[str] = []
    units: list[str | None] = []
    for cell in last:
        match = _NAME_UNIT.match(cell)
        unit = (match["square"] if match["square"] is not None else match["round"]) if match else None
        names.append(match["name"] if match and match["name"] else cell)
        units.append(unit.strip() or None if unit is not None else None)
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise RecordError(f"{path} has {names.count(twice)} columns called {twice!r}: names must differ")
    return names, units


def _head_cells(line: str, layout: _Layout, width: int) -> list[str]:
    """Cells of a line of the head; blanks that do not divide it into so many columns stand before or within units."""
    cells = layout.cells(line)
    return cells if layout.separator is not None or len(cells) == width else _BETWEEN_BLANKS.findall(line)


def _are_units(cells: list[str]) -> bool:
    """Whether a row below the names holds units: in brackets, or words that are units."""
    filled = [cell for cell in cells if cell not in ("", "-")]
    return bool(filled) and all(cell[:1] in "[(" or is_unit(cell, "force") for cell in filled)


def _numbers(path: Path, rows: list[str], layout: _Layout, names: list[str]) -> NDArray[np.float64]:
    if layout.separator == "," and layout.comma:
        return _slowly(path, rows, layout, len(names))
    text = layout.plain("\n".join(rows))
    try:
        data = np.loadtxt(io.StringIO(text), delimiter=layout.separator, ndmin=2, comments=None)
    except ValueError:
        data = _slowly(path, rows, layout, len(names))
    if data.shape[1] != len(names):
        raise RecordError(
            f"{path} has {len(names)} names ({', '.join(names[:8])}) above {data.shape[1]} columns of numbers"
        )
    return data


def _slowly(path: Path, rows: list[str], layout: _Layout, width: int) -> NDArray[np.float64]:
    """The same with empty cells as NaN; raises RecordError naming row and column."""
    data = np.empty((len(rows), width))
    for number, line in enumerate(rows):
        cells = layout.cells(line)
        if len(cells) == width + 1 and not cells[-1]:
            cells.pop()  # a separator at the end of every line
        if len(cells) != width:
            raise RecordError(
                f"{path}: row {number} of the numbers has {len(cells)} cells, the head names {width}: is the file"
                " truncated?"
            )
        for place, cell in enumerate(cells):
            try:
                data[number, place] = np.nan if cell.lower() in _NO_NUMBER[:5] else float(layout.plain(cell))
            except ValueError:
                raise RecordError(
                    f"{path}: row {number} of the numbers has {cell!r} in column {place + 1}, which is no number"
                ) from None
    return data
