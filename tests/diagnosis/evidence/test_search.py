"""What a hypothesis can gain at most, and its size, in linear models whose evidence is known."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.evidence.fit import Fit, root_of
from gearbench.diagnosis.evidence.search import relative_size, relief
from gearbench.diagnosis.forces.unknowns import group, unknowns_of

WHERE = unknowns_of([group("offset", "m", 2, 1.0, slot="offset"), group("lobe", "m", 3, 0.1, 1.0, slot="loss")], 0)
LOBE = Hypothesis("eccentricity", "mesh", (Wide("lobe"),))


def fit_of(columns: np.ndarray, data: np.ndarray, sd: np.ndarray) -> Fit:
    """Fit of data (n,) = columns (n, P) unknowns + unit noise, with the log of its marginal likelihood."""
    information = columns.T @ columns
    precision = information + np.diag(sd**-2.0)
    p = np.linalg.solve(precision, columns.T @ data)
    covariance = np.eye(len(data)) + (columns * sd**2) @ columns.T
    evidence = -0.5 * data @ np.linalg.solve(covariance, data) - 0.5 * np.linalg.slogdet(covariance)[1]
    return Fit(p, sd, precision, information, columns.T @ data, (), 0.0, float(evidence), 1)


@pytest.mark.parametrize("seed", range(8))
def test_no_refit_gains_more_than_its_prior_relieves(seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns = 4 * rng.standard_normal((9, 5))
    truth = np.array([0.5, -1.0, *(rng.standard_normal(3) * rng.choice([0.1, 1.0]))])
    data = columns @ truth + rng.standard_normal(9)
    narrow, wide = WHERE.prior(), LOBE.prior(WHERE)
    base, fit = fit_of(columns, data, narrow), fit_of(columns, data, wide)
    bound = relief(WHERE, LOBE, fit)
    assert fit.log_evidence - base.log_evidence < bound
    assert bound == pytest.approx(0.5 * (fit.p[2:] ** 2).sum() * (1 / 0.01 - 1))


def test_size_counts_what_the_records_tell() -> None:
    columns = np.zeros((4, 5))
    columns[[0, 1, 2], [0, 1, 2]] = (1.0, 1.0, 50.0)  # of the lobe only its first part shows
    fit = fit_of(columns, np.array([0.0, 0.0, 30.0, 0.0]), LOBE.prior(WHERE))
    assert relative_size(WHERE, LOBE, fit) == pytest.approx(0.6 / 0.1, rel=0.01)


def test_a_precision_that_rounding_spoils_still_has_a_root() -> None:
    column = np.array([1.0, 1.0, 1.0])
    spoiled = 1e17 * np.outer(column, column) + np.eye(3)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(spoiled)
    root = root_of(spoiled)
    assert np.allclose(root @ root.T, spoiled, rtol=1e-6)
    well = np.diag([4.0, 9.0])
    assert np.array_equal(root_of(well), np.diag([2.0, 3.0]))
