"""From the search's rigs to the best that the lumped model can do under each hypothesis, by simulation.

The search weighs forces, with smooth errors of every row left free; what is simulated has no such freedom. So before
gaps are told, the uncertain numbers of the rig are moved once more, to where the simulation comes closest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.replay.adjustable import Adjustable, at_path, uncertain
from gearbench.diagnosis.replay.recalibrate import recalibrate
from gearbench.rig import Case

Simulate = Callable[[Case, xr.Dataset], xr.Dataset]

EXCESS_SD = 5e-6  # of the excess material of all pairs, which shifts the zero of the transmission error [m]
LOSING = 0.05  # part of a row without contact from which a record is too rough to follow downhill
ITERATIONS = 5


def refined(
    nominal: Case,
    add: Callable[[Case], Case] | None,
    measurements: Sequence[Measurement],
    simulate: Simulate,
) -> tuple[Case, Case | None]:
    """The nominal case recalibrated, and recalibrated with the effect that `add` puts into a case (None: no effect).

    Records whose flanks often separate are left out, unless all do: small changes make jumps there. Raises what the
    simulation of the nominal case raises.
    """
    parameters = (*uncertain(nominal), at_path("rig.mesh.error_mean", EXCESS_SD))
    chosen = [one for one in measurements if _apart(nominal, one, simulate) < LOSING] or list(measurements)
    plain = recalibrate(nominal, parameters, chosen, simulate, iterations=ITERATIONS).case
    if add is None:
        return plain, None
    held = tuple(_about(parameter, nominal) for parameter in parameters)
    return plain, recalibrate(add(plain), held, chosen, simulate, iterations=ITERATIONS).case


def _about(parameter: Adjustable, nominal: Case) -> Adjustable:
    """The parameter with its prior around the nominal value, whatever the case that it starts from."""
    return replace(parameter, mean=parameter.get(nominal))


def _apart(case: Case, measured: Measurement, simulate: Simulate) -> float:
    """Part of the replayed row in which no flanks touch."""
    row = simulate(case, measured.record)
    return float(row.attrs.get("contact_lost_samples", 0)) / max(int(np.prod(row["time"].shape)), 1)
