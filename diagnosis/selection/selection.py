"""Which effects the records call for: forward one by one, backward what the others make needless.

At the optimum of the background (`background`) the quadratic weighs every hypothesis; the few of most evidence, by it
or by the force residuals, are simulated to convergence. The best one enters when its evidence clears the limit, and the
others are weighed again beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import BEYOND, Hypothesis
from gearbench.diagnosis.fitting.closeness import answers_alike, better, is_close
from gearbench.diagnosis.fitting.fit import Optimum, fit, fit_afresh, gone_on, refreshed
from gearbench.diagnosis.fitting.moved_motions import with_motions_moved
from gearbench.diagnosis.fitting.reshaped import has_shapes
from gearbench.diagnosis.fitting.restructured import begun_at_nominal, restructured
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.needed import FAR, SAME, beside, held_against_background, needed
from gearbench.diagnosis.selection.rivals import (
    MOST_LEFT,
    compared,
    is_like,
    is_same,
    rivals_of,
    shared_by,
    unentered,
    usual_of,
)
from gearbench.diagnosis.selection.weighing import Weighed, entering, is_own, weigh
from gearbench.diagnosis.simulation.jacobian import WEIGHED
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Report = Callable[[str], None]

NOTHING = 1e-3  # of a number's nominal value: as good as none
MOST = 3  # effects
# Renewals of the Jacobian of what entered in the end, whose structure has been found beside a gap that the effects now
# close.
RENEWALS_LAST = 2
# Of the same begun where a rig without the effects is closer.
RENEWALS_BARE = 4
# Of what all is weighed over, where derivatives that were not renewed on the way led its fit astray.
RENEWALS_FRESH = 3


@dataclass(frozen=True)
class Selection:
    """The background's optimum, the same without any part of what entered, that with all effects that entered, these in
    the order of entering with the evidence that each would take away, and all that was weighed over the background, the
    best first."""

    base: Optimum
    bare: Optimum
    best: Optimum
    entered: tuple[Weighed, ...]
    weighed: tuple[Weighed, ...]


def select(
    simulator: Simulator,
    base: Optimum,
    hypotheses: Sequence[Hypothesis],
    starts: Mapping[str, Start],
    report: Report = lambda step: None,
    shown: Shown | None = None,
    *,
    apart: bool = False,
) -> Selection:
    """The effects of the hypotheses that the records call for beside the background's optimum `base`; `starts`: by a
    hypothesis' name; `shown`: what the records show without simulation; `apart`: a record that has no part in
    this judges what enters."""
    unknowns = simulator.layout.unknowns
    base = _fresh(simulator, base)
    best, entered, weighed = _forward(simulator, base, [], hypotheses, starts, report, apart=apart)

    def begun_elsewhere(best: Optimum, kept: Sequence[Weighed]) -> Optimum:
        # Beside a base that is not close it was sought already.
        if is_close(simulator, base) or not answers_alike(simulator, base, best):
            best = restructured(simulator, best, shown, report)
            best = best if is_close(simulator, best) else with_motions_moved(simulator, best, report)
        report("simulating: all together, from the nominal rig")
        return begun_at_nominal(simulator, best, _entries(unknowns, kept))

    base, bare, best, kept = _together(simulator, base, best, entered, report, begun_elsewhere, apart=apart)
    selection = Selection(base, bare, best, kept, tuple(weighed))
    # What proved needless or a good rig's had kept others out, whose part of the gap it took.
    gone = [one for one in entered if not any(is_same(one.hypothesis, other.hypothesis) for other in kept)]
    return further(simulator, selection, gone, report, apart=apart) or selection


def _fresh(simulator: Simulator, base: Optimum) -> Optimum:
    """The background's optimum as hypotheses are weighed over it: with derivatives taken where it is, and fitted on
    where these promise more than fits may that are compared. What a fit with an effect finds that had nothing to do
    with it would be that effect's evidence, and what old derivatives hide of it is lost."""
    base = refreshed(simulator, base, simulator.layout.unknowns.of(WEIGHED))
    if base.left <= MOST_LEFT:
        return base
    return better(base, fit_afresh(simulator, base.p, base.sd, renewals=RENEWALS_FRESH))


