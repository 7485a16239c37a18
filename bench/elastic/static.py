"""Static response of the elastic pair by finite elements, hub centres held."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.elastic.wedging import wedging
from gearbench.bench.plan.schedule import ProgressReport, cycles_to_repeat
from gearbench.bench.record.static import Loads, load_key, static_dataset
from gearbench.bench.refusals.effects import ELASTIC_KEYS, refuse_effects
from gearbench.bench.refusals.load_range import check_dte, check_torque
from gearbench.fem.contact.law import elastic_pair
from gearbench.fem.contact.static import static_cycle
from gearbench.rig import Case

Array = NDArray[np.float64]


def static_reduced(case: Case, loads: Loads, phase: Array, report: ProgressReport) -> xr.Dataset:
    """Static cycle with tip-edge contact, backlash and load sharing.

    Raises GeometryError, and ContactError where contact leaves the modelled flanks.
    """
    tables = ("rig.driver", "rig.driven", "rig.mesh")
    refuse_effects(case.rig, "static finite-element solution", tables, ELASTIC_KEYS)
    unit, values = loads
    check = check_dte if unit == "m" else check_torque
    check(elastic_pair(case.rig), float(values.max()), load_key(unit)[0])
    elastic = elastic_rig(case.rig, case.simulation, lambda note: report(0.0, note))
    cycle = static_cycle(
        elastic.law,
        phase,
        torque=values.tolist() if unit == "N m" else None,
        dte=values.tolist() if unit == "m" else None,
        progress=lambda done: report(done, "static equilibrium"),
    )
    wedged = wedging(elastic.law, cycle, elastic.pair.backlash_normal)
    return static_dataset(
        loads,
        phase,
        transmission_error=cycle.transmission_error,
        torque=cycle.torque_driver,
        secant=cycle.stiffness_secant,
        tangent=cycle.stiffness_tangent,
        share=cycle.load_share,
        unloaded=cycle.unloaded,
        attributes={
            "model": "reduced",
            "base_radius_driver": elastic.pair.driver.base_radius,
            "stress_state": case.rig.material.state,
            **({"warnings": wedged} if wedged else {}),
            "repeats_after_mesh_cycles": cycles_to_repeat(case.rig),
            "unknowns_driver": elastic.gears[0].unknowns,
            "unknowns_driven": elastic.gears[1].unknowns,
        },
    )
