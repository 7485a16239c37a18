"""The unreduced finite-element model: every unknown of both gears, contact along the real flanks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import ProgressReport, Schedule
from gearbench.bench.protocol import Model, Note
from gearbench.bench.record.static import Loads
from gearbench.bench.refusals.effects import FLANK_KEYS, refuse_effects
from gearbench.rig import Case

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.full.run import Full

Array = NDArray[np.float64]


class Unreduced(Model):
    """Both gears integrated with all their unknowns: the reference for the reduced model."""

    name = "full"
    title = "full finite-element model"
    elastic = True

    def refuse(self, case: Case) -> None:
        from gearbench.bench.refusals.load_range import check_mean_torque

        if case.simulation.contact == "penalty":
            refuse_effects(case.rig, f'{self.title} with simulation.contact = "penalty"')
        refuse_effects(case.rig, self.title, represented=FLANK_KEYS)
        check_mean_torque(case)

    def prepare(self, case: Case, plan: Schedule, note: Note) -> Full:
        from gearbench.bench.full.run import prepare

        return prepare(case, plan, note)

    def static(self, case: Case, loads: Loads, phase: Array, report: ProgressReport) -> xr.Dataset:
        """That of the reduced model: at rest both obey the same contact law, whatever their meshes. It stands beside
        a simulation with contact = "penalty" too, whose own surfaces it does not know."""
        from gearbench.bench.elastic.static import static_reduced

        return static_reduced(case, loads, phase, report)
