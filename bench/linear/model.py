"""The linear lumped model: three degrees of freedom, a mesh stiffness that depends on the phase alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import ProgressReport, Schedule
from gearbench.bench.protocol import Model, Note, Prepared
from gearbench.bench.record.static import Loads
from gearbench.rig import Case

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]


class Linear(Model):
    """What the lumped model is for a rig without effects and with k(phase)."""

    name = "lumped"
    title = "lumped model"
    elastic = False

    def refuse(self, case: Case) -> None:
        """Nothing: only such rigs run on it as it represents."""

    def prepare(self, case: Case, plan: Schedule, note: Note) -> Prepared[Array]:
        from gearbench.bench.linear.run import prepare

        return prepare(case, plan)

    def static(self, case: Case, loads: Loads, phase: Array, report: ProgressReport) -> xr.Dataset:
        from gearbench.bench.linear.static import static_linear

        return static_linear(case, loads, phase)
