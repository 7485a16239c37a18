"""What explains the records as well as the hypothesis that is ahead: its rivals, and which of them all is named."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.evidence.separable import APART
from gearbench.diagnosis.fitting.fit import Optimum, fit
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.selection.weighing import LIMIT, Weighed, worth
from gearbench.diagnosis.simulation.simulator import Simulator

MOST_LEFT = 6.0  # nats still promised by fits that count for comparing them
# Part of a rare effect's evidence that its usual counterpart must have: what both explain is nine tenths of it, and the
# rest is told by resonances that no model has to the per cent.
NEARLY = 0.75
# The same of all that both explain, a good rig's share of them included: what tells them apart is sidebands, which no
# model has to a few per cent of the lines that both make.
ALIKE = 0.95
RENEWALS = 1


def usual_of(weighed: Sequence[Weighed], shared: float = 0.0) -> Weighed | None:
    """The best of those weighed; in place of a rare one its usual counterpart where that explains the records nearly as
    well, beside the nats `shared` by both. None of none."""
    if not weighed:
        return None
    best = weighed[0]
    usual = next((one for one in weighed if _is_usual(one, best) and one.optimum is not None), None)
    return usual if usual is not None and usual.log_bayes_factor > _needed(usual, best, shared) else best


def _needed(usual: Weighed, rare: Weighed, shared: float) -> float:
    """Nats from which a usual one explains the records nearly as well as a rare one."""
    of_all = ALIKE * (shared + rare.log_bayes_factor) - shared
    return min(NEARLY * rare.log_bayes_factor, of_all, rare.log_bayes_factor - APART - _left(usual, rare))


def shared_by(unknowns: Unknowns, base: Optimum, weighed: Sequence[Weighed]) -> float:
    """Nats that a good rig's share of the best one of those weighed, if it is rare, and of its usual counterparts has
    explained in `base`, as its quadratic tells."""
    usual = [one for one in weighed[1:] if _is_usual(one, weighed[0]) and one.optimum is not None]
    if not usual:
        return 0.0
    quadratic, sd, (low, high) = base.sensitivity.quadratic, base.sd.copy(), unknowns.bounds()
    _, cost, information = quadratic.best(base.p, sd, (low, high))
    whole = quadratic.evidence(cost, information, sd)  # with what the fit of `base` still promises, as without either
    entries = np.concatenate([one.hypothesis.entries(unknowns) for one in (weighed[0], *usual)])
    sd[entries], low[entries], high[entries] = 0.0, 0.0, 0.0
    _, cost, information = quadratic.best(base.p, sd, (low, high))
    return max(whole - quadratic.evidence(cost, information, sd), 0.0)


def compared(simulator: Simulator, base: Optimum, weighed: Sequence[Weighed]) -> list[Weighed]:
    """Those weighed beside `base`, the best first. What decides between them is not which was fitted better on the way:
    those whose fit stopped while it promised to overtake are gone on with, and usual counterparts of a rare one that
    is ahead, and rare ones of a usual one, are fitted again from where that one got, with what it explains handed
    over."""
    if not weighed:
        return []
    ahead = weighed[0].log_bayes_factor
    found = _ranked(_gone_on(simulator, base, one) if _may_overtake(one, base, ahead) else one for one in weighed)
    best = found[0]
    return _ranked(_handed_over(simulator, base, best, one) if _are_counterparts(one, best) else one for one in found)


def _ranked(weighed: Iterable[Weighed]) -> list[Weighed]:
    return sorted(weighed, key=lambda one: -one.log_bayes_factor)


def _may_overtake(one: Weighed, base: Optimum, ahead: float) -> bool:
    """Whether the fit of one promises enough, beyond what any rig has from there, to be as good as the one ahead."""
    if one.optimum is None:
        return False
    promised = one.optimum.left - base.left
    return promised > MOST_LEFT and one.log_bayes_factor + promised > max(ahead - APART, LIMIT)


def _gone_on(simulator: Simulator, base: Optimum, one: Weighed) -> Weighed:
    """One that was simulated, fitted on from where it got."""
    assert one.optimum is not None
    found = fit(simulator, one.optimum.p, one.optimum.sd, one.optimum.sensitivity, renewals=RENEWALS)
    return _better(simulator, base, one, found)


def _better(simulator: Simulator, base: Optimum, one: Weighed, found: Optimum | None) -> Weighed:
    """One, or where it explains more another fit of it."""
    if found is None:
        return one
    factor = worth(simulator, base, one.hypothesis, found)
    return one if factor <= one.log_bayes_factor else replace(one, log_bayes_factor=factor, optimum=found)


def _handed_over(simulator: Simulator, base: Optimum, best: Weighed, one: Weighed) -> Weighed:
    """A counterpart of the best one, or where it explains more its fit from where that got."""
    if best.optimum is None:
        return one
    unknowns, p = simulator.layout.unknowns, best.optimum.p.copy()
    own = best.hypothesis.entries(unknowns)
    p[one.hypothesis.entries(unknowns)] += _in_place_of(best.hypothesis, one.hypothesis) * p[own]
    p[own] = 0.0
    sd = one.hypothesis.widened(unknowns, base.sd)
    return _better(simulator, base, one, fit(simulator, p, sd, best.optimum.sensitivity, renewals=RENEWALS))


def _in_place_of(one: Hypothesis, other: Hypothesis) -> float:
    """How many times the unknowns of one of two counterparts the other's are for the same transmission error."""
    if one.gives_way_to(other):
        assert one.usual is not None
        return one.usual[1]
    return 1.0 / _in_place_of(other, one)


