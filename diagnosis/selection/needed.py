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

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.profile_error import uneven
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.closeness import better
from gearbench.diagnosis.fitting.fit import Optimum, fit, fit_afresh
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.selection.weighing import Weighed, entering, has_own
from gearbench.diagnosis.simulation.jacobian import FOLLOWED
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Report = Callable[[str], None]

CLEAR = 50.0  # nats promised from which an effect is needed
SAME = 4.0  # nats up to which a good rig explains the records as well
# Standard deviations of the background from which an effect is one though a good rig would explain the records as well,
# if it could have as much.
FAR = 4.0
RENEWALS = 4


def needed(simulator: Simulator, best: Optimum, entered: Sequence[Weighed], apart: bool) -> tuple[Weighed, ...]:
    """Each of the effects that entered that the others do not make needless, with what it is worth by the quadratic.
    One that is not felt where it is, as flanks that part over a wider gap are not, keeps its worth."""
    unknowns, kept = simulator.layout.unknowns, list[Weighed | None]()
    for one in entered:
        sd = best.sd.copy()
        at = one.hypothesis.entries(unknowns)
        if not np.isin(at, best.sensitivity.quadratic.active).any():
            kept.append(one)
            continue
        sd[at] = prior_of(simulator, unknowns.prior())[at]
        p = np.where((sd > 0.0) | (best.sd == 0.0), best.p, 0.0)
        quadratic = best.sensitivity.quadratic
        _, cost, information = quadratic.best(best.p, sd, _bounds_at(unknowns, p, best.p, sd))
        worth = best.evidence - quadratic.evidence(cost, information, sd)
        now = replace(one, log_bayes_factor=float(worth) if len(entered) > 1 else one.log_bayes_factor)
        kept.append(entering(unknowns, now, apart))
    return tuple(one for one in kept if one is not None)


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
        without = beside(simulator, base, best, rest)
        without = fit_afresh(simulator, without.p, without.sd, renewals=RENEWALS) if without else None
        if without is None:
            continue
        if without.misfit < best.misfit:
            # Fitted on, it came to a better rig: the effect is worth what it is beside that.
            best = better(best, fit(simulator, without.p, best.sd, without.sensitivity, renewals=1))
        worth = best.evidence - without.evidence - float(np.log(one.hypothesis.choices))
        now = entering(unknowns, replace(one, log_bayes_factor=worth), apart)
        if now is None or _is_background(unknowns, one.hypothesis, best, without):
            best, stay = without, rest
            base = base if rest else better(base, without)
        else:
            stay = [now if other is one else other for other in stay]
    return base, best, tuple(stay)


def beside(simulator: Simulator, base: Optimum, best: Optimum, kept: Sequence[Weighed]) -> Optimum | None:
    """The optimum near `best` with only these effects wide, the others no larger than in the background `base`; None
    where that is no rig."""
    sd = base.sd
    for one in kept:
        sd = one.hypothesis.widened(simulator.layout.unknowns, sd)
    p = np.where(sd > 0.0, np.clip(best.p, -3.0 * sd, 3.0 * sd), 0.0)
    return fit(simulator, p, sd, best.sensitivity)


def _is_background(unknowns: Unknowns, one: Hypothesis, best: Optimum, without: Optimum) -> bool:
    """Whether a good rig explains the records as well, by not much more than good rigs have."""
    return has_own(unknowns, one) and without.misfit - best.misfit < SAME and size_of(unknowns, one, best.p) < FAR


def size_of(unknowns: Unknowns, one: Hypothesis, p: Array, told: Array | None = None) -> float:
    """Rms of an effect's unknowns, of all (size,), in standard deviations of the background, each with the weight
    `told` (entries,). Flanks that stand back everywhere have no error of form, and a driven angle that is early no
    delay: simulations follow it, so that whatever is wrong behind the gear may seem to be."""
    at = one.entries(unknowns)
    values = uneven(unknowns, p)[at]
    if any(wide.key == FOLLOWED for wide in one.wide):
        values = np.maximum(values, 0.0)
    return float(np.sqrt(np.average((values / unknowns.prior()[at]) ** 2, weights=told)))


def _bounds_at(unknowns: Unknowns, wanted: Array, here: Array, sd: Array) -> tuple[Array, Array]:
    """Bounds that hold at `wanted` what has no prior."""
    low, high = unknowns.bounds()
    fixed = (sd == 0.0) & (wanted != here)
    return np.where(fixed, wanted, low), np.where(fixed, wanted, high)
