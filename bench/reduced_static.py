"""Static response of the elastic pair by finite elements, hub centres held."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.effects import ELASTIC_KEYS, cycles_to_repeat, refuse_effects
from gearbench.bench.errors import BenchError
from gearbench.bench.reduced_rig import ElasticRig, elastic_rig
from gearbench.bench.schedule import ProgressReport
from gearbench.bench.static import Loads, static_dataset
from gearbench.fem.law import EDGE_SEPARATION, LOAD_RANGE
from gearbench.fem.static import static_cycle
from gearbench.rig import Case

Array = NDArray[np.float64]


def _check_range(elastic: ElasticRig, unit: str, values: Array) -> None:
    """Refuse loads beyond the range for which contact lines have been solved."""
    if unit == "N m":
        width = min(gear.face_width for gear in elastic.gears)
        most, key = LOAD_RANGE[1] * width * elastic.pair.driver.base_radius, "torque"
    else:
        most, key = EDGE_SEPARATION * elastic.pair.driver.module, "transmission error"
    if values.max() > most:
        raise BenchError(
            f"static {key} = {values.max():g} {unit} is more than the modelled flanks can carry: at most"
            f" {most:.4g} {unit} for this pair"
        )


def static_reduced(case: Case, loads: Loads, phase: Array, progress: ProgressReport | None = None) -> xr.Dataset:
    """Static cycle with tip-edge contact, backlash and load sharing.

    Raises GeometryError, and ContactError where contact leaves the modelled flanks.
    """
    report = progress or (lambda fraction, note: None)
    tables = ("rig.driver", "rig.driven", "rig.mesh")
    refuse_effects(case.rig, "static finite-element solution", tables, ELASTIC_KEYS)
    elastic = elastic_rig(case.rig, case.simulation, lambda note: report(0.0, note))
    unit, values = loads
    _check_range(elastic, unit, values)
    cycle = static_cycle(
        elastic.law,
        phase,
        torque=values.tolist() if unit == "N m" else None,
        dte=values.tolist() if unit == "m" else None,
        progress=lambda done: report(done, "static equilibrium"),
    )
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
            "repeats_after_mesh_cycles": cycles_to_repeat(case.rig),
            "unknowns_driver": elastic.gears[0].unknowns,
            "unknowns_driven": elastic.gears[1].unknowns,
        },
    )
