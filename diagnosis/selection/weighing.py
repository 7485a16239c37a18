"""How much each hypothesis is worth beside what a fit holds: promised by the quadratic, the likeliest simulated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.effects.effect import Effect, Hypothesis, Wide
from gearbench.diagnosis.effects.friction import KEY as FRICTION
from gearbench.diagnosis.fitting.closeness import better
from gearbench.diagnosis.fitting.fit import GAIN, Optimum, cost_of, fit, fit_afresh, refreshed
from gearbench.diagnosis.fitting.reshaped import has_shapes, reshaped
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.standing import begun_late, called_for, denied_by_means
from gearbench.diagnosis.simulation.jacobian import FOLLOWED
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.contrast import is_strange
from gearbench.diagnosis.structure.rubbing import TURNING

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
TRIED = 4  # hypotheses that are simulated, at each step
BY_FORCES = 2  # of them at least, by the force residuals' ranking
LOOKED_AT = 8  # hypotheses whose quadratic is followed to its minimum
WORTH = 2.0  # nats promised from which a hypothesis is simulated
RENEWALS = 1  # of the Jacobian, for each promising hypothesis


@dataclass(frozen=True)
class Weighed:
    """A hypothesis, its log Bayes factor over what was there before it, its optimum (None: by the quadratic), and of
    one that entered the `rivals` that explain the records as well and the nats that it is `lacking` up to its limit;
    of one whose size was tried value by value its `std`, and the record that shows it if it is `only_in` that."""

    hypothesis: Hypothesis
    log_bayes_factor: float
    optimum: Optimum | None
    rivals: tuple[Hypothesis, ...] = ()
    lacking: float = 0.0
    std: float | None = None
    only_in: str = ""

    @property
    def effect(self) -> Effect:
        """The effect of the hypothesis: nothing is weighed without one."""
        assert self.hypothesis.effect is not None
        return self.hypothesis.effect

    @property
    def causes(self) -> tuple[Hypothesis, ...]:
        """The hypothesis and its rivals."""
        return (self.hypothesis, *self.rivals)

    @property
    def in_its_place(self) -> tuple[Hypothesis, ...]:
        """The hypothesis and what would take its place: not a usual cause that had too little evidence to enter, of
        which a good rig has a share whether or not this rare one is at work."""
        return (self.hypothesis, *(one for one in self.rivals if not self.hypothesis.gives_way_to(one)))


def best_evidence(*lists: Sequence[Weighed]) -> dict[str, float]:
    """Most evidence of each effect in what was weighed, by its name."""
    out: dict[str, float] = {}
    for one in (one for several in lists for one in several):
        out[one.effect.name] = max(out.get(one.effect.name, -np.inf), one.log_bayes_factor)
    return out


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
    begin from also from these (`reshape`), and late angles from what the means call for."""
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
    called = {one.name: begin for one in hypotheses if (begin := called_for(simulator, base, one)) is not None}
    names += [name for name in (*shaped, *called) if name not in names]

    def weighed(item: tuple[float, Hypothesis, Array]) -> Weighed:
        value, one, step = item
        if one.name not in names:
            return Weighed(one, min(value, 0.0), None)
        report(f"simulating: {one.name}")
        # What any further step from there promises says nothing for this one.
        renewals = RENEWALS if value - base.left > LIMIT else 0
        try:
            begun = [turned_round(simulator, one, _refit(simulator, base, one, step, starts.get(one.name), renewals))]
            if one.name in shaped:
                begun.append(reshaped(simulator, one, one.widened(unknowns, base.sd)))
            if one.name in called:
                begun.append(begun_late(simulator, base, one, called[one.name]))
            likely = (found for found in begun if found and not denied_by_means(simulator, one, found))
            optimum = max(likely, key=lambda found: found.evidence, default=None)
        except ValueError:  # a fit that leads nowhere costs its hypothesis, not the verdict
            optimum = None
        if optimum is None:
            return Weighed(one, min(value, 0.0), None)
        return Weighed(one, worth(simulator, base, one, optimum), optimum)

    out = side_by_side(weighed, promised)
    return sorted(out, key=lambda one: -one.log_bayes_factor)


def worth(simulator: Simulator, base: Optimum, one: Hypothesis, found: Optimum) -> float:
    """Log Bayes factor of a hypothesis that was `found` beside `base`."""
    factor = found.evidence - base.evidence - float(np.log(one.choices))
    return min(factor, relief(simulator.layout.unknowns, base.sd, one, found.p, found.sd))


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


def turned_round(simulator: Simulator, one: Hypothesis, found: Optimum | None) -> Optimum | None:
    """The optimum of a hypothesis, of friction with how fast it turns round fitted besides: a rig without friction does
    not feel that, so that what is known of it there is nothing."""
    unknowns = simulator.layout.unknowns
    if found is None or TURNING not in unknowns.slices or all(wide.key != FRICTION for wide in one.wide):
        return found
    anew = refreshed(simulator, found, unknowns.of((TURNING,)))
    return better(found, fit(simulator, anew.p, anew.sd, anew.sensitivity))


def relief(unknowns: Unknowns, narrow: Array, hypothesis: Hypothesis, p: Array, sd: Array) -> float:
    """What widening its own prior from `narrow` to `sd` (size,) can add to the evidence at most where the unknowns are
    `p` (size,) (`evidence.search`); no limit for what the background holds at zero."""
    at = hypothesis.entries(unknowns)
    if not narrow[at].all():
        return np.inf
    return 0.5 * float((p[at] ** 2 * (narrow[at] ** -2.0 - sd[at] ** -2.0)).sum())


def entering(unknowns: Unknowns, one: Weighed, apart: bool) -> Weighed | None:
    """What was weighed, if it enters, with what it lacks; where a record that had no part in it judges (`apart`) less
    evidence is enough."""
    if beyond(unknowns, one, apart) < 0.0:
        return None
    return replace(one, lacking=max(limit_of(unknowns, one.hypothesis) - one.log_bayes_factor, 0.0))


def beyond(unknowns: Unknowns, one: Weighed, apart: bool) -> float:
    """Nats that what was weighed has beyond those from which it enters."""
    limit = limit_of(unknowns, one.hypothesis)
    return one.log_bayes_factor - (min(limit, PROVISIONAL) if apart else limit)


def limit_of(unknowns: Unknowns, one: Hypothesis) -> float:
    """Nats from which a hypothesis enters where no other record speaks."""
    if any(wide.key == FOLLOWED for wide in one.wide):
        return LIMIT_GIVEN
    return LIMIT if has_own(unknowns, one) else LIMIT_NUMBER


def has_own(unknowns: Unknowns, one: Hypothesis) -> bool:
    """Whether a hypothesis has unknowns of its own, and is not about numbers of the nominal rig alone."""
    return any(is_own(unknowns, wide) for wide in one.wide)


def is_own(unknowns: Unknowns, wide: Wide) -> bool:
    """Whether a prior belongs to the effect's own unknowns, and not to a number of the nominal rig."""
    group = unknowns.group(wide.key)
    return bool((group.wide > group.sd).any())