def further(
    simulator: Simulator,
    selection: Selection,
    out: Sequence[Weighed],
    report: Report = lambda step: None,
    *,
    apart: bool = False,
) -> Selection | None:
    """The selection with what the records call for besides when these effects are `out`, which had the place of others;
    None where nothing more enters, or none of that stays."""
    taken, refused = ([one.hypothesis for one in several] for several in (selection.entered, out))
    left = [
        one
        for one in selection.weighed
        # What was refused holds no place: its rare counterpart may be what is at work.
        if not any(is_like(one.hypothesis, other) for other in taken)
        and not any(is_same(one.hypothesis, other) for other in refused)
    ]
    if not out or not any(entering(simulator.layout.unknowns, one, apart) for one in left):
        return None
    rest = [one.hypothesis for one in left]
    best = fit_afresh(simulator, selection.best.p, selection.best.sd, renewals=0) or selection.best
    starts = _found(selection.weighed)
    best, entered, _ = _forward(simulator, best, selection.entered, rest, starts, report, apart=apart)
    if len(entered) == len(selection.entered):
        return None
    base, bare, best, kept = _together(simulator, selection.base, best, entered, report, apart=apart)
    # Nothing would tell the next time that the same was tried.
    if {one.hypothesis.name for one in kept} <= {one.hypothesis.name for one in selection.entered}:
        return None
    return replace(selection, base=base, bare=bare, best=best, entered=kept)


def carried_on(
    simulator: Simulator,
    selection: Selection,
    hypotheses: Sequence[Hypothesis],
    report: Report = lambda step: None,
    *,
    apart: bool = False,
) -> Selection | None:
    """The selection on the records of `simulator`, which that far was one on fewer, with what these call for besides;
    None where they lead nowhere from there."""
    before = selection.best
    best = base = fit_afresh(simulator, before.p, before.sd, renewals=RENEWALS_FRESH)
    if selection.entered:
        base = fit_afresh(simulator, selection.base.p, selection.base.sd, renewals=RENEWALS_FRESH)
    if best is None or base is None:
        return None
    starts = _found(selection.weighed)
    best, entered, weighed = _forward(simulator, best, selection.entered, hypotheses, starts, report, apart=apart)
    if len(entered) == 1:
        alone = best.evidence - base.evidence - float(np.log(entered[0].hypothesis.choices))
        entered = [replace(entered[0], log_bayes_factor=alone)]
    base, bare, best, kept = _together(simulator, base, best, entered, report, apart=apart)
    if selection.entered:
        weighed = list(selection.weighed)
    return Selection(base, bare, best, kept, tuple(weighed))


def _together(
    simulator: Simulator,
    base: Optimum,
    best: Optimum,
    entered: Sequence[Weighed],
    report: Report,
    then: Callable[[Optimum, Sequence[Weighed]], Optimum] = lambda best, kept: best,
    *,
    apart: bool,
) -> tuple[Optimum, Optimum, Optimum, tuple[Weighed, ...]]:
    """The background's optimum, that without any part of the effects that stay of what entered, that with them, fitted
    to the end and what is done `then`, and these."""
    found = _staying(simulator, base, best, entered, report, then, apart=apart)
    return _begun_at_bare(simulator, *found, report, apart=apart)


def _staying(
    simulator: Simulator,
    base: Optimum,
    best: Optimum,
    entered: Sequence[Weighed],
    report: Report,
    then: Callable[[Optimum, Sequence[Weighed]], Optimum] = lambda best, kept: best,
    *,
    apart: bool,
) -> tuple[Optimum, Optimum, tuple[Weighed, ...]]:
    """The background's optimum, that with the effects that stay of what entered, fitted to the end and what is done
    `then`, and these."""
    best, kept = needed(simulator, base, best, entered, report, apart=apart)
    if kept:
        best = then(gone_on(simulator, best, RENEWALS_LAST, partial(report, "simulating: all together")), kept)
        base, best, kept = held_against_background(simulator, base, best, kept, report, apart=apart)
    return base, best if kept else base, kept


