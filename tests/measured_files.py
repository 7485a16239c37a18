"""Files as other programs write them, for the tests of importers and of `convert`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyuff

OCTAVE = Path(__file__).resolve().parent / "records" / "formats" / "files"


def dataset_58(name: str, values: np.ndarray, unit: str, rate: float = 1000.0, **other: Any) -> dict[str, Any]:
    """What pyuff writes as a dataset 58."""
    made = {
        "type": 58,
        "binary": 1,
        "id1": name,
        "func_type": 1,
        "rsp_node": 1,
        "rsp_dir": 1,
        "ref_node": 0,
        "ref_dir": 0,
        "data": values,
        "x": np.arange(values.size) / rate,
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 17,
        "ordinate_axis_units_lab": unit,
        "orddenom_spec_data_type": 0,
    }
    return made | other


def write_uff(path: Path, *sets: dict[str, Any]) -> None:
    """Datasets in a new file; added one by one, because pyuff's overwriting loses heads of binary ones."""
    pyuff.UFF(str(path)).write_sets(list(sets), mode="add")


def write_matlab73(path: Path, **arrays: np.ndarray) -> None:
    """The layout of `save -v7.3`: a user block, transposed arrays, classes as attributes, cells by reference."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in arrays.items():
            item = file.create_dataset(name.replace(".", "/"), data=np.atleast_2d(values).T)
            item.attrs["MATLAB_class"] = np.bytes_("double")
        file.create_group("#refs#").create_dataset("a", data=np.arange(500.0))
        cell = file.create_dataset("labels", (2, 1), dtype=h5py.ref_dtype)
        cell[0, 0] = file["#refs#/a"].ref
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        word = file.create_dataset("rig", data=np.array([[ord(c)] for c in "test"], dtype=np.uint16))
        word.attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
