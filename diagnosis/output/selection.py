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

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.effects.effect import BEYOND, Hypothesis, Wide
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.output.background import prior_of
from gearbench.diagnosis.output.beginning import Around
from gearbench.diagnosis.output.by_forces import Start
from gearbench.diagnosis.output.contrast import is_strange
from gearbench.diagnosis.output.fit import GAIN, Optimum, cost_of, fit, fit_afresh, gone_on, refreshed
from gearbench.diagnosis.output.jacobian import FOLLOWED, WEIGHED
from gearbench.diagnosis.output.reshaped import has_shapes, reshaped
from gearbench.diagnosis.output.restructured import begun_at_nominal, better, is_close, restructured
from gearbench.diagnosis.output.rivals import compared, is_like, rivals_of, usual_of
from gearbench.diagnosis.output.simulator import Simulator

Array = NDArray[np.float64]
Report = Callable[[str], None]

LIMIT = 8.0  # nats from which an effect enters
# Of a number of the nominal rig, whose stated uncertainty is the measure: four of its standard deviations are worth no
# more than this and a prior's width, and only beyond three it is named at all.
LIMIT_NUMBER = 3.0
# Of a delay of the driven angle, which replays are given: it shows by little but the mesh phase, whose zero is free,
# and sound rigs of the calibration family had up to 9.4.
LIMIT_GIVEN = 12.0
# Nats from which an effect enters to be held against a record that had no part in the search: what it lacks up to its
# limit must be made up for there.
PROVISIONAL = 4.0
NOTHING = 1e-3  # of a number's nominal value: as good as none
TRIED = 4  # hypotheses that are simulated, at each step
BY_FORCES = 2  # of them at least, by the force residuals' ranking
MOST = 3  # effects
LOOKED_AT = 8  # hypotheses whose quadratic is followed to its minimum
WORTH = 2.0  # nats promised from which a hypothesis is simulated
# Renewals of the Jacobian: of each promising hypothesis, and of what entered in the end, whose structure has been found
# beside a gap that the effects now close.
RENEWALS, RENEWALS_LAST = 1, 2
# Of what all is weighed over, where derivatives that were not renewed on the way led its fit astray.
RENEWALS_FRESH = 3


@dataclass(frozen=True)
class Weighed:
    """A hypothesis, its log Bayes factor over what was there before it, its optimum (None: by the quadratic), and of
    one that entered the `rivals` that explain the records as well and the nats that it is `lacking` up to its limit."""

    hypothesis: Hypothesis
    log_bayes_factor: float
    optimum: Optimum | None
    rivals: tuple[Hypothesis, ...] = ()
    lacking: float = 0.0

    @property
    def causes(self) -> tuple[Hypothesis, ...]:
        """The hypothesis and its rivals."""
        return (self.hypothesis, *self.rivals)


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
    around: Around | None = None,
    *,
    apart: bool = False,
) -> Selection:
    """The effects of the hypotheses that the records call for beside the background's optimum `base`; `starts`: by a
    hypothesis' name; `around`: the rig around its mesh, as the records show it; `apart`: a record that has no part in
    this judges what enters."""
    unknowns = simulator.layout.unknowns
    if not is_close(simulator, base):
        base = refreshed(simulator, base, unknowns.of(WEIGHED))
    base = gone_on(simulator, base, RENEWALS_FRESH)
    best, weighed = base, None
    entered: list[Weighed] = []
    while len(entered) < MOST:
        taken = [one.hypothesis for one in entered]
        rest = [one for one in hypotheses if not any(is_like(one, other) for other in taken)]
        found = compared(simulator, best, weigh(simulator, best, rest, starts, report, reshape=not entered))
        if weighed is None:
            weighed, starts = found, {**starts, **_shaped(found)}
        winner = usual_of(found)
        winner = entering(unknowns, winner, apart) if winner else None
        if winner is None or winner.optimum is None:
            break
        entered.append(replace(winner, rivals=rivals_of(winner, found)))
        best = winner.optimum
        best = fit_afresh(simulator, best.p, best.sd, renewals=0) or best
    best, kept = _needed(simulator, best, entered, apart)
    if kept:
        best = gone_on(simulator, best, RENEWALS_LAST, partial(report, "simulating: all together"))
        best = restructured(simulator, best, around, report)
        report("simulating: all together, from the nominal rig")
        best = begun_at_nominal(simulator, best, _entries(unknowns, kept))
    bare = _without(simulator, base, kept)
    return Selection(base, bare, best, kept, tuple(weighed or ()))


