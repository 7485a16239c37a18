"""Two runs, records or results compared as a whole: rows, and what is to be said with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from gearbench.bench.results.compare import Results, Row, align, load_results, results_of
from gearbench.bench.results.compare import compare as rows_of

# Operating conditions: attribute of a record, what it is called, unit.
_CONDITIONS = (
    ("torque_mean", "mean torque", "N m"),
    ("mesh_period", "mesh period", "s"),
    ("support_direction", "support direction", ""),
    ("driven_boundary", "boundary of the driven gear", ""),
    ("inertia_driver", "inertia of the driver", "kg m^2"),
    ("inertia_driven", "inertia of the driven gear", "kg m^2"),
)


class Comparison(NamedTuple):
    """The results compared, `b` shifted in mesh phase onto `a` where one has an arbitrary origin; a row for each
    quantity and phase or band; notes: doubts about the records, that shift, and operating conditions in which the
    records differ."""

    a: Results
    b: Results
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    @property
    def totals(self) -> tuple[Row, ...]:
        """The rows that are not of a single mesh phase."""
        return tuple(row for row in self.rows if not row.phase_or_band.endswith("cycles"))


def compare(a: str | Path | xr.Dataset, b: str | Path | xr.Dataset) -> Comparison:
    """Two results side by side, quantity by quantity, over mesh phase or frequency band.

    `a` and `b`: the folder of a run, or a record, a static result or a frequency response, as a file or a dataset.
    Raises BenchError for what is none of these, or where both hold nothing in common, and RecordError for a record that
    contradicts itself.

    >>> import gearbench as gb
    >>> case = gb.read_case("quick_lumped")
    >>> found = gb.compare(gb.static(case, torque=[100.0]), gb.static(case, torque=[200.0]))
    >>> row = found.totals[0]
    >>> f"{row.quantity}: {row.a:.2f} and {row.b:.2f} {row.unit}, {row.percent:+.0f} %"
    'static TE, peak to peak: 2.76 and 5.52 um, +100 %'
    """
    one, two = (_loaded(name, given) for name, given in (("a", a), ("b", b)))
    two, shifted = align(one, two)
    doubts = [f"{side}: {doubt}" for side, result in (("a", one), ("b", two)) for doubt in result.doubts]
    notes = tuple(note for note in (*doubts, shifted, *conditions_that_differ(one, two)) if note)
    return Comparison(one, two, tuple(rows_of(one, two)), notes)


def _loaded(name: str, given: str | Path | xr.Dataset) -> Results:
    return results_of(name, given) if isinstance(given, xr.Dataset) else load_results(Path(given))


def conditions_that_differ(one: Results, two: Results) -> list[str]:
    """Operating conditions in which the records differ: not to be taken for a difference of models."""
    if one.record is None or two.record is None:
        return []
    notes = []
    for key, words, unit in _CONDITIONS:
        values = [_shown(result.attrs.get(key)) for result in (one.record, two.record)]
        if values[0] != values[1]:
            notes.append(f"{words} differs: {values[0]} and {values[1]} {unit}".rstrip())
    return notes


def _shown(value: Any) -> str:
    return f"{float(value):.6g}" if isinstance(value, int | float) or hasattr(value, "dtype") else str(value)
