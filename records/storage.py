"""Datasets on disk: NetCDF-4 through h5netcdf, so that MATLAB's `ncread` and h5py open them too."""

from __future__ import annotations

import gc
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import xarray as xr

from gearbench.files import DeferredFile, write_whole
from gearbench.records.errors import RecordError
from gearbench.records.record import validate_record


def write_dataset(dataset: xr.Dataset, path: str | Path) -> None:
    """Write as NetCDF-4, uncompressed; `path` is replaced in one step. Raises FileError."""
    encoding = {str(name): {"_FillValue": None} for name in dataset.variables}

    def write(temporary: Path) -> None:
        with DeferredFile(temporary) as file:
            try:
                dataset.to_netcdf(file, engine="h5netcdf", encoding=encoding)
            except Exception:
                file.check()
                raise
        file.check()

    write_whole(path, write)


def read_dataset(path: str | Path, what: str = "file", error: type[ValueError] = RecordError) -> xr.Dataset:
    """Read into memory. Raises `error` for a missing or broken file; `what` it should be stands in the sentence."""
    source = Path(path)
    if not source.is_file():
        raise error(f"{what} {source} {'is not a plain file' if source.exists() else 'does not exist'}")
    try:
        # Units such as "s" must stay text: no decoding of times, masks or scales.
        return xr.load_dataset(source, engine="h5netcdf", decode_cf=False)
    except Exception as reason:  # damaged metadata raises whatever its reader trips over
        words = " ".join(str(reason).split()) or type(reason).__name__
        _forget(reason)
    raise error(f"{source} is truncated or no NetCDF-4 file ({words[:200]})")


def _forget(reason: BaseException) -> None:
    """Let go of a file that could not be opened. Half made, it would print a traceback when it is collected later."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda unraisable: None
    try:
        link: BaseException | None = reason
        while link is not None:
            traceback.clear_frames(link.__traceback__)
            link = link.__cause__ or link.__context__
        gc.collect()
    finally:
        sys.unraisablehook = hook


def write_record(record: xr.Dataset, path: str | Path) -> None:
    """Validate the record and write it as `write_dataset` does. Raises RecordError for a bad record, and FileError.

    >>> import gearbench as gb
    >>> gb.write_record(gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"])), "record.nc")
    """
    validate_record(record)
    write_dataset(record, path)


def read_record(path: str | Path) -> xr.Dataset:
    """Read a record into memory and validate it. Raises RecordError for a missing, broken or unfit file.

    >>> import gearbench as gb
    >>> gb.write_record(gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"])), "record.nc")
    >>> gb.read_record("record.nc").attrs["schema"]
    'gearbench-record/1'
    """
    record = read_dataset(path, "record")
    if "time" in record.data_vars:
        record = record.set_coords("time")
    try:
        validate_record(record)
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None
    return record


@contextmanager
def opened_record(path: str | Path) -> Iterator[xr.Dataset]:
    """A record of ours that stays on disk: what is asked of it is read then. Raises RecordError for a missing file."""
    source = Path(path)
    if not source.is_file():
        raise RecordError(f"record {source} does not exist")
    with xr.open_dataset(source, engine="h5netcdf", decode_cf=False, cache=False) as record:
        yield record
