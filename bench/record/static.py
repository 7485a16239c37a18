"""Results of the static response as a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

SCHEMA = "gearbench-static/1"

Loads = tuple[str, Array]  # "N m" (driver torque) or "m" (dte), and values


def load_key(unit: str) -> tuple[str, float]:
    """What a user calls a load, and the factor from SI to that unit."""
    return ("dte_um", 1e6) if unit == "m" else ("torque_nm", 1.0)


def static_dataset(
    loads: Loads,
    phase: Array,
    *,
    transmission_error: Array,
    torque: Array,
    secant: Array,
    tangent: Array,
    attributes: dict[str, object],
    share: Array | None = None,
    unloaded: Array | None = None,
) -> xr.Dataset:
    """The results as a dataset that `static.nc` holds; arrays (load, phase), `share` (load, phase, pair), `unloaded`
    (phase,): the transmission error without load."""
    unit, values = loads
    fields = {
        "transmission_error": (transmission_error, "m"),
        "torque": (torque, "N m"),
        "stiffness_secant": (secant, "N/m"),
        "stiffness_tangent": (tangent, "N/m"),
    }
    variables: dict[str, tuple[tuple[str, ...], Array, dict[str, str]]] = {
        name: (("load", "phase"), data, {"units": units}) for name, (data, units) in fields.items()
    }
    coordinates = {"load": ("load", values, {"units": unit}), "phase": ("phase", phase, {"units": "cycles"})}
    if share is not None:
        variables["load_share"] = (("load", "phase", "pair"), share, {"units": "1"})
    if unloaded is not None:
        variables["transmission_error_unloaded"] = (("phase",), unloaded, {"units": "m"})
    import xarray as xr  # on use: a model is known by less

    return xr.Dataset(variables, coords=coordinates, attrs={"schema": SCHEMA, **attributes})
