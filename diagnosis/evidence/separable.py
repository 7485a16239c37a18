"""What the records cannot tell apart: effects whose traces other effects explain as well.

From the information matrix of a fit alone: if an effect of its usual size were in the rig, by how much would the
evidence of each hypothesis rise? Nothing is simulated, and what was measured decides only through the weights.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.library import hypotheses as all_hypotheses
from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.rig.contract import rank_of

Array = NDArray[np.float64]

APART = 3.0  # nats by which the right effect should come out ahead of another


def representatives(problem: Problem, without: Sequence[str] = ()) -> tuple[Hypothesis, ...]:
    """The library with one cracked tooth of each gear for all of them."""
    return tuple(h for h in all_hypotheses(problem.model, without) if h.representative)


def expected_factors(fit: Fit, unknowns: Unknowns, hypotheses: Sequence[Hypothesis]) -> Array:
    """Expected log Bayes factors (truth, hypotheses) over the background when one hypothesis after the other is true.

    The truth's unknowns are drawn from its wide prior beyond its narrow one, the records' noise from what the fit takes
    for it: with I the information and C the posterior covariance under a prior, the mean of pull' C pull / 2 is
    trace(C (I W I + I)) / 2 for a truth of covariance W.
    """
    information, narrow = fit.information, unknowns.prior()
    plain, plain_evidence = _posterior(information, narrow)
    changes, evidences = [], []
    for hypothesis in hypotheses:
        covariance, evidence = _posterior(information, hypothesis.prior(unknowns))
        changes.append(information @ (covariance - plain) @ information)
        noise = 0.5 * float(np.sum((covariance - plain) * information))
        evidences.append(evidence - plain_evidence + noise - np.log(hypothesis.choices))
    truths = np.stack([h.prior(unknowns) ** 2 - narrow**2 for h in hypotheses])
    return np.asarray(0.5 * truths @ np.stack([np.diag(c) for c in changes]).T + np.array(evidences))


def _posterior(information: Array, sd: Array) -> tuple[Array, float]:
    """Posterior covariance (size, size) under prior standard deviations `sd` (size,), and the evidence's constant
    part."""
    scaled = information * sd[:, None] * sd[None, :] + np.eye(len(sd))
    covariance = np.linalg.inv(scaled) * sd[:, None] * sd[None, :]
    return covariance, -0.5 * float(np.linalg.slogdet(scaled)[1])


def alike(
    fit: Fit, unknowns: Unknowns, hypotheses: Sequence[Hypothesis], limits: Limits = LIMITS
) -> tuple[tuple[str, ...], ...]:
    """Effects that these records cannot tell apart, under the weights of a fit: all groups in which each explains what
    each other one leaves.

    An effect without weight is in no group: bins in which nothing is heard have none, and silence there tells.
    """
    factors = expected_factors(fit, unknowns, hypotheses)
    effects = [h.effect.name for h in hypotheses if h.effect]
    needed = np.array([limits.of(h.effect) for h in hypotheses if h.effect])
    names = sorted(set(effects), key=rank_of)
    explains: set[tuple[str, str]] = set()
    for truth in np.flatnonzero(np.diag(factors) > needed):
        others = np.flatnonzero(factors[truth] > np.maximum(factors[truth, truth] - APART, needed))
        explains |= {(effects[other], effects[truth]) for other in others}
    beside = {one: {other for other in names if {(one, other), (other, one)} <= explains} - {one} for one in names}
    return tuple(one for one in groups_of(names, beside) if len(one) > 1)


def groups_of(names: Sequence[str], beside: Mapping[str, set[str]]) -> list[tuple[str, ...]]:
    """The largest groups of names, in their order, of which each is `beside` each (Bron and Kerbosch 1973)."""
    found: list[tuple[str, ...]] = []

    def grow(group: tuple[str, ...], open_to: list[str], done: set[str]) -> None:
        if not open_to and not done:
            found.append(group)
        for number, one in enumerate(open_to):
            rest = [other for other in open_to[number + 1 :] if other in beside[one]]
            grow((*group, one), rest, (done | set(open_to[:number])) & beside[one])

    grow((), list(names), set())
    return found