def weigh(
    simulator: Simulator,
    base: Optimum,
    hypotheses: Sequence[Hypothesis],
    starts: Mapping[str, Start],
    report: Report = lambda step: None,
    *,
    reshape: bool = True,
) -> list[Weighed]:
    """All hypotheses beside what `base` holds, the best first: the most promising simulated, those that have shapes to
    begin from also from these (`reshape`)."""
    unknowns, quadratic = simulator.layout.unknowns, base.sensitivity.quadratic
    # What moves nothing in these records cannot be weighed by them.
    hypotheses = [one for one in hypotheses if np.isin(one.entries(unknowns), quadratic.active).any()]
    promised = []
    first = first_look(base, hypotheses, unknowns)
    likely = set(np.argsort(-first)[:LOOKED_AT])
    for number, one in enumerate(hypotheses):
        if number not in likely and one.name not in starts:
            promised.append((min(float(first[number]), 0.0), one, np.zeros(len(quadratic.active))))
            continue
        sd = one.widened(unknowns, base.sd)
        step, cost, information = quadratic.best(base.p, sd, unknowns.bounds())
        evidence = quadratic.evidence(cost, information, sd) - base.evidence - np.log(one.choices)
        there = base.p.copy()
        there[quadratic.active] += step
        promised.append((min(float(evidence), relief(unknowns, base.sd, one, there, sd)), one, step))
    promised.sort(key=lambda item: -item[0])
    ranked = [one.name for _, one, _ in promised]
    by_force = sorted((s for s in starts.values() if s.hypothesis.name in ranked), key=lambda s: -s.log_bayes_factor)
    names = [s.hypothesis.name for s in by_force[:BY_FORCES] if s.log_bayes_factor > WORTH]
    names = list(dict.fromkeys([*names, *(one.name for value, one, _ in promised[:TRIED] if value > WORTH)]))[:TRIED]
    shaped = [one.name for one in hypotheses if has_shapes(one)] if reshape and is_strange(unknowns, base.p) else []
    names += [name for name in shaped if name not in names]

    def weighed(item: tuple[float, Hypothesis, Array]) -> Weighed:
        value, one, step = item
        if one.name not in names:
            return Weighed(one, min(value, 0.0), None)
        report(f"simulating: {one.name}")
        # What any further step from there promises says nothing for this one.
        renewals = RENEWALS if value - base.left > LIMIT else 0
        try:
            optimum = _refit(simulator, base, one, step, starts.get(one.name), renewals)
            if one.name in shaped:
                other = reshaped(simulator, one, one.widened(unknowns, base.sd))
                optimum = other if optimum is None else better(optimum, other)
        except ValueError:  # a fit that leads nowhere costs its hypothesis, not the verdict
            optimum = None
        if optimum is None:
            return Weighed(one, min(value, 0.0), None)
        factor = optimum.evidence - base.evidence - float(np.log(one.choices))
        return Weighed(one, min(factor, relief(unknowns, base.sd, one, optimum.p, optimum.sd)), optimum)

    out = side_by_side(weighed, promised)
    return sorted(out, key=lambda one: -one.log_bayes_factor)


def _entries(unknowns: Unknowns, effects: Sequence[Weighed]) -> NDArray[np.bool_]:
    """Which unknowns (size,) are those of these effects."""
    out = np.zeros(unknowns.size, dtype=bool)
    for one in effects:
        out[one.hypothesis.entries(unknowns)] = True
    return out


