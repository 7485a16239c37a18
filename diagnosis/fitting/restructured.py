"""The structure of a rig begun again where a fit was led astray: beside resonances that are not where they are in the
rig every way is uphill."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.beginning import levelled, seen_by
from gearbench.diagnosis.fitting.closeness import better, is_close
from gearbench.diagnosis.fitting.fit import Optimum, cost_of, fit, fit_afresh, gone_on
from gearbench.diagnosis.fitting.hidden_housing import on_a_housing
from gearbench.diagnosis.fitting.moved_motions import with_motions_moved
from gearbench.diagnosis.fitting.rotation import but_rotation, with_rotation
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.structure import SEAT, otherwise

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Report = Callable[[str], None]

RENEWALS = 3
# Cost of the nominal rig over that of a fit up to which another fit is begun there: mesh, offsets and flanks trade
# along long valleys, and a rig without any of that can lie below their floors.
NEAR = 1.5


def restructured(simulator: Simulator, found: Optimum, shown: Shown | None, report: Report) -> Optimum:
    """The optimum begun again with a structure that its fit could not walk to, where that comes closer; a part of it
    may be `shown` without a simulation."""
    if not is_close(simulator, found):
        found = better(found, _from_around(simulator, found, shown, report))
    if not is_close(simulator, found):
        found = _on_a_housing(simulator, found, shown, report)
    if not is_close(simulator, found):
        found = better(found, _otherwise(simulator, found, report))
    return found


def begun_at_nominal(simulator: Simulator, found: Optimum, kept: Flags) -> Optimum:
    """The optimum, or the one of more evidence that is found from the nominal rig with only the unknowns `kept` (size,)
    as they are, where that is nearly as close to the records."""
    p = np.where(kept, found.p, 0.0)
    if cost_of(simulator, p, found.sd) > NEAR * found.cost:
        return found
    return better(found, fit(simulator, p, found.sd, found.sensitivity, renewals=1))


def _from_around(simulator: Simulator, found: Optimum, shown: Shown | None, report: Report) -> Optimum | None:
    """The fit begun with what the records show of the rig around its mesh, beside the effects that were widened."""
    unknowns = simulator.layout.unknowns
    widened = found.sd > unknowns.prior()
    # Effects stay; what was fitted around the wrong structure goes.
    held = np.where(widened | unknowns.of((SEAT,)), found.p, 0.0)
    seen = seen_by(shown, unknowns, held)
    if seen is None:
        return None
    report("simulating: the rig around its mesh")
    begin = levelled(simulator, seen, held, found.sd)
    chosen = but_rotation(unknowns, found.sd)
    best = fit_afresh(simulator, begin, found.sd, renewals=RENEWALS, chosen=chosen)
    whole = with_rotation(simulator, found, best) if best else None
    if whole is None or whole.evidence <= found.evidence:
        return whole
    return with_motions_moved(simulator, whole, report)


def _on_a_housing(simulator: Simulator, found: Optimum, shown: Shown | None, report: Report) -> Optimum:
    """The optimum, or with sensors on a housing whose first motion is the one that the forces show, or else the one
    that simulation does."""
    tell = partial(report, "simulating: sensors on a housing")
    hidden = shown.hidden() if shown is not None else None
    if hidden is not None:
        found = better(found, on_a_housing(simulator, found, hidden, tell))
        if is_close(simulator, found):
            return found
    return better(found, on_a_housing(simulator, found, tell=tell))


def _otherwise(simulator: Simulator, found: Optimum, report: Report) -> Optimum | None:
    """The fit begun with one part of the structure otherwise.

    Beginnings are chosen by their cost before any fit: beside the gap of a large effect they all cost the same.
    """
    p = otherwise(simulator.layout.unknowns, found.p)
    if p is None:
        return None
    report("simulating: another structure")
    again = fit_afresh(simulator, p, found.sd, renewals=RENEWALS)
    if again is None or again.evidence <= found.evidence:
        return again
    return gone_on(simulator, again, RENEWALS, partial(report, "simulating: another structure, further"))
