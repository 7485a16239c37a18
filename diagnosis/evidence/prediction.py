"""What hypotheses promise before they are refitted: by the quadratic that a fit found for the data's cost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.evidence.fit import Fit, root_of
from gearbench.diagnosis.forces.unknowns import Unknowns

Array = NDArray[np.float64]


def starts(hypothesis: Hypothesis, unknowns: Unknowns) -> tuple[Array, ...]:
    """Departures (size,) from the background's fit to begin from, for effects whose influence is far from linear."""
    if hypothesis.effect is None:
        return ()
    key = hypothesis.wide[0].key
    out = []
    for value in hypothesis.effect.starts(unknowns.group(key)):
        move = np.zeros(unknowns.size)
        move[unknowns[key].start] = value
        out.append(move)
    return tuple(out)


def predicted_evidence(fit: Fit, sd: Array) -> float:
    """Log evidence under other priors `sd` (size,), by the quadratic that the fit found for the data alone."""
    scaled = fit.information * sd[:, None] * sd[None, :] + np.eye(len(sd))
    factor = root_of(scaled)
    half = np.linalg.solve(factor, sd * fit.pull)
    return 0.5 * float(half @ half) - float(np.log(np.diag(factor)).sum())


def predicted_factors(fit: Fit, unknowns: Unknowns, hypotheses: Sequence[Hypothesis]) -> Array:
    """Log Bayes factors (hypotheses,) over the background alone, as the fit's quadratic predicts them."""
    base = predicted_evidence(fit, unknowns.prior())
    out = [predicted_evidence(fit, h.prior(unknowns)) - base - np.log(h.choices) for h in hypotheses]
    return np.array(out)