def _begun_at_bare(
    simulator: Simulator, base: Optimum, best: Optimum, kept: tuple[Weighed, ...], report: Report, *, apart: bool
) -> tuple[Optimum, Optimum, Optimum, tuple[Weighed, ...]]:
    """The background's optimum, that without any part of the effects `kept`, that with them, and those that stay.

    Effects spoil nothing that a rig without them explains: where that answers the excitation better, the one with them
    lies in another valley, and is begun there once more.
    """
    unknowns, target = simulator.layout.unknowns, simulator.target
    bare = _bare(simulator, base, kept)
    without, within = (target.excited_cost(target.lines - one.lines) for one in (bare, best))
    if not kept or within < without + SAME:
        return base, bare, best, kept
    report("simulating: all together, from the rig without them")
    begin = np.where(_entries(unknowns, kept), best.p, bare.p)
    again = fit_afresh(simulator, begin, best.sd, renewals=RENEWALS_BARE)
    if again is None or again.evidence <= best.evidence:
        return base, bare, best, kept
    base, best, kept = _staying(simulator, base, again, kept, report, apart=apart)
    return base, _bare(simulator, base, kept), best, kept


def _with_only(simulator: Simulator, base: Optimum, best: Optimum, kept: Sequence[Weighed]) -> Optimum:
    """The optimum with these of the effects that entered, the others no larger than in the background `base`."""
    return (beside(simulator, base, best, kept) or best) if kept else base


def _forward(
    simulator: Simulator,
    best: Optimum,
    beside: Sequence[Weighed],
    hypotheses: Sequence[Hypothesis],
    starts: Mapping[str, Start],
    report: Report,
    *,
    apart: bool,
) -> tuple[Optimum, list[Weighed], list[Weighed]]:
    """The optimum with what enters one by one beside what did before, all that entered, and all that was weighed
    first."""
    unknowns, entered, first = simulator.layout.unknowns, list(beside), list[Weighed]()
    while len(entered) < MOST:
        taken = [one.hypothesis for one in entered]
        rest = [one for one in hypotheses if not any(is_like(one, other) for other in taken)]
        found = compared(simulator, best, weigh(simulator, best, rest, starts, report, reshape=not entered))
        if not first:
            first, starts = found, {**starts, **_shaped(found)}
        shared = shared_by(unknowns, best, found)
        winner = _entering_first(unknowns, found, apart, shared)
        if winner is None or winner.optimum is None:
            break
        entered.append(replace(winner, rivals=rivals_of(winner, found, shared)))
        best = winner.optimum
        best = fit_afresh(simulator, best.p, best.sd, renewals=0) or best
    return best, entered, first


def _entering_first(unknowns: Unknowns, found: Sequence[Weighed], apart: bool, shared: float = 0.0) -> Weighed | None:
    """What enters first of those weighed, the best first: the usual cause, or where that has too little evidence by
    itself the one of which it is the counterpart; `shared`: nats that both have by a good rig's share."""
    for one in (usual_of(found, shared), *found[:1]):
        entered = entering(unknowns, one, apart) if one else None
        if entered is not None:
            return entered
    return None


def _entries(unknowns: Unknowns, effects: Sequence[Weighed]) -> NDArray[np.bool_]:
    """Which unknowns (size,) are those of these effects."""
    out = np.zeros(unknowns.size, dtype=bool)
    for one in effects:
        out[one.hypothesis.entries(unknowns)] = True
    return out


def _shaped(weighed: Sequence[Weighed]) -> dict[str, Start]:
    """Where hypotheses that have shapes to begin from got, to begin from beside an effect."""
    return _found([one for one in weighed if has_shapes(one.hypothesis)])


def _found(weighed: Sequence[Weighed]) -> dict[str, Start]:
    """Where hypotheses that were simulated got, to begin from again."""
    return {
        one.hypothesis.name: Start(one.hypothesis, one.optimum.p, one.log_bayes_factor)
        for one in weighed
        if one.optimum is not None
    }


