"""HDF5 and NetCDF-4, and the HDF5 that MATLAB writes with -v7.3: arrays anywhere in the tree are columns."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Column, Source, first_line, make_column

if TYPE_CHECKING:
    import h5py

_UNIT_NAMES = ("units", "unit", "Unit", "Units", "UNIT")
_RATE_NAMES = ("sampling_rate", "sample_rate", "fs")
_MISSING_NAMES = ("_FillValue", "missing_value")
# How the CF conventions pack numbers: what stands for an attribute that is not there, and what it must be besides.
_PACKING = {"scale_factor": (1.0, ", not 0"), "add_offset": (0.0, "")}


def read_hdf(path: Path) -> Source:
    """Arrays of an HDF5 or NetCDF-4 file, named by their path with dots; attributes of the root and single values
    are facts. Texts, references and compound types are no columns and are never decoded. Raises RecordError."""
    import h5py

    columns: list[Column] = []
    facts: dict[str, float | str] = {}
    skipped: dict[str, str] = {}

    def visit(name: str, item: Any) -> None:
        if name.startswith("#"):  # where MATLAB keeps what its cells point to
            return
        if (isinstance(item, h5py.Dataset) and item.attrs.get("CLASS") != b"DIMENSION_SCALE") or _is_signal(item):
            _take(name.replace("/", "."), item, columns, facts, skipped)

    try:
        with h5py.File(path, "r") as file:
            facts.update(_attributes(file))
            file.visititems(visit)
            matlab = any("MATLAB_class" in item.attrs for item in file.values())
    except RecordError:
        raise
    except Exception as reason:  # damaged trees end in errors of many kinds
        raise RecordError(f"{path} is truncated or no HDF5 file ({first_line(reason)})") from reason
    return Source(path, "MAT 7.3" if matlab else "HDF5", tuple(columns), facts, skipped)


def _is_signal(item: Any) -> bool:
    """A scale with values of its own, as `time` is; NetCDF-4 stores sizes without a variable as scales too."""
    name = str(item.attrs.get("NAME", b""))
    return item.attrs.get("CLASS") == b"DIMENSION_SCALE" and "not a netCDF variable" not in name


def _take(
    name: str, item: h5py.Dataset, columns: list[Column], facts: dict[str, float | str], skipped: dict[str, str]
) -> None:
    kind = _text(item.attrs.get("MATLAB_class", b""))
    if item.attrs.get("MATLAB_empty", 0):
        skipped[name] = "is empty"
    elif kind == "char":
        facts[name] = "".join(map(chr, np.ravel(item[()]).astype(int)))
    elif kind in ("cell", "struct", "table", "string") or item.dtype.kind not in "fiub":
        skipped[name] = f"is of type {kind or item.dtype}, not an array of real numbers"
    elif item.size == 0:
        skipped[name] = "is empty"
    else:
        _take_numbers(name, item, columns, facts, skipped)


def _take_numbers(
    name: str, item: h5py.Dataset, columns: list[Column], facts: dict[str, float | str], skipped: dict[str, str]
) -> None:
    try:
        values = _unpacked(item)
        if values.size > 1:
            rate = next((float(item.attrs[key]) for key in _RATE_NAMES if _is_number(item.attrs.get(key))), None)
            unit = next((_text(item.attrs[key]) for key in _UNIT_NAMES if key in item.attrs), None)
            columns.append(make_column(name, values, unit=unit or None, rate=rate))
        elif np.isnan(values).all():
            skipped[name] = "is missing"
        else:
            facts[name] = float(np.ravel(values)[0])
    except RecordError as reason:
        skipped[name] = str(reason)


def _unpacked(item: h5py.Dataset) -> NDArray:
    """Values as the CF conventions pack them: scale_factor x stored + add_offset, NaN where the stored one stands for
    a missing value. Raises RecordError for a scale or an offset that is no finite number."""
    stored = item[()]
    absent = np.zeros(np.shape(stored), dtype=bool)
    for key in _MISSING_NAMES:
        marks = np.ravel(item.attrs.get(key, ()))
        if marks.dtype.kind in "fiub":
            # A float is as exact as those stored; an integer must not wrap around.
            with np.errstate(over="ignore"):
                absent |= np.isin(stored, marks.astype(stored.dtype) if stored.dtype.kind == "f" else marks)
    scale, offset = (_packing(item, key) for key in _PACKING)
    if not absent.any() and (scale, offset) == (1.0, 0.0):
        return np.asarray(stored)
    return np.where(absent, np.nan, scale * np.asarray(stored, dtype=np.float64) + offset)


def _packing(item: h5py.Dataset, key: str) -> float:
    absent, limit = _PACKING[key]
    value = item.attrs.get(key, absent)
    number = float(np.ravel(value)[0]) if _is_number(value) else np.nan
    if not np.isfinite(number) or (key == "scale_factor" and number == 0.0):
        raise RecordError(f"has {key} = {_text(value)}, which must be one finite number{limit}")
    return number


def _attributes(file: h5py.File) -> dict[str, float | str]:
    found: dict[str, float | str] = {}
    for key, value in file.attrs.items():
        if isinstance(value, str | bytes):
            found[key] = _text(value)
        elif _is_number(value):
            found[key] = float(np.ravel(value)[0])
    return found


def _is_number(value: object) -> bool:
    return value is not None and np.size(value) == 1 and np.asarray(value).dtype.kind in "fiu"  # type: ignore[arg-type]


def _text(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
