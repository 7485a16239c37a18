"""The background alone: nuisances and structure of the rig where they come closest to the records without an effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.fitting.beginning import beginning, nearest
from gearbench.diagnosis.fitting.closeness import better, is_close
from gearbench.diagnosis.fitting.fit import Optimum, fit, fit_afresh
from gearbench.diagnosis.fitting.moved_motions import with_motions_moved
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Report = Callable[[str], None]

# Of the Jacobian, and of the fit from another beginning until it is seen whether it comes closer.
RENEWALS, RENEWALS_FIRST = 8, 2


def background(
    simulator: Simulator,
    beginnings: Sequence[Array],
    shown: Shown | None = None,
    report: Report = lambda step: None,
) -> Optimum | None:
    """The optimum without any effect, from the best of these `beginnings` (size,), the first of which is the nominal
    rig; `shown`: what the records show without simulation. None where no beginning is a rig."""
    sd = prior_of(simulator, simulator.layout.unknowns.prior())
    report("simulating: background")
    nominal, begin = beginnings[0], nearest(simulator, beginnings, sd)
    base = fit_afresh(simulator, beginning(simulator, begin, shown, sd), sd, renewals=RENEWALS)
    # What the force residuals make of a rig beside a large effect can lead astray: then from the nominal one.
    if base is not None and begin is not nominal and not is_close(simulator, base):
        other = beginning(simulator, nominal, shown, sd)
        base = _raced(simulator, base, fit_afresh(simulator, other, sd, renewals=RENEWALS_FIRST))
    return with_motions_moved(simulator, base, report) if base is not None else None


def _raced(simulator: Simulator, base: Optimum, other: Optimum | None) -> Optimum:
    """The better of an optimum and of another that may still be on its way: gone on with where it can catch up."""
    if other is None or other.cost - other.left > base.cost:
        return base
    more = fit(simulator, other.p, other.sd, other.sensitivity, renewals=RENEWALS - RENEWALS_FIRST)
    return better(base, more or other)


def prior_of(simulator: Simulator, sd: Array) -> Array:
    """The prior `sd` (size,) with what no rig of the background has held at zero: cracked teeth."""
    out = sd.copy()
    unknowns = simulator.layout.unknowns
    out[unknowns[CRACK]] = 0.0
    return out
