"""The structure of a rig begun again where a fit was led astray: beside resonances that are not where they are in the
rig every way is uphill."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.beginning import levelled, seen_by
from gearbench.diagnosis.fitting.fit import Optimum, cost_of, fit, fit_afresh, gone_on
from gearbench.diagnosis.fitting.hidden_housing import on_a_housing
from gearbench.diagnosis.fitting.rotation import but_rotation, with_rotation
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.structure import SEAT, otherwise

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Report = Callable[[str], None]

RENEWALS = 3
# Nats an independent line that are left, in the median block, below which no other structure is tried.
CLOSE = 0.2
# The same of a block that answers the excitation, above which it is nearly all unexplained.
FAR = 5.0
# Part of any channel's fluctuation that is left, above which another is tried, too: where few lines carry it, nats do
# not say so. Of the rigs that were found right few leave as much.
OPEN = 0.05
# Part of what one rig leaves of the excited lines above which another leaves nearly as much.
ALIKE = 0.75
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


def better(found: Optimum, other: Optimum | None) -> Optimum:
    """The one of more evidence."""
    return other if other is not None and other.evidence > found.evidence else found


def is_close(simulator: Simulator, found: Optimum) -> bool:
    """Whether the median block is left with little beside its noise, no block that answers the excitation with much,
    and no channel with a part of its fluctuation that counts: a structure that is not there shows in the transmission
    error before it shows anywhere else."""
    left, target = _left(simulator, found), simulator.target
    parts, _ = target.shares(target.lines - found.lines)
    return bool(np.median(left) < CLOSE and parts.max() < OPEN and not (target.excited & (left > FAR)).any())


def answers_alike(simulator: Simulator, before: Optimum, after: Optimum) -> bool:
    """Whether the lines that show structure are left with nearly as much by both rigs: what was not found beside the
    one is not found beside the other."""
    counts = simulator.target.excited_counts
    one, other = (float((counts * _left(simulator, found)).sum()) for found in (before, after))
    return other > ALIKE * one


def _left(simulator: Simulator, found: Optimum) -> Array:
    """Nats an independent line (blocks,) that the optimum leaves beside the noise."""
    target = simulator.target
    return np.asarray(target.nats(target.energies(target.lines - found.lines)) - target.nats(target.noise))


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
    return with_rotation(simulator, found, best) if best else None


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
