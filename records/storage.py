"""Records on disk: NetCDF-4 through h5netcdf, so that MATLAB's `ncread` and h5py open them too."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import xarray as xr

from gearbench.records.errors import RecordError
from gearbench.records.record import validate_record


def write_atomically(path: str | Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it: readers see the old or the new."""
    target = Path(path)
    if not target.parent.is_dir():
        raise RecordError(f"cannot write {target}: folder {target.parent} does not exist")
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".tmp", dir=target.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
        # mkstemp makes private files; give the result the permissions that a plain open() would.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


def write_record(record: xr.Dataset, path: str | Path) -> None:
    """Validate the record and write it as NetCDF-4, uncompressed; `path` is replaced in one step.

    Raises RecordError for a bad record or a missing folder.

    >>> import gearbench as gb
    >>> gb.write_record(gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"])), "record.nc")
    """
    validate_record(record)
    encoding = {str(name): {"_FillValue": None} for name in record.variables}
    write_atomically(
        path, lambda temporary: record.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)
    )


def read_record(path: str | Path) -> xr.Dataset:
    """Read a record into memory and validate it. Raises RecordError for a missing, broken or unfit file.

    >>> import gearbench as gb
    >>> gb.write_record(gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"])), "record.nc")
    >>> gb.read_record("record.nc").attrs["schema"]
    'gearbench-record/1'
    """
    source = Path(path)
    if not source.is_file():
        raise RecordError(f"record {source} does not exist")
    try:
        # Units such as "s" must stay text: no decoding of times, masks or scales.
        record = xr.load_dataset(source, engine="h5netcdf", decode_cf=False)
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise RecordError(f"{source} is truncated or no NetCDF-4 file ({error})") from error
    if "time" in record.data_vars:
        record = record.set_coords("time")
    try:
        validate_record(record)
    except RecordError as error:
        raise RecordError(f"{source}: {error}") from None
    return record
