"""What the records cannot tell apart: effects whose traces other effects explain as well.

From the information matrix of a fit alone: if an effect of its usual size were in the rig, by how much would the
evidence of each hypothesis rise? Nothing is simulated, and what was measured decides only through the weights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.fit import Fit, Problem
from gearbench.diagnosis.evidence.hypotheses import Hypothesis, library
from gearbench.diagnosis.forces.parameters import Layout

Array = NDArray[np.float64]

APART = 3.0  # nats by which the right effect should come out ahead of another


def representatives(problem: Problem, without: Sequence[str] = ()) -> tuple[Hypothesis, ...]:
    """The library with one cracked tooth of each gear for all of them."""
    first = problem.where["crack"].start
    kept = (first, first + problem.machine.teeth[0])
    return tuple(h for h in library(problem.where, tuple(without)) if not h.entries or h.entries[0] in kept)


def expected_gains(fit: Fit, where: Layout, hypotheses: Sequence[Hypothesis]) -> Array:
    """Expected log evidence (truth, hypotheses) over the background's when one hypothesis after the other is true.

    The truth's unknowns are drawn from its wide prior beyond its narrow one, the records' noise from what the fit takes
    for it: with I the information and C the posterior covariance under a prior, the mean of pull' C pull / 2 is
    trace(C (I W I + I)) / 2 for a truth of covariance W.
    """
    information, narrow = fit.information, where.prior()
    plain, plain_evidence = _posterior(information, narrow)
    changes, evidences = [], []
    for hypothesis in hypotheses:
        covariance, evidence = _posterior(information, hypothesis.prior(where))
        changes.append(information @ (covariance - plain) @ information)
        noise = 0.5 * float(np.sum((covariance - plain) * information))
        evidences.append(evidence - plain_evidence + noise - np.log(hypothesis.choices))
    truths = np.stack([h.prior(where) ** 2 - narrow**2 for h in hypotheses])
    return np.asarray(0.5 * truths @ np.stack([np.diag(c) for c in changes]).T + np.array(evidences))


def _posterior(information: Array, sd: Array) -> tuple[Array, float]:
    """Posterior covariance (P, P) under prior standard deviations `sd` (P,), and the evidence's constant part."""
    scaled = information * sd[:, None] * sd[None, :] + np.eye(len(sd))
    covariance = np.linalg.inv(scaled) * sd[:, None] * sd[None, :]
    return covariance, -0.5 * float(np.linalg.slogdet(scaled)[1])


def alike(
    fit: Fit, where: Layout, hypotheses: Sequence[Hypothesis], limits: Limits = LIMITS
) -> tuple[tuple[str, ...], ...]:
    """Effects that these records cannot tell apart, in groups, under the weights of a fit.

    An effect without weight is in no group: bins in which nothing is heard have none, and silence there tells.
    """
    gains = expected_gains(fit, where, hypotheses)
    effects = [h.effect for h in hypotheses]
    needed = np.array([limits.of(effect) for effect in effects])
    names = tuple(dict.fromkeys(effects))
    groups: dict[str, set[str]] = {name: {name} for name in names}
    for truth in np.flatnonzero(np.diag(gains) > needed):
        for other in np.flatnonzero(gains[truth] > np.maximum(gains[truth, truth] - APART, needed)):
            joined = groups[effects[truth]] | groups[effects[other]]
            for name in joined:
                groups[name] = joined
    ordered = dict.fromkeys(tuple(name for name in names if name in groups[first]) for first in names)
    return tuple(group for group in ordered if len(group) > 1)
