"""Which evidence the quadratic of a fit promises to hypotheses, in linear models whose evidence is known."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.prediction import predicted_evidence, predicted_factors
from gearbench.diagnosis.forces.unknowns import group, unknowns_of

SMALL = unknowns_of(
    [
        group("mass", "kg", ("a", "b"), 0.1, slot="mass"),
        group("runout", "m", 2, 1.0, 10.0, slot="offset", low=-3.0),
        group("tooth", "1", 3, 0.5, 5.0, slot="loss", low=0.0, high=0.9),
        group("more", "m", ("x",), 2.0, 20.0, slot="offset"),
    ],
    teeth=3,
)


def test_predicted_factors_of_a_linear_model() -> None:
    """Evidence of data = columns p + noise, by the dense covariance of the data."""
    turn = np.random.default_rng(7)
    columns = turn.standard_normal((60, SMALL.size))
    p = np.array([0.05, -0.1, 12.0, -9.0, 0.2, 0.1, 0.3, 15.0])
    data = columns @ p + turn.standard_normal(60)

    def evidence(sd: np.ndarray) -> float:
        covariance = np.eye(60) + columns @ np.diag(sd**2) @ columns.T
        return -0.5 * float(data @ np.linalg.solve(covariance, data)) - 0.5 * float(np.linalg.slogdet(covariance)[1])

    sd = SMALL.prior()
    information = columns.T @ columns
    precision = information + np.diag(1 / sd**2)
    best = np.linalg.solve(precision, columns.T @ data)
    fit = Fit(best, sd, precision, information, columns.T @ data, (), 0.0, 0.0, 1)
    tried = (
        Hypothesis("run-out", "mesh", (Wide("runout"), Wide("more"))),
        Hypothesis("tooth", "mesh", (Wide("tooth", 1),), (), 3),
    )
    found = predicted_factors(fit, SMALL, tried)
    base = evidence(sd)
    assert found[0] == pytest.approx(evidence(tried[0].prior(SMALL)) - base)
    # One tooth is picked out of three.
    assert found[1] == pytest.approx(evidence(tried[1].prior(SMALL)) - base - np.log(3))
    assert found[0] > 10 > 0 > found[1]


def test_predicted_evidence_is_that_of_a_linear_model() -> None:
    rng = np.random.default_rng(5)
    columns, data = rng.standard_normal((40, 4)), rng.standard_normal(40) * 3
    narrow, wide = np.full(4, 0.2), np.array([0.2, 3.0, 0.2, 1.0])

    def exact(sd: np.ndarray) -> float:
        covariance = np.eye(40) + columns @ np.diag(sd**2) @ columns.T
        return -0.5 * float(data @ np.linalg.solve(covariance, data)) - 0.5 * float(np.linalg.slogdet(covariance)[1])

    information = columns.T @ columns
    precision = information + np.diag(1 / narrow**2)
    p = np.linalg.solve(precision, columns.T @ data)
    fit = Fit(p, narrow, precision, information, columns.T @ data, (), 0.0, 0.0, 1)
    got = predicted_evidence(fit, wide) - predicted_evidence(fit, narrow)
    assert got == pytest.approx(exact(wide) - exact(narrow), rel=1e-10)
