"""Two sets of results side by side, quantity by quantity, over mesh phase or frequency band."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.results.compare_records import differences
from gearbench.bench.results.measures import mesh_orders, mode_range, synchronous_mean
from gearbench.records import SCHEMA as RECORD_SCHEMA
from gearbench.records import read_dataset, read_record
from gearbench.records.checks import check_record

Array = NDArray[np.float64]

PHASES = 32  # rows over one mesh period
BANDS = 10  # rows over the common frequency range

_FILES = {"record": "record.nc", "static": "static.nc", "frf": "frf.nc"}
_SCHEMAS = {"gearbench-record/1": "record", "gearbench-static/1": "static", "gearbench-frf/1": "frf"}


class Row(NamedTuple):
    """One line of compare.csv; `difference` is b - a, `percent` relates it to a.

    For the rms of a signal, `of_difference` is the rms of the difference of both signals and takes its place.
    """

    quantity: str
    phase_or_band: str
    unit: str
    a: float
    b: float
    of_difference: float | None = None

    @property
    def difference(self) -> float:
        """b - a, or the rms of the difference."""
        return self.b - self.a if self.of_difference is None else self.of_difference

    @property
    def percent(self) -> float:
        """100 difference / |a|; NaN where a is 0."""
        return 100 * self.difference / abs(self.a) if self.a else float("nan")


@dataclass(frozen=True)
class Results:
    """What a run left, as far as it is there. `shift` [cycles] is added to every mesh phase; `doubts`: what the record
    makes one doubt about itself."""

    name: str
    record: xr.Dataset | None = None
    static: xr.Dataset | None = None
    frf: xr.Dataset | None = None
    shift: float = 0.0
    doubts: tuple[str, ...] = ()

    @property
    def phase_known(self) -> bool:
        """Whether mesh phase 0 is the geometry's."""
        held = [result for result in (self.record, self.frf) if result is not None]
        return all(result.attrs.get("mesh_phase_origin", "geometry") == "geometry" for result in held)


def load_results(path: Path) -> Results:
    """Results in a run's folder, or a single record, static.nc or frf.nc. Raises BenchError, and RecordError for a
    record that contradicts itself."""
    if path.is_dir():
        found = {kind: _read(path / name) for kind, name in _FILES.items() if (path / name).is_file()}
        if not found:
            raise BenchError(f"{path} holds none of {', '.join(_FILES.values())}: it is not the folder of a run")
        return _results(path.name, found, str(path / _FILES["record"]))
    if not path.is_file():
        raise BenchError(f"{path} does not exist")
    return results_of(path.stem, _read(path), str(path))


def results_of(name: str, result: xr.Dataset, where: str = "") -> Results:
    """A single record, static result or frequency response as results of that name. Raises BenchError, which calls
    it `where`, and RecordError for a record that contradicts itself."""
    schema = str(result.attrs.get("schema", "none"))
    if schema not in _SCHEMAS:
        raise BenchError(f"{where or name} has schema {schema}, which is not one of {', '.join(_SCHEMAS)}")
    return _results(name, {_SCHEMAS[schema]: result}, where or name)


def _results(name: str, found: dict[str, xr.Dataset], where: str) -> Results:
    """Results of a name, their record checked; `where` is what a refusal calls it."""
    record = found.get("record")
    doubts = () if record is None else tuple(finding.sentence for finding in check_record(record, where))
    return Results(name, record, found.get("static"), found.get("frf"), doubts=doubts)


def _read(path: Path) -> xr.Dataset:
    found = read_dataset(path, error=BenchError)
    return read_record(path) if str(found.attrs.get("schema")) == RECORD_SCHEMA else found


def align(one: Results, two: Results) -> tuple[Results, str]:
    """`two` shifted in mesh phase onto `one` where one has an arbitrary origin, and a sentence on it."""
    if one.phase_known and two.phase_known:
        return two, ""
    for what, curves in (("natural frequency", _natural), ("DTE", _dte)):
        first, second = curves(one, 256), curves(two, 256)
        if first is not None and second is not None:
            shift = best_shift(first, second)
            sentence = f"the mesh phase of one result is arbitrary; b is shifted by {shift:+.4f} cycles ({what})"
            return replace(two, shift=shift), sentence
    return two, "the mesh phase of one result is arbitrary and nothing allows to estimate the shift"


def best_shift(one: Array, two: Array) -> float:
    """Shift s in [-0.5, 0.5) cycles such that two(phase - s) resembles one(phase) most; uniform phases."""
    product = np.fft.rfft(one - one.mean()) * np.conj(np.fft.rfft(two - two.mean()))
    correlation = np.fft.irfft(product, one.size)
    return float((np.argmax(correlation) / one.size + 0.5) % 1.0 - 0.5)


