"""Which of the effects that entered are needed: beside the others, and beside what a good rig has of them.

The quadratic promises what a rig without an effect would lose. Where that is little it may be the fit that was on its
way when the effect entered, and gained what had nothing to do with it: then a rig with no more of it than a good one
has is fitted to the end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.profile_error import uneven
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.closeness import better
from gearbench.diagnosis.fitting.fit import Optimum, cost_of, fit, fit_afresh
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.selection.weighing import Weighed, beyond, entering, has_own
from gearbench.diagnosis.simulation.jacobian import FOLLOWED
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Report = Callable[[str], None]

CLEAR = 50.0  # nats promised from which an effect is needed
SAME = 4.0  # nats up to which a good rig explains the records as well
# Standard deviations of the background from which an effect of one number is one though a good rig would explain the
# records as well, if it could have as much: of rigs with twice a good one's share one in thirty has that.
FAR, TWICE, RARE = 4.0, 2.0, 0.03
RENEWALS = 4


def needed(
    simulator: Simulator,
    base: Optimum,
    best: Optimum,
    entered: Sequence[Weighed],
    report: Report = lambda step: None,
    *,
    apart: bool,
) -> tuple[Optimum, tuple[Weighed, ...]]:
    """The optimum without those of the effects that entered that the others make needless, and the ones that stay, each
    with what it is worth by the quadratic: the least first, as a fit without it must bear out. Of two that stand in for
    each other one stays; without a number that is far from the nominal one the quadratic promises what no fit keeps."""
    stay, borne_out = list(entered), set[str]()
    while len(entered) > 1:
        stay = [one if one.hypothesis.name in borne_out else _promised(simulator, best, one) for one in stay]
        open_yet = (one for one in stay if one.hypothesis.name not in borne_out)
        one = min(open_yet, key=lambda one: beyond(simulator.layout.unknowns, one, apart), default=None)
        if one is None or _enters(simulator, one, apart):
            break
        rest = [other for other in stay if other is not one]
        report(f"simulating: without {one.hypothesis.name}")
        without = (_refitted(simulator, base, best, rest) or best) if rest else base
        now = replace(one, log_bayes_factor=_worth(one, best, without))
        if without is not best and _enters(simulator, now, apart):
            borne_out.add(one.hypothesis.name)
            stay = [now if other is one else other for other in stay]
        else:
            best, stay = without, rest
    kept = (entering(simulator.layout.unknowns, one, apart) for one in stay)
    return best, tuple(one for one in kept if one is not None)


def _enters(simulator: Simulator, one: Weighed, apart: bool) -> bool:
    return entering(simulator.layout.unknowns, one, apart) is not None


def _worth(one: Weighed, best: Optimum, without: Optimum) -> float:
    """Log Bayes factor of an effect by the optima with and without it."""
    return best.evidence - without.evidence - float(np.log(one.hypothesis.choices))


def _promised(simulator: Simulator, best: Optimum, one: Weighed) -> Weighed:
    """An effect with what it is worth by the quadratic. One that is not felt where it is, as flanks that part over a
    wider gap are not, keeps its worth; what is not felt of one is no more than a good rig may have."""
    unknowns, quadratic = simulator.layout.unknowns, best.sensitivity.quadratic
    at = one.hypothesis.entries(unknowns)
    felt = np.isin(at, quadratic.active)
    if not felt.any():
        return one
    sd, p = best.sd.copy(), best.p.copy()
    sd[at], p[at[~felt]] = prior_of(simulator, unknowns.prior())[at], 0.0
    _, cost, information = quadratic.best(p, sd, _bounds_at(unknowns, best, sd))
    return replace(one, log_bayes_factor=best.evidence - quadratic.evidence(cost, information, sd))


def held_against_background(
    simulator: Simulator,
    base: Optimum,
    best: Optimum,
    kept: Sequence[Weighed],
    report: Report = lambda step: None,
    *,
    apart: bool,
) -> tuple[Optimum, Optimum, tuple[Weighed, ...]]:
    """The background's optimum, that with effects, and those of the effects `kept` that stay, with what they are worth:
    each that is not clear, the least first, against a rig that has no more of it than a good one."""
    unknowns, stay = simulator.layout.unknowns, list(kept)
    for one in sorted(kept, key=lambda one: one.log_bayes_factor):
        if one.log_bayes_factor >= CLEAR:
            break
        rest = [other for other in stay if other is not one]
        report(f"simulating: no more than a good rig has of {one.hypothesis.name}")
        without = _refitted(simulator, base, best, rest)
        if without is None:
            continue
        if without.misfit < best.misfit:
            # Fitted on, it came to a better rig: the effect is worth what it is beside that.
            best = better(best, fit(simulator, without.p, best.sd, without.sensitivity, renewals=1))
        now = entering(unknowns, replace(one, log_bayes_factor=_worth(one, best, without)), apart)
        if now is None or _is_background(unknowns, one.hypothesis, best, without):
            best, stay = without, rest
            base = base if rest else better(base, without)
        else:
            stay = [now if other is one else other for other in stay]
    return base, best, tuple(stay)


def _refitted(simulator: Simulator, base: Optimum, best: Optimum, kept: Sequence[Weighed]) -> Optimum | None:
    """As `beside`, fitted to the end."""
    without = beside(simulator, base, best, kept)
    return fit_afresh(simulator, without.p, without.sd, renewals=RENEWALS) if without else None


def beside(simulator: Simulator, base: Optimum, best: Optimum, kept: Sequence[Weighed]) -> Optimum | None:
    """The optimum near `best` with only these effects wide, the others no larger than in the background `base`; None
    where that is no rig. It is begun where the quadratic has it, or where all else stays as it is."""
    unknowns, sd = simulator.layout.unknowns, base.sd
    for one in kept:
        sd = one.hypothesis.widened(unknowns, sd)
    # What is no wider than before stays where it is, however far a fit led it.
    within = np.where(sd < best.sd, np.clip(best.p, -3.0 * sd, 3.0 * sd), best.p)
    begin = np.where(sd > 0.0, within, 0.0)
    quadratic, promised = best.sensitivity.quadratic, begin.copy()
    step, _, _ = quadratic.best(best.p, sd, _bounds_at(unknowns, best, sd))
    promised[quadratic.active] = best.p[quadratic.active] + step
    nearer = min((begin, promised), key=lambda p: cost_of(simulator, p, sd))
    return fit(simulator, nearer, sd, best.sensitivity)


def _is_background(unknowns: Unknowns, one: Hypothesis, best: Optimum, without: Optimum) -> bool:
    """Whether a good rig explains the records as well, by not much more than good rigs have."""
    far = far_of(len(one.entries(unknowns)))
    return has_own(unknowns, one) and without.misfit - best.misfit < SAME and size_of(unknowns, one, best.p) < far


def far_of(count: int) -> float:
    """Rms in standard deviations of the background from which an effect of so many numbers is one: many that are each
    three times a good rig's share are no chance, where one of four may be."""
    return min(FAR, TWICE * float(np.sqrt(2.0 * gammaincinv(count / 2, 1.0 - RARE) / count)))


def size_of(unknowns: Unknowns, one: Hypothesis, p: Array, told: Array | None = None) -> float:
    """Rms of an effect's unknowns, of all (size,), in standard deviations of the background, each with the weight
    `told` (entries,). Flanks that stand back everywhere have no error of form, and a driven angle that is early no
    delay: simulations follow it, so that whatever is wrong behind the gear may seem to be."""
    at = one.entries(unknowns)
    values = uneven(unknowns, p)[at]
    if any(wide.key == FOLLOWED for wide in one.wide):
        values = np.maximum(values, 0.0)
    return float(np.sqrt(np.average((values / unknowns.prior()[at]) ** 2, weights=told)))


def _bounds_at(unknowns: Unknowns, best: Optimum, sd: Array) -> tuple[Array, Array]:
    """Bounds that hold at zero what had a prior in `best` and has none in `sd` (size,)."""
    low, high = unknowns.bounds()
    gone = (sd == 0.0) & (best.sd > 0.0)
    return np.where(gone, 0.0, low), np.where(gone, 0.0, high)
