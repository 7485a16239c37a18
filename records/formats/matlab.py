"""MAT-files up to version 7 (MATLAB, Octave): numeric arrays, also inside of structs, are columns."""

from __future__ import annotations

import subprocess
import sys
import warnings
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.files import digest_of
from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Column, Source, first_line, make_column

_DEEPEST = 5


def read_mat(path: Path) -> Source:
    """Arrays of a MAT-file; fields of a struct are named `struct.field`. Single numbers and texts are facts; cells,
    objects, tables and sparse matrices are no columns. Raises RecordError."""
    from scipy.io import loadmat

    _try_apart(path, digest_of(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of objects, which are said to be skipped
            variables = loadmat(path, appendmat=False)
    except Exception as reason:  # damaged files end in errors of many kinds
        raise RecordError(f"{path} is truncated or no MAT-file ({first_line(reason)})") from reason
    columns: list[Column] = []
    facts: dict[str, float | str] = {}
    skipped: dict[str, str] = {}
    for name, value in variables.items():
        if not name.startswith("__"):
            _take(name, value, (columns, facts, skipped), 0)
    if "__function_workspace__" in variables and not columns:
        skipped["objects"] = "are MATLAB objects"
    return Source(path, "MAT", tuple(columns), facts, skipped)


@lru_cache
def _try_apart(path: Path, _content: str) -> None:
    """Read the file in a process of its own first: SciPy's reader crashes on some damaged files instead of failing.

    Starting one takes longer than reading, and a file is often read twice (for a guess, then for good): one that still
    has the content (a digest) with which it passed is not tried again.
    """
    code = "import sys; from scipy.io import loadmat; loadmat(sys.argv[1], appendmat=False)"
    done = subprocess.run([sys.executable, "-P", "-W", "ignore", "-c", code, str(path)], capture_output=True)
    if done.returncode < 0:
        raise RecordError(f"{path} is truncated or no MAT-file (its reader crashes on it)")


def _take(name: str, value: Any, into: tuple[list[Column], dict[str, float | str], dict[str, str]], deep: int) -> None:
    columns, facts, skipped = into
    if type(value) is not np.ndarray:
        skipped[name] = f"is a {type(value).__name__}, not an array of numbers"
    elif value.size == 0:
        skipped[name] = "is empty"
    elif value.dtype.names is not None:
        if value.size > 1:
            skipped[name] = f"is an array of {value.size} structs: save each as a variable"
        elif deep >= _DEEPEST:
            skipped[name] = f"is nested deeper than {_DEEPEST} structs"
        else:
            for key in value.dtype.names:
                _take(f"{name}.{key}", value.flat[0][key], into, deep + 1)
    elif value.dtype.kind == "U":
        facts[name] = str(value.flat[0])
    elif value.dtype.kind == "O":
        skipped[name] = "is a cell array: save its parts as numeric arrays"
    elif value.size == 1 and value.dtype.kind in "fiub":
        facts[name] = float(value.flat[0])
    else:
        try:
            columns.append(make_column(name, value))
        except RecordError as reason:
            skipped[name] = str(reason)