def compare(one: Results, two: Results) -> list[Row]:
    """Rows for everything that both hold. Raises BenchError if that is nothing."""
    rows = [*_static_rows(one, two), *_dte_rows(one, two), *_mode_rows(one, two), *_itf_rows(one, two)]
    if not rows:
        raise BenchError(f"{one.name} and {two.name} hold nothing that both could be compared by")
    return rows


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """compare.csv; NaN as an empty field."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["quantity", "phase_or_band", "unit", "a", "b", "difference", "percent"])
        for row in rows:
            numbers = (row.a, row.b, row.difference, row.percent)
            writer.writerow([*row[:3], *("" if np.isnan(value) else f"{value:.9g}" for value in numbers)])


def on_phases(phase: Array, values: Array, count: int, shift: float = 0.0) -> Array:
    """Periodic values on `count` uniform phases, by straight lines; `shift` is added to `phase`; no NaN."""
    good = np.isfinite(values)
    if not good.any():
        return np.full(count, np.nan)
    return np.interp(np.arange(count) / count, (phase + shift)[good] % 1.0, values[good], period=1.0)


def _static_rows(one: Results, two: Results) -> list[Row]:
    if one.static is None or two.static is None:
        return []
    te = [1e6 * result["transmission_error"].values[0] for result in (one.static, two.static)]
    rows = [Row("static TE, peak to peak", "mesh period", "um", *(float(np.ptp(values)) for values in te))]
    orders = [mesh_orders(values) for values in te]
    rows += [
        Row("static TE, amplitude", f"mesh order {n + 1}", "um", float(orders[0][n]), float(orders[1][n]))
        for n in range(3)
    ]
    curves = [
        on_phases(
            result.static["phase"].values,
            result.static["stiffness_tangent"].values[0] / 1e6,
            PHASES,
            result.shift,
        )
        for result in (one, two)
        if result.static is not None
    ]
    return rows + _phase_rows("mesh stiffness, tangent", "N/um", *curves)


def _dte_rows(one: Results, two: Results) -> list[Row]:
    first, second = _dte(one, PHASES), _dte(two, PHASES)
    if first is None or second is None:
        return []
    assert one.record is not None and two.record is not None
    rows = [Row(*found) for found in differences(one.record, two.record)]
    return rows + _phase_rows("DTE, mean over mesh periods", "um", 1e6 * first, 1e6 * second)


def _mode_rows(one: Results, two: Results) -> list[Row]:
    if one.frf is None or two.frf is None:
        return []
    first, second = mode_range(one.frf), mode_range(two.frf)
    rows = [
        Row("first mode, lowest", "mesh period", "Hz", first[0], second[0]),
        Row("first mode, highest", "mesh period", "Hz", first[1], second[1]),
    ]
    curves = _natural(one, PHASES), _natural(two, PHASES)
    if curves[0] is None or curves[1] is None:
        return rows
    return rows + _phase_rows("first natural frequency", "Hz", curves[0], curves[1])


def _itf_rows(one: Results, two: Results) -> list[Row]:
    if one.frf is None or two.frf is None:
        return []
    frequencies = one.frf["frequency"].values, two.frf["frequency"].values
    low, high = max(f.min() for f in frequencies), min(f.max() for f in frequencies)
    edges = np.linspace(low, high, BANDS + 1)
    rows = []
    for start, stop in pairwise(edges):
        sizes = [_rms_in(frf, start, stop) for frf in (one.frf, two.frf)]
        rows.append(Row("ITF, rms over phase and band", f"{start:.4g}-{stop:.4g} Hz", "nm/N", sizes[0], sizes[1]))
    return rows


def _rms_in(frf: xr.Dataset, start: float, stop: float) -> float:
    frequency = frf["frequency"].values
    inside = (frequency >= start) & (frequency <= stop)
    if not inside.any():
        return float("nan")
    power = frf["itf_re"].values[inside] ** 2 + frf["itf_im"].values[inside] ** 2
    return 1e9 * float(np.sqrt(power.mean()))


def _phase_rows(quantity: str, unit: str, first: Array, second: Array) -> list[Row]:
    return [
        Row(quantity, f"{i / first.size:.5g} cycles", unit, float(a), float(b))
        for i, (a, b) in enumerate(zip(first, second, strict=True))
    ]


def _dte(result: Results, count: int) -> Array | None:
    if result.record is None:
        return None
    phase, values = synchronous_mean(result.record, points=256)
    return on_phases(phase, values, count, result.shift)


def _natural(result: Results, count: int) -> Array | None:
    if result.frf is None or not result.frf.sizes.get("mode", 0):
        return None
    values = result.frf["natural_frequency"].values[0]
    return on_phases(result.frf["phase"].values, values, count, result.shift)
