"""Conditioning on a window's rows, against least squares with weighted features and against the likelihood's slope."""

import numpy as np
import pytest

from gearbench.identification.smooth.posterior import Equations, Sizes, conditioned, first_sizes, refined

BANDWIDTH = 9.0
SIZES = Sizes(np.array([0.3, 2.0, 0.5]), 0.04)


def equations(rows: int = 60, seed: int = 0) -> Equations:
    """Random rows of three branches."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((rows, 3)) + 1j * rng.standard_normal((rows, 3))
    offset = np.sort(rng.uniform(-12.0, 12.0, rows))
    data = rng.standard_normal(rows) + 1j * rng.standard_normal(rows)
    return Equations(data, columns, offset, 1)


def features(offset: np.ndarray) -> np.ndarray:
    """Transforms of pulses at the lags x / (2 pi B) of Gauss and Laguerre: their mean square is exp(-x)."""
    lag, weight = np.polynomial.laguerre.laggauss(40)
    return np.sqrt(weight) * np.exp(-1j * np.outer(offset, lag) / BANDWIDTH)


def test_conditioning_is_least_squares_with_weighted_features() -> None:
    """Impulse responses with variances that die away, found by ridge regression: mean, variance and evidence."""
    given = equations()
    pulses, at = features(given.offset), np.array([-3.0, 0.5])
    count = pulses.shape[1]
    full = (given.columns[:, :, None] * pulses[:, None, :]).reshape(given.data.size, -1)
    prior = np.repeat(SIZES.functions, count)
    covariance = np.linalg.inv(full.conj().T @ full / SIZES.noise + np.diag(1.0 / prior))
    mean = (covariance @ full.conj().T @ given.data / SIZES.noise).reshape(3, count)
    found = conditioned(given, SIZES, BANDWIDTH)
    assert found.mean(at) == pytest.approx(features(at) @ mean.T, rel=1e-5, abs=1e-6)
    for offset in at:
        pulse = features(np.array([offset]))[0]
        blocks = covariance.reshape(3, count, 3, count)
        wanted = [float((pulse @ blocks[branch, :, branch] @ pulse.conj()).real) for branch in range(3)]
        assert found.variance(float(offset))[0] == pytest.approx(wanted, rel=1e-5)
    total = (full * prior) @ full.conj().T + SIZES.noise * np.eye(given.data.size)
    evidence = -np.linalg.slogdet(total)[1] - np.vdot(given.data, np.linalg.solve(total, given.data)).real
    assert found.evidence == pytest.approx(evidence, rel=1e-6)
    assert found.determined == pytest.approx(np.trace(full @ covariance @ full.conj().T).real / SIZES.noise, rel=1e-6)


def test_part_of_the_variance_that_is_noise() -> None:
    """The mean is linear in the data: what noise of a known variance makes of it."""
    given = equations()
    found = conditioned(given, SIZES, BANDWIDTH)
    reach = np.eye(given.data.size)
    answers = [
        conditioned(Equations(one.astype(complex), given.columns, given.offset, 1), SIZES, BANDWIDTH).mean(np.zeros(1))
        for one in reach
    ]
    wanted = SIZES.noise * np.sum(np.abs(np.array(answers)[:, 0]) ** 2, axis=0)
    assert found.variance(0.0)[1] == pytest.approx(wanted, rel=1e-9)


def test_sizes_end_where_the_likelihood_is_stationary() -> None:
    drawn = equations(200, 1)
    rng = np.random.default_rng(2)
    pulses = features(drawn.offset)
    branches = np.sqrt(SIZES.functions) * (pulses @ rng.standard_normal((pulses.shape[1], 3)))
    noise = np.sqrt(SIZES.noise / 2) * (rng.standard_normal(200) + 1j * rng.standard_normal(200))
    given = Equations((drawn.columns * branches).sum(axis=1) + noise, drawn.columns, drawn.offset, 1)
    found = refined(given, first_sizes(given), BANDWIDTH, 200)
    assert found.sizes.noise == pytest.approx(SIZES.noise, rel=0.25)
    for place in range(4):
        slope = 0.0
        for sign in (1.0, -1.0):
            factor = np.ones(4)
            factor[place] = np.exp(sign * 1e-3)
            moved = Sizes(found.sizes.functions * factor[:3], found.sizes.noise * factor[3])
            slope += sign * conditioned(given, moved, BANDWIDTH).evidence / 2e-3
        assert abs(slope) < 1e-3 * given.data.size
