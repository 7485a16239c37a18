"""The page of a comparison: two runs, records or results side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.figures.records.compare import FINE, named, paired_curves, paired_responses
from gearbench.figures.records.record import draw_spectra
from gearbench.report.curves import itf_map, over_phase, spectrum
from gearbench.report.html import drawing, folded, image, table, text
from gearbench.report.live import live_page
from gearbench.report.parts import about_record, files_table, lead, limits, mark, provenance, versions, warned

if TYPE_CHECKING:
    from gearbench.bench.results.compare import Results, Row
    from gearbench.bench.results.comparison import Comparison

# Quantities that the answer names, the first that there are of them: beginnings of their names in the rows.
ANSWERS = ("static TE, peak to peak", "DTE", "first mode, lowest", "first mode, highest", "mesh stiffness", "ITF")
MOST = 3


def compare_page(
    found: Comparison, picture: Callable[[str], Path], files: Mapping[str, tuple[str, str]]
) -> str:
    """The page as one HTML text. `picture`: the PNG file of a figure by its name; `files`: what each holds, and its
    SHA-256."""
    one, two = found.a, found.b
    title = f"{one.name} (a) beside {two.name} (b)"
    pictures = _pictures(one, two, picture)
    first, others = pictures[:1], pictures[1:]
    body = [
        mark("compare", title),
        text(title, "h1"),
        *lead(_answer(found.totals)),
        *first,
        *warned(found.notes),
        *others,
        text("All totals", "h2"),
        _rows(found.totals),
        folded("Phase by phase", _rows([row for row in found.rows if row not in found.totals])),
        text("How far to trust it", "h2"),
        *_trust(one, two),
        text("Files beside this page", "h2"),
        files_table(files),
        *_origin(one, two),
    ]
    return live_page(title, body)


def _answer(rows: Sequence[Row]) -> list[str]:
    said: list[str] = []
    for beginning in ANSWERS:
        row = next((row for row in rows if row.quantity.startswith(beginning)), None)
        if row is not None and len(said) < MOST:
            said.append(_sentence(row))
    return said


def _sentence(row: Row) -> str:
    where = "" if row.phase_or_band == "mesh period" else f", {row.phase_or_band}"
    values = f"{row.quantity[0].upper()}{row.quantity[1:]}{where}: {row.a:.4g} {row.unit} in a, {row.b:.4g} in b"
    if row.of_difference is not None:
        return f"{values}; the difference has {row.difference:.3g} {row.unit} rms."
    return f"{values}, {row.percent:+.1f} %." if row.percent == row.percent else f"{values}."


def _pictures(one: Results, two: Results, picture: Callable[[str], Path]) -> list[str]:
    """Everything that both hold; first what moves."""
    phase = np.arange(FINE) / FINE
    pieces: dict[str, str] = {}
    for name, (title, unit, curves) in paired_curves(one, two).items():
        lines = [(f"{letter}: {words}", phase, values) for letter, (words, values) in zip("ab", curves, strict=True)]
        still = image(picture(f"{name}.png"), title)
        pieces[name] = over_phase(f"{name}-live", lines, unit, still, f"{title}, over the mesh phase.")
    if responses := paired_responses(one, two):
        pieces["itf"] = itf_map("itf-live", responses, image(picture("itf.png"), "ITF"))
    if one.record is not None and two.record is not None:
        records = {f"a: {named(one)}": one.record, f"b: {named(two)}": two.record}
        still = drawing(partial(draw_spectra, records=records), "spectrum")
        pieces["spectrum"] = spectrum("spectrum-live", records, still, _band(one, two))
    order = ("dte", "natural_frequency", "static_te", "stiffness", "itf", "spectrum")
    return [pieces[name] for name in order if name in pieces]


def _band(one: Results, two: Results) -> float:
    """Frequency [Hz] up to which either was identified; 0 where neither was."""
    return max((float(held.frf["frequency"].max()) for held in (one, two) if held.frf is not None), default=0.0)


def _rows(rows: Sequence[Row]) -> str:
    cells = [
        (
            row.quantity, row.phase_or_band, *(_number(value) for value in (row.a, row.b, row.difference)), row.unit,
            "" if row.percent != row.percent else f"{row.percent:+.2f}",
        )
        for row in rows
    ]  # fmt: skip
    head = ("quantity", "over", "a", "b", "b - a, or rms of it", "unit", "%")
    return table(head, cells, numbers=(2, 3, 4, 6))


def _number(value: float) -> str:
    return "–" if value != value else f"{value:.5g}"


def _trust(one: Results, two: Results) -> list[str]:
    pieces = [
        text(
            "A difference is one of models or rigs only where both ran under the same conditions; what differs there is"
            " said above. Records are compared sample by sample only where both saw the same torque at the same mesh"
            " phase."
        )
    ]
    models: dict[str, str] = {}
    for letter, result in (("a", one), ("b", two)):
        frf, record = result.frf, result.record
        if frf is not None and "expected_error" in frf.attrs:
            error = float(frf.attrs["expected_error"])
            pieces.append(text(f"The identified response of {letter} is expected to err by {error:.2%} of its rms."))
        if record is not None and record.attrs.get("model"):
            models[str(record.attrs["model"])] = str(record.attrs.get("limits", ""))
    return pieces + [piece for model, said in models.items() for piece in limits(model, said)]


def _origin(one: Results, two: Results) -> list[str]:
    rows = [("compared by", " ".join(value for _, value in versions()))]
    for letter, result in (("a", one), ("b", two)):
        rows.append((letter, result.name))
        if result.record is not None:
            said = about_record(str(result.record.attrs.get("provenance", "")))
            rows += [(f"{letter}, {key}", value) for key, value in said]
    return provenance(rows)
