"""The plant as compiled code reads it fastest: its numbers in one record, and the tables of its teeth."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.challenge.truth.plant import Plant

Record = Any  # numpy.void: fields named as those of Plant, `teeth` with its numbers only
Records = NDArray[np.void]


class Mesh(NamedTuple):
    """Tables of the tooth pairs: stiffness, share_driver, share_driven and excess (n,) over the position of a pair;
    error and crack (z,) of each tooth of the driver, and of the driven gear."""

    table: Records
    driver: Records
    driven: Records


def pack(plant: Plant) -> tuple[Record, Mesh]:
    """Numbers of the plant and tables of its teeth."""
    teeth = plant.teeth
    table = {name: getattr(teeth, name) for name in ("stiffness", "share_driver", "share_driven", "excess")}
    numbers = {name: value for name, value in teeth._asdict().items() if not np.ndim(value)}
    return _record({**plant._asdict(), "teeth": numbers}), Mesh(
        _records(table),
        _records({"error": teeth.error_driver, "crack": teeth.crack_driver}),
        _records({"error": teeth.error_driven, "crack": teeth.crack_driven}),
    )


def _record(values: dict[str, Any]) -> Record:
    """Numbers, arrays and records of these as one record."""
    parts = {name: _part(value) for name, value in values.items()}
    record = np.zeros((), [(name, part.dtype, part.shape) for name, part in parts.items()])
    for name, part in parts.items():
        record[name] = part
    return record[()]


def _part(value: Any) -> NDArray[Any]:
    if hasattr(value, "_asdict"):
        value = value._asdict()
    return np.asarray(_record(value)) if isinstance(value, dict) else np.asarray(value, dtype=float)


def _records(columns: dict[str, NDArray[np.float64]]) -> Records:
    """Columns of equal length as one array of records."""
    out = np.zeros(len(next(iter(columns.values()))), [(name, float) for name in columns])
    for name, column in columns.items():
        out[name] = column
    return out