def with_entered(simulator: Simulator, selection: Selection, one: Weighed) -> Selection:
    """The selection with an effect entered that was weighed and simulated but did not clear the limit."""
    assert one.optimum is not None
    bare = _bare(simulator, selection.base, [one])
    return replace(selection, bare=bare, best=one.optimum, entered=(one,))


def only(simulator: Simulator, selection: Selection, kept: Sequence[Weighed]) -> Selection:
    """The selection with only these of the effects that entered: the others go back to a background's size."""
    best = _with_only(simulator, selection.base, selection.best, kept)
    bare = _bare(simulator, selection.base, kept)
    return replace(selection, bare=bare, best=best, entered=tuple(kept))


def taken_out(simulator: Simulator, selection: Selection, effect: Weighed) -> Optimum:
    """The optimum without any part of one of the effects that entered, or of what would take its place.

    The rig, its structure and the other effects that entered are fitted again; what a good rig has of all others stays
    as it is: pitch errors that take the shape of the run-out left out would make it seem to close nothing.
    """
    unknowns = simulator.layout.unknowns
    held = np.zeros(unknowns.size, dtype=bool)
    for group in unknowns.groups:
        held[unknowns[group.key]] = (group.wide > group.sd).any()
    for one in selection.entered:
        held[one.hypothesis.entries(unknowns)] = False
    base = replace(selection.best, sd=np.where(held, 0.0, selection.best.sd))
    return _without(simulator, base, [unentered(effect, selection.entered)])


def evidence_without(unknowns: Unknowns, selection: Selection, effect: Weighed, optimum: Optimum) -> float:
    """Log evidence of the `optimum` without one of the effects that entered, whose backgrounds were held for it, beside
    that of the optimum with all."""
    sd = selection.best.sd.copy()
    for cause in unentered(effect, selection.entered).in_its_place:
        sd[cause.entries(unknowns)] = 0.0
    return optimum.evidence_under(sd)


def _bare(simulator: Simulator, base: Optimum, effects: Sequence[Weighed]) -> Optimum:
    """The background's optimum without any part of these effects. Of other effects it has no more in their place than a
    good rig: an encoder's run-out of twenty of its deviations is no recalibration."""
    found = _without(simulator, base, effects)
    held = np.zeros(found.p.size, dtype=bool)
    for group in simulator.layout.unknowns.groups:
        at = simulator.layout.unknowns[group.key]
        if not ((group.wide > group.sd).any() and (found.sd[at] > 0.0).all()):
            continue
        before, after = (float(np.sqrt(np.mean((p[at] / group.sd) ** 2))) for p in (base.p, found.p))
        held[at] = after > max(FAR, before)
    if not held.any():
        return found
    return _without(simulator, replace(base, sd=np.where(held, 0.0, base.sd)), effects)


def _without(simulator: Simulator, base: Optimum, effects: Sequence[Weighed]) -> Optimum:
    """The background's optimum with the unknowns of these effects and of what would take their place held at zero, and
    numbers of the nominal rig where its uncertainty ends, within which recalibration moves them; itself where that is
    no rig."""
    sd, p, unknowns = base.sd.copy(), base.p.copy(), simulator.layout.unknowns
    for wide in (wide for one in effects for cause in one.in_its_place for wide in cause.wide):
        at = wide.entries(unknowns)
        low, high = (0.0, 0.0) if is_own(unknowns, wide) else known_within(unknowns.prior()[at])
        sd[at], p[at] = 0.0, np.clip(p[at], low, high)
    return (fit(simulator, p, sd, base.sensitivity) or base) if effects else base


def known_within(sd: Array) -> tuple[Array, Array]:
    """Least and largest logarithm of a number over its nominal value within BEYOND of its standard deviations (relative
    ones): of a number known to a third of itself or worse, nothing is too small."""
    edge = BEYOND * sd
    return np.log(np.maximum(1.0 - edge, NOTHING)), edge
