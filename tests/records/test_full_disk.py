"""A disk that is full at any moment of writing a record: one sentence, nothing left, and the process lives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

# The largest size of a file takes the part of the disk: beyond it every write fails, as on a full one.
PROGRAM = """
import resource, signal, sys
from pathlib import Path
import numpy as np
import xarray as xr
from gearbench.files import FileError
from gearbench.records import write_dataset

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
folder = Path(sys.argv[1])
values = np.arange(2000.0).reshape(2, 1000)
data = xr.Dataset({"a": (("row", "time"), values), "b": (("row", "time"), 2 * values)}, attrs={"text": "x" * 3000})
write_dataset(data, folder / "whole.nc")
size = (folder / "whole.nc").stat().st_size
refused = 0
for limit in [*range(0, 4096, 256), *range(4096, size, 4096), size - 1]:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        write_dataset(data, folder / "part.nc")
    except FileError as error:
        refused += "part.nc cannot be written: File too large" in str(error)
    else:
        raise SystemExit(f"written with room for {limit} bytes of {size}")
resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
write_dataset(data, folder / "part.nc")
assert xr.load_dataset(folder / "part.nc", engine="h5netcdf", decode_cf=False).identical(data)
print(refused)
"""


def test_every_moment_of_writing(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-P", "-c", PROGRAM, str(tmp_path)], capture_output=True, text=True, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) > 20
    assert sorted(path.name for path in tmp_path.iterdir()) == ["part.nc", "whole.nc"]
