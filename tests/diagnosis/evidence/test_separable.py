"""Which effects records cannot tell apart, against marginal likelihoods of drawn data."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.diagnosis.effects.eccentricity import ECCENTRICITY
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.friction import FRICTION
from gearbench.diagnosis.effects.sensor_delay import SENSOR_DELAY
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.separable import alike, expected_factors, groups_of
from gearbench.diagnosis.forces.unknowns import group, unknowns_of

SMALL = unknowns_of(
    [
        group("offset", "m", 2, 1.0, slot="offset"),
        group("lobe", "m", 2, 0.1, 1.0, slot="loss"),
        group("rub", "1", 1, 0.1, 1.0, slot="friction"),
        group("lag", "s", 1, 0.1, 1.0, slot="delay"),
    ],
    teeth=0,
)
LOBE = Hypothesis("eccentricity", "mesh", (Wide("lobe"),), (), 2, effect=ECCENTRICITY)
RUB = Hypothesis("friction", "mesh", (Wide("rub"),), effect=FRICTION)
LAG = Hypothesis("sensor-delay", "sensor", (Wide("lag"),), effect=SENSOR_DELAY)


def fit_of(columns: np.ndarray) -> Fit:
    nothing, sd = np.zeros(SMALL.size), SMALL.prior()
    information = columns.T @ columns
    return Fit(nothing, sd, information + np.diag(1 / sd**2), information, nothing, (), 0.0, 0.0, 0)


def log_likelihood(data: np.ndarray, columns: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """Of data (draws, n), unknowns integrated out."""
    covariance = np.eye(len(columns)) + (columns * sd**2) @ columns.T
    square = np.einsum("dn,dn->d", data, np.linalg.solve(covariance, data.T).T)
    return -0.5 * square - 0.5 * np.linalg.slogdet(covariance)[1]


@pytest.mark.parametrize("truth", [LOBE, RUB])
def test_expected_factors_are_means_of_marginal_likelihoods(truth: Hypothesis) -> None:
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((12, SMALL.size)) * np.array([1, 1, 3, 3, 2, 2])
    beyond = np.sqrt(truth.prior(SMALL) ** 2 - SMALL.prior() ** 2)
    drawn = rng.standard_normal((40_000, SMALL.size)) * beyond
    data = drawn @ columns.T + rng.standard_normal((40_000, 12))
    plain = log_likelihood(data, columns, SMALL.prior())
    listed = (LOBE, RUB, LAG)
    wanted = [
        np.mean(log_likelihood(data, columns, h.prior(SMALL)) - plain) - np.log(h.choices) for h in listed
    ]
    got = expected_factors(fit_of(columns), SMALL, listed)[listed.index(truth)]
    assert got == pytest.approx(wanted, abs=0.15, rel=0.02)


def test_what_moves_the_residuals_alike_cannot_be_told_apart() -> None:
    columns = np.diag([1.0, 1.0, 30.0, 30.0, 30.0, 0.0])
    columns[:, 5] = columns[:, 4] + 1e-3
    assert alike(fit_of(columns), SMALL, (LOBE, RUB, LAG)) == (("friction", "sensor-delay"),)


def test_what_moves_other_residuals_or_none_is_told_apart() -> None:
    assert alike(fit_of(np.diag([1.0, 1.0, 30.0, 30.0, 30.0, 30.0])), SMALL, (LOBE, RUB, LAG)) == ()
    assert alike(fit_of(np.diag([1.0, 1.0, 30.0, 30.0, 30.0, 0.01])), SMALL, (LOBE, RUB, LAG)) == ()


def test_groups_hold_only_what_each_explains_of_each() -> None:
    """A chain of neighbours is no group: its ends can be told apart."""
    pairs = [("a", "b"), ("b", "c"), ("c", "d"), ("b", "d")]
    beside = {one: {y if x == one else x for x, y in pairs if one in (x, y)} for one in "abcde"}
    assert groups_of("abcde", beside) == [("a", "b"), ("b", "c", "d"), ("e",)]