def _shaped(weighed: Sequence[Weighed]) -> dict[str, Start]:
    """Where hypotheses that have shapes to begin from got, to begin from beside an effect."""
    return {
        one.hypothesis.name: Start(one.hypothesis, one.optimum.p, one.log_bayes_factor)
        for one in weighed
        if one.optimum is not None and has_shapes(one.hypothesis)
    }


def first_look(base: Optimum, hypotheses: Sequence[Hypothesis], unknowns: Unknowns) -> Array:
    """Log Bayes factors (hypotheses,) under the weights that the blocks have at `base`: what one step would gain."""
    quadratic = base.sensitivity.quadratic
    nothing = np.zeros(len(quadratic.active))
    information, weights = quadratic.information(nothing), quadratic.weights(nothing)
    here = base.p[quadratic.active]
    slope = weights @ quadratic.slopes + information @ here

    def evidence(sd: Array) -> float:
        width = sd[quadratic.active]
        scale = width[width > 0.0]
        inside = np.ix_(width > 0.0, width > 0.0)
        root = np.linalg.cholesky(information[inside] * scale[:, None] * scale[None, :] + np.eye(len(scale)))
        half = np.linalg.solve(root, scale * slope[width > 0.0])
        return 0.5 * float(half @ half) - float(np.log(np.diag(root)).sum())

    plain = evidence(base.sd)
    found = [evidence(one.widened(unknowns, base.sd)) - plain - np.log(one.choices) for one in hypotheses]
    return np.array(found)


def _refit(
    simulator: Simulator, base: Optimum, one: Hypothesis, step: Array, start: Start | None, renewals: int
) -> Optimum | None:
    unknowns, active = simulator.layout.unknowns, base.sensitivity.quadratic.active
    sd = one.widened(unknowns, base.sd)
    linear, alone = base.p.copy(), base.p.copy()
    linear[active] += step
    entries = one.entries(unknowns)
    alone[entries] = linear[entries]
    trials, there = [linear, alone, base.p], None
    if start is not None:
        own = base.p.copy()
        own[entries] = start.p[entries]
        there = np.where(sd > 0.0, np.clip(start.p, *unknowns.bounds()), 0.0)
        trials += [own, there]
    seen = np.isin(np.arange(unknowns.size), active)
    costs = [cost_of(simulator, np.where(seen, np.clip(p, *unknowns.bounds()), 0.0), sd) for p in trials]
    # A rig that has what the background lacks feels unknowns that this does not: a coupling its loss.
    if there is not None and cost_of(simulator, there, sd) < min(costs) - GAIN:
        return fit_afresh(simulator, there, sd, renewals=renewals)
    begin = trials[int(np.argmin(costs))]
    return fit(simulator, begin, sd, base.sensitivity, renewals=renewals)


def relief(unknowns: Unknowns, narrow: Array, hypothesis: Hypothesis, p: Array, sd: Array) -> float:
    """What widening its own prior from `narrow` to `sd` (size,) can add to the evidence at most where the unknowns are
    `p` (size,) (`evidence.search`); no limit for what the background holds at zero."""
    at = hypothesis.entries(unknowns)
    if not narrow[at].all():
        return np.inf
    return 0.5 * float((p[at] ** 2 * (narrow[at] ** -2.0 - sd[at] ** -2.0)).sum())


def with_entered(simulator: Simulator, selection: Selection, one: Weighed) -> Selection:
    """The selection with an effect entered that was weighed and simulated but did not clear the limit."""
    assert one.optimum is not None
    bare = _without(simulator, selection.base, [one])
    return replace(selection, bare=bare, best=one.optimum, entered=(one,))


def only(simulator: Simulator, selection: Selection, kept: Sequence[Weighed]) -> Selection:
    """The selection with only these of the effects that entered: the others go back to a background's size."""
    base, unknowns = selection.base, simulator.layout.unknowns
    if not kept:
        return replace(selection, bare=base, best=base, entered=())
    sd = base.sd
    for one in kept:
        sd = one.hypothesis.widened(unknowns, sd)
    p, near = selection.best.p, selection.best.sensitivity
    p = np.where(sd > 0.0, np.clip(p, -3.0 * sd, 3.0 * sd), 0.0)
    best = fit(simulator, p, sd, near) or selection.best
    bare = _without(simulator, base, kept)
    return replace(selection, bare=bare, best=best, entered=tuple(kept))


