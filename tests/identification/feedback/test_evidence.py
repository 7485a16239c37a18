"""Roots of matrices that rounding has left indefinite."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.identification.feedback.evidence import EXACT, Evident, Marginal, _root


def test_a_matrix_that_rounding_left_indefinite_has_the_root_of_what_it_tells() -> None:
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((30, 12)) * np.geomspace(1.0, 1e8, 12)
    columns[:, 5] = columns[:, 4] * 10.0
    total = columns.T @ columns
    size = np.sqrt(np.diagonal(total))
    total[5, 5] *= 1.0 - 1e-13
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(total / np.outer(size, size))
    root = _root(total)
    assert np.allclose(np.triu(root, 1), 0.0) and (np.diagonal(root) > 0.0).all()
    assert np.abs((root @ root.T - total) / np.outer(size, size)).max() < 30 * EXACT
    fine = total + np.diag(size**2)
    assert _root(fine) == pytest.approx(np.linalg.cholesky(fine), rel=1e-9)


def test_a_record_without_noise_has_an_evidence() -> None:
    """Two amplitudes that do the same, of which rounding leaves less than nothing."""
    gram = np.array([[1.0, 1.0], [1.0, 1.0 - 1e-14]])
    error = Marginal(gram, np.array([1.0, 1.0]), 1.0, 100.0)
    found = Evident.of(error, np.full(2, 1e-3), 1e-20)
    assert np.isfinite(found.value) and found.amplitudes.sum() == pytest.approx(1.0, abs=1e-6)
