"""The non-linear lumped model: about five degrees of freedom, and every effect of the rig that it knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import ProgressReport, Schedule
from gearbench.bench.protocol import Model, Note
from gearbench.bench.record.static import Loads
from gearbench.bench.refusals.effects import refuse_unknown
from gearbench.rig import Case

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.nonlinear.run import Setup

Array = NDArray[np.float64]


class NonLinear(Model):
    """What the lumped model is for a rig with effects, or with a mesh law from finite elements."""

    name = "lumped"
    title = "lumped model"
    elastic = False

    def refuse(self, case: Case) -> None:
        refuse_unknown(case.rig)
        if case.simulation.mesh_stiffness == "finite-element":
            from gearbench.bench.refusals.load_range import check_mean_torque

            check_mean_torque(case)

    def prepare(self, case: Case, plan: Schedule, note: Note) -> Setup:
        from gearbench.bench.nonlinear.run import make_setup

        note("mesh law")
        return make_setup(case, plan)

    def static(self, case: Case, loads: Loads, phase: Array, report: ProgressReport) -> xr.Dataset:
        from gearbench.bench.nonlinear.static import static_nonlinear

        return static_nonlinear(case, loads, phase)