def taken_out(simulator: Simulator, selection: Selection, effect: Weighed) -> Optimum:
    """The optimum without any part of one of the effects that entered, or of its rivals.

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
    return _without(simulator, base, [effect])


def _without(simulator: Simulator, base: Optimum, effects: Sequence[Weighed]) -> Optimum:
    """The background's optimum with the unknowns of these effects and their rivals held at zero, and numbers of the
    nominal rig where its uncertainty ends, within which recalibration moves them; itself where that is no rig."""
    sd, p, unknowns = base.sd.copy(), base.p.copy(), simulator.layout.unknowns
    for wide in (wide for one in effects for cause in one.causes for wide in cause.wide):
        at = wide.entries(unknowns)
        low, high = (0.0, 0.0) if is_own(unknowns, wide) else known_within(unknowns.prior()[at])
        sd[at], p[at] = 0.0, np.clip(p[at], low, high)
    return (fit(simulator, p, sd, base.sensitivity) or base) if effects else base


def known_within(sd: Array) -> tuple[Array, Array]:
    """Least and largest logarithm of a number over its nominal value within BEYOND of its standard deviations (relative
    ones): of a number known to a third of itself or worse, nothing is too small."""
    edge = BEYOND * sd
    return np.log(np.maximum(1.0 - edge, NOTHING)), edge


def entering(unknowns: Unknowns, one: Weighed, apart: bool) -> Weighed | None:
    """What was weighed, if it enters, with what it lacks; where a record that had no part in it judges (`apart`) less
    evidence is enough."""
    limit = limit_of(unknowns, one.hypothesis)
    if one.log_bayes_factor < (min(limit, PROVISIONAL) if apart else limit):
        return None
    return replace(one, lacking=max(limit - one.log_bayes_factor, 0.0))


def limit_of(unknowns: Unknowns, one: Hypothesis) -> float:
    """Nats from which a hypothesis enters where no other record speaks."""
    if any(wide.key == FOLLOWED for wide in one.wide):
        return LIMIT_GIVEN
    return LIMIT if any(is_own(unknowns, wide) for wide in one.wide) else LIMIT_NUMBER


def is_own(unknowns: Unknowns, wide: Wide) -> bool:
    """Whether a prior belongs to the effect's own unknowns, and not to a number of the nominal rig."""
    group = unknowns.group(wide.key)
    return bool((group.wide > group.sd).any())


def _needed(
    simulator: Simulator, best: Optimum, entered: Sequence[Weighed], apart: bool
) -> tuple[Optimum, tuple[Weighed, ...]]:
    """The optimum without what the other effects make needless, and each effect that stays with what it is worth."""
    unknowns, kept = simulator.layout.unknowns, list[Weighed | None]()
    for one in entered:
        sd = best.sd.copy()
        at = one.hypothesis.entries(unknowns)
        sd[at] = prior_of(simulator, unknowns.prior())[at]
        p = np.where((sd > 0.0) | (best.sd == 0.0), best.p, 0.0)
        quadratic = best.sensitivity.quadratic
        _, cost, information = quadratic.best(best.p, sd, _bounds_at(unknowns, p, best.p, sd))
        worth = best.evidence - quadratic.evidence(cost, information, sd)
        now = replace(one, log_bayes_factor=float(worth) if len(entered) > 1 else one.log_bayes_factor)
        kept.append(entering(unknowns, now, apart))
    return best, tuple(one for one in kept if one is not None)


def _bounds_at(unknowns: Unknowns, wanted: Array, here: Array, sd: Array) -> tuple[Array, Array]:
    """Bounds that hold at `wanted` what has no prior."""
    low, high = unknowns.bounds()
    fixed = (sd == 0.0) & (wanted != here)
    return np.where(fixed, wanted, low), np.where(fixed, wanted, high)
