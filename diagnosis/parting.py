"""Backlash, which shows only where flanks part: judged on all records once the steady ones have had their say.

Where flanks part, impacts reach beyond the sampled band and fold back, and errors of the mesh law decide when the next
one comes: such records would lend evidence to whatever bends the mesh. Everything but backlash is therefore judged
where flanks stay together, and backlash by what it adds there to the best of the rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fit import Fit, Problem, refit, score
from gearbench.diagnosis.hypotheses import Hypothesis
from gearbench.diagnosis.search import STEPS, Search, Tried, relative_size

Array = NDArray[np.float64]

BACKLASH = "backlash"
STARTS = (25e-6, 60e-6, 110e-6)  # [m] normal


def with_backlash(whole: Problem, found: Search) -> Search:
    """What was found on the steady records with backlash, tried on all of them, added."""
    hypothesis = next(one.hypothesis for one in found.tried if one.hypothesis.effect == BACKLASH)
    base = refit(whole, found.base.sd, found.base.p, most=STEPS)
    rivals = [base.log_evidence]
    rest = tuple(one for one in found.tried if one.hypothesis is not hypothesis)
    best = next((one for one in rest if one.hypothesis.effect and one.gain > 0.0), None)
    if best is not None and best.fit is not None:
        rival = refit(whole, best.fit.sd, best.fit.p, most=STEPS)
        rivals.append(rival.log_evidence - float(np.log(best.hypothesis.choices)))
    fit = _widened(whole, base, hypothesis)
    one = Tried(hypothesis, fit.log_evidence - max(rivals), fit, relative_size(whole.where, hypothesis, fit))
    return Search(found.base, tuple(sorted((*rest, one), key=lambda tried: -tried.gain)))


def _widened(whole: Problem, base: Fit, hypothesis: Hypothesis) -> Fit:
    """The refit with backlash free, from where the cost is least."""
    sd, entry = hypothesis.prior(whole.where), whole.where[BACKLASH].start
    trials = [base.p]
    for more in STARTS:
        trial = base.p.copy()
        trial[entry] += more
        trials.append(trial)
    costs = [score(whole, trial, sd, base.factors)[0] for trial in trials]
    first = int(np.argmin(costs))
    return refit(whole, sd, trials[first], base.factors, most=STEPS)
