"""Static response of the elastic pair by finite elements, hub centres held."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.reduced_rig import elastic_rig
from gearbench.bench.schedule import ProgressReport
from gearbench.bench.static import Loads, static_dataset
from gearbench.fem.static import static_cycle
from gearbench.rig import Case

Array = NDArray[np.float64]


def static_reduced(
    case: Case, loads: Loads, phase: Array, progress: ProgressReport | None = None
) -> xr.Dataset:
    """Static cycle with tip-edge contact, backlash and load sharing.

    Raises GeometryError, and ContactError where contact leaves the modelled flanks.
    """
    report = progress or (lambda fraction, note: None)
    elastic = elastic_rig(case.rig, case.simulation, lambda note: report(0.0, note))
    unit, values = loads
    by_kind = {"torque": values} if unit == "N m" else {"dte": values}
    cycle = static_cycle(
        elastic.law, phase, **by_kind, progress=lambda done: report(done, "static equilibrium")
    )
    return static_dataset(
        loads,
        phase,
        transmission_error=cycle.transmission_error,
        torque=cycle.torque_driver,
        secant=cycle.stiffness_secant,
        tangent=cycle.stiffness_tangent,
        share=cycle.load_share,
        attributes={
            "model": "reduced",
            "base_radius_driver": elastic.pair.driver.base_radius,
            "stress_state": case.rig.material.state,
            "unknowns_driver": elastic.gears[0].unknowns,
            "unknowns_driven": elastic.gears[1].unknowns,
        },
    )
