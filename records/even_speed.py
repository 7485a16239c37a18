"""The mesh phase of a record, and how far it departs from constant speed."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Departure of the mesh phase from constant speed [cycles] from which on a record counts as of varying speed, and beyond
# which averages over excitation periods lose the branches.
VARIES, LOST = 0.05, 0.25


def mesh_phase(record: xr.Dataset) -> Array | None:
    """Mesh phase (E, N) [cycles]: the channel `mesh_phase`, else teeth times the driver's turns, else None."""
    if "mesh_phase" in record:
        return np.asarray(record["mesh_phase"].values, dtype=float)
    if "mesh_period" not in record.attrs and "angle_driver" in record and "teeth_driver" in record.attrs:
        return np.asarray(record["angle_driver"].values * float(record.attrs["teeth_driver"]) / (2 * np.pi))
    return None


def departure(phase: Array) -> float:
    """Largest departure [cycles] of mesh phases (N,) or (E, N) from those of constant speeds, by least squares."""
    rows = np.atleast_2d(phase)
    steps = np.arange(rows.shape[1])
    return max(float(np.abs(row - np.polyval(np.polyfit(steps, row, 1), steps)).max()) for row in rows)
