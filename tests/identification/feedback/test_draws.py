"""Parameters drawn from a covariance scatter as it says, however far apart their sizes are."""

import numpy as np

from gearbench.identification.feedback.result import DRAWS, STEP, drawn_steps, followed


def test_variances_far_apart_do_not_drown_each_other() -> None:
    """Splines above the excited band have no data and variances of 1e12 beside 1e-8 of the mesh's harmonics."""
    count = 60
    size = np.tile([1e6, 1e-4], count // 2)
    mixed = np.random.default_rng(4).standard_normal((count, count)) + 3 * np.eye(count)
    correlation = mixed @ mixed.T
    diagonal = np.sqrt(np.diagonal(correlation))
    covariance = size[:, None] * (correlation / diagonal / diagonal[:, None]) * size
    steps = drawn_steps(covariance) / STEP / size
    assert steps.shape == (DRAWS, count)
    # 30 parameters of 16 draws each: their mean square is within a few tenths of 1.
    for part in (steps[:, ::2], steps[:, 1::2]):
        assert 0.7 < np.mean(part**2) < 1.4


def test_correlated_parameters_move_together() -> None:
    covariance = np.outer([1e6, -1e-4, 2.0], [1e6, -1e-4, 2.0])
    steps = drawn_steps(covariance) / STEP
    assert np.allclose(steps[:, 0] * 1e-6, -steps[:, 1] * 1e4, rtol=0, atol=1e-6)
    assert np.allclose(steps[:, 0] * 1e-6, steps[:, 2] / 2.0, rtol=0, atol=1e-6)


def test_lines_that_are_followed_are_dense_where_they_begin() -> None:
    found = followed(np.arange(5, 3005))
    assert list(found[:9]) == [5, 6, 7, 9, 13, 21, 37, 69, 80]
    assert found[-1] == 3004
    assert np.diff(found).max() <= 75
    assert list(followed(np.arange(3, 9))) == [3, 4, 5, 6, 7, 8]
