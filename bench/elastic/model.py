"""The reduced finite-element model: condensed gears, contact along the real flanks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import ProgressReport, Schedule
from gearbench.bench.protocol import Model, Note
from gearbench.bench.record.static import Loads
from gearbench.bench.refusals.effects import ELASTIC_KEYS, MOVING_KEYS, refuse_effects
from gearbench.geometry.mesh.sector import refuse_crack
from gearbench.rig import Case

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.elastic.run import Elastic

Array = NDArray[np.float64]


class Reduced(Model):
    """Each gear condensed once to its hub, some modes and the residual flexibility of its flanks."""

    name = "reduced"
    title = "reduced finite-element model"
    elastic = True

    def refuse(self, case: Case) -> None:
        from gearbench.bench.refusals.load_range import check_mean_torque

        for name, gear in (("rig.driver", case.rig.driver), ("rig.driven", case.rig.driven)):
            refuse_crack(gear, case.simulation.element, name, "simulation.element")
        refuse_effects(case.rig, self.title, represented=ELASTIC_KEYS.union(MOVING_KEYS))
        check_mean_torque(case)

    def prepare(self, case: Case, plan: Schedule, note: Note) -> Elastic:
        from gearbench.bench.elastic.run import prepare

        return prepare(case, plan, note)

    def static(self, case: Case, loads: Loads, phase: Array, report: ProgressReport) -> xr.Dataset:
        from gearbench.bench.elastic.static import static_reduced

        return static_reduced(case, loads, phase, report)
