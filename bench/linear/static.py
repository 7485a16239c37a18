"""Static response of the lumped pair: deflection F / k(phase)."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.record.static import Loads, static_dataset
from gearbench.geometry import pair
from gearbench.lumped import lumped_model
from gearbench.rig import Case

Array = NDArray[np.float64]


def static_linear(case: Case, loads: Loads, phase: Array) -> xr.Dataset:
    """Static response by the law k(phase), which depends on no load, so that secant and tangent agree."""
    meshing = pair(case.rig)
    model = lumped_model(case.rig, meshing, case.simulation)
    unit, values = loads
    radius = meshing.driver.base_radius
    k = np.broadcast_to(model.stiffness.at(phase), (len(values), len(phase)))
    force = values[:, None] / radius if unit == "N m" else values[:, None] * k
    force = np.broadcast_to(force, k.shape)
    return static_dataset(
        loads,
        phase,
        transmission_error=force / k,
        torque=force * radius,
        secant=np.array(k),
        tangent=np.array(k),
        attributes={"model": "lumped", "base_radius_driver": radius},
    )
