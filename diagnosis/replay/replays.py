"""Replays of records that share one mesh force law: it is loaded once, and only its backlash follows the rig."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import xarray as xr

from gearbench.diagnosis.forces.nominal import table_load
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.geometry import pair
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.rig import Case

LAWS = 8  # of different backlash whose secants are kept: most replays have the nominal one


def law_of(law: MeshLaw, case: Case) -> MeshLaw:
    """The law with the backlash of the case's rig."""
    return _with_backlash(law, max(pair(case.rig).backlash_normal, 0.0))


@lru_cache(maxsize=LAWS)
def _with_backlash(law: MeshLaw, backlash: float) -> MeshLaw:
    return replace(law, backlash=backlash)


def replays(law: MeshLaw) -> Callable[[Case, xr.Dataset], xr.Dataset]:
    """`simulate(case, record)`: one steady repetition of the case's rig under the record's torque, on the non-linear
    lumped model with this law. Rigs may differ in everything but what changes the teeth's shape."""

    def simulate(case: Case, record: xr.Dataset) -> xr.Dataset:
        # Its time loop is compiled on import, which not every user of this module wants.
        from gearbench.bench.nonlinear.replay import replay

        return replay(case, record, law_of(law, case))

    return simulate


def replays_of(nominal: Case, measurements: Sequence[Measurement]) -> Callable[[Case, xr.Dataset], xr.Dataset]:
    """The replays of these measurements on the nominal rig's law."""
    from gearbench.bench.nonlinear.law_table import mesh_law

    return replays(mesh_law(nominal.rig, nominal.simulation, table_load(measurements)))