def _are_counterparts(one: Weighed, best: Weighed) -> bool:
    return _is_usual(one, best) or _is_usual(best, one)


def _is_usual(one: Weighed, rare: Weighed) -> bool:
    """Whether one is a usual counterpart of another, rare one."""
    return one is not rare and rare.hypothesis.gives_way_to(one.hypothesis)


def rivals_of(winner: Weighed, weighed: Sequence[Weighed], shared: float = 0.0) -> tuple[Hypothesis, ...]:
    """Those of the hypotheses weighed beside the winner that explain the records as well, by other unknowns, and are
    another cause to look for; of a rare winner's usual counterparts beside the nats `shared` by both."""
    return tuple(one.hypothesis for one in weighed if _as_good(one, winner, shared))


def unentered(one: Weighed, entered: Sequence[Weighed]) -> Weighed:
    """One of those that entered, with the rivals alone that did not enter, too: what is at work beside it is not in its
    place."""
    own = [other.hypothesis for other in entered]
    rivals = (rival for rival in one.rivals if not any(is_same(rival, other) for other in own))
    return replace(one, rivals=tuple(rivals))


def _as_good(one: Weighed, winner: Weighed, shared: float) -> bool:
    """Whether one explains the records as another cause does; of twins what tells them apart is a resonance, too."""
    behind = APART
    if _is_usual(one, winner):
        behind = max(behind, winner.log_bayes_factor - _needed(one, winner, shared))
    if one.hypothesis.is_twin_of(winner.hypothesis):
        behind = max(behind, (1.0 - NEARLY) * winner.log_bayes_factor)
    return (
        one.optimum is not None
        and one.log_bayes_factor > winner.log_bayes_factor - behind
        and not is_same(one.hypothesis, winner.hypothesis)
        and not _same_cause(one.hypothesis, winner.hypothesis)
    )


def _left(*weighed: Weighed) -> float:
    """The most that any of their fits still promises [nats]."""
    return min(max((one.optimum.left for one in weighed if one.optimum), default=0.0), MOST_LEFT)


def is_same(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses move the same unknowns."""
    return any(a.key == b.key and (a.at is None or b.at is None or a.at == b.at) for a in one.wide for b in other.wide)


def is_like(one: Hypothesis, entered: Hypothesis) -> bool:
    """Whether one has nothing to add to what entered: the same unknowns, or those of its rare counterpart, which would
    share between them what either explains."""
    return is_same(one, entered) or one.gives_way_to(entered)


def _same_cause(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses are an effect in the same part, by other unknowns: not one tooth or another."""
    whole = all(wide.at is None for wide in (*one.wide, *other.wide))
    return whole and one.effect == other.effect and one.on == other.on
