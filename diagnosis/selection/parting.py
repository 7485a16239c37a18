"""Records whose flanks part, beside those that a fit could follow.

Followed downhill on their own they lead astray: a small change makes jumps. Where the smooth records have led close to
them, with the driver nudged along its measured motion, they are taken in, and all is fitted and weighed again on all
records: how a mesh carries little load, and its backlash, shows there alone. Where they stay far, backlash alone is
tried, and believed where the force residuals have as much.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.opened import Opened, opened
from gearbench.diagnosis.selection.selection import Selection, carried_on
from gearbench.diagnosis.selection.weighing import WORTH, Weighed, entering
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import joined

Array = NDArray[np.float64]
Report = Callable[[str], None]

# Part of any channel's fluctuation up to which a nudged simulation may be off a record for it to be taken in, as the
# smooth records have led to it and after a fit; one that is not nudged needs no more where it is no further off.
NEAR, FOLLOWED, EXPLAINED = 0.15, 0.05, 0.05
# Part of the force residuals' backlash by which that of a simulation may differ where nothing else is followed, unless
# its own standard deviation is larger.
AGREES = 0.35


def with_parting(
    simulator: Simulator,
    alone: Simulator,
    selection: Selection,
    hypotheses: Sequence[Hypothesis],
    starts: Mapping[str, Start],
    report: Report = lambda step: None,
    *,
    wanted: bool,
    apart: bool = False,
) -> tuple[Simulator, Selection]:
    """The simulator and the selection with the records of `alone`, whose flanks part, taken in, where that is `wanted`
    and they can be followed, or with what they say of the backlash."""
    backlash = next((one for one in hypotheses if one.wide[0].key == BACKLASH), None)
    beside = not simulator.nudges and all(one.name in alone.nudges for one in alone.target.measurements)
    start = starts.get("backlash")
    forced = start is not None and start.log_bayes_factor > WORTH
    if backlash is None or not (beside or forced):
        return simulator, selection
    report("simulating: backlash")
    found = opened(alone, selection.best.p)
    if beside and wanted:
        taken = _taken_in(simulator, alone, selection, backlash, found, hypotheses, report, apart)
        if taken is not None:
            return taken
    with_it = with_backlash(simulator, selection, backlash, found, apart)
    if found is None or with_it.best is selection.best or (beside and off(alone, with_it.best.p) < FOLLOWED):
        return simulator, with_it
    forces = float(start.p[simulator.layout.unknowns[BACKLASH]][0]) if start is not None and forced else 0.0
    return simulator, with_it if abs(found.value - forces) <= max(AGREES * abs(forces), found.std) else selection


def _taken_in(
    simulator: Simulator,
    alone: Simulator,
    selection: Selection,
    backlash: Hypothesis,
    found: Opened | None,
    hypotheses: Sequence[Hypothesis],
    report: Report,
    apart: bool,
) -> tuple[Simulator, Selection] | None:
    """The simulator of all records, and the selection on them, or with no more than their backlash where that explains
    them; None where those `alone` are not followed."""
    begun = with_backlash(simulator, _with_share(simulator.layout.unknowns, selection, found), backlash, found, apart)
    if off(alone, begun.best.p) > NEAR:
        return None
    if off(alone.free, begun.best.p) < EXPLAINED:
        return simulator, begun
    report("simulating: records whose flanks part")
    whole = Simulator(simulator.layout, joined(simulator.target, alone.target), simulator.simulate, alone.nudges)
    further = carried_on(whole, begun, hypotheses, report, apart=apart)
    if further is None or off(alone, further.best.p) > FOLLOWED:
        return None
    return whole, resized(whole, further)


def off(alone: Simulator, p: Array) -> float:
    """The largest part of any channel's fluctuation in a record that the rig `p` (size,) leaves beyond noise; infinite
    where there is no such rig."""
    target, lines = alone.target, alone.lines(p)
    if lines is None:
        return inf
    rest, most = target.lines - lines, 0.0
    for number in range(len(target.measurements)):
        left, _ = target.of_record(number).shares(rest[target.in_records((number,))])
        most = max(most, float(left.max()))
    return most


def with_backlash(
    simulator: Simulator,
    selection: Selection,
    backlash: Hypothesis,
    found: Opened | None,
    apart: bool,
    *,
    only_in: str = "",
) -> Selection:
    """The selection with the backlash that was found, if records call for it; `only_in`: name of the one that alone
    does."""
    if found is None or _backlash_of(selection) is not None:
        return selection
    unknowns = simulator.layout.unknowns
    best = _at(unknowns, selection.best, found.value, backlash.widened(unknowns, selection.best.sd))
    weighed = Weighed(backlash, found.worth, best, std=found.std, only_in=only_in)
    listed = tuple(sorted((*selection.weighed, weighed), key=lambda one: -one.log_bayes_factor))
    entered = entering(unknowns, weighed, apart)
    if entered is None:
        return replace(selection, weighed=listed)
    if only_in:  # what would make up for little evidence has given it
        entered = replace(entered, lacking=0.0)
    return replace(selection, best=best, entered=(*selection.entered, entered), weighed=listed)


def _with_share(unknowns: Unknowns, selection: Selection, found: Opened | None) -> Selection:
    """The selection with a good rig's share of the backlash that was found."""
    if found is None:
        return selection
    base = _at(unknowns, selection.base, found.good, selection.base.sd)
    best = _at(unknowns, selection.best, found.good, selection.best.sd) if selection.entered else base
    return replace(selection, base=base, bare=base, best=best)


def resized(simulator: Simulator, selection: Selection) -> Selection:
    """The selection with the size that its backlash has beside all that was fitted after it, if it has any."""
    one = _backlash_of(selection)
    found = opened(simulator, selection.best.p) if one is not None else None
    if one is None or found is None:
        return selection
    best = _at(simulator.layout.unknowns, selection.best, found.value, selection.best.sd)
    now = replace(one, std=found.std)
    return replace(selection, best=best, entered=tuple(now if other is one else other for other in selection.entered))


def _backlash_of(selection: Selection) -> Weighed | None:
    return next((one for one in selection.entered if one.hypothesis.wide[0].key == BACKLASH), None)


def _at(unknowns: Unknowns, best: Optimum, value: float, sd: Array) -> Optimum:
    """The optimum with that backlash [m] under the prior `sd` (size,), all else as it is."""
    p = best.p.copy()
    p[unknowns[BACKLASH]] = value
    return replace(best, p=p, sd=sd)
