"""Windows that are many and large: variances are computed of some only, and no batch needs one of its own."""

from __future__ import annotations

import numpy as np
import pytest
from shared.ptv import periodic_filter, spectra_of

from gearbench.identification.lpm import estimate, gram
from gearbench.identification.lpm.regression import Window


def test_a_batch_without_a_variance_of_its_own_takes_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    force = rng.standard_normal((4, 1024))
    spectra = spectra_of(force, periodic_filter(1, 16).response(force) + 0.1 * rng.standard_normal(force.shape), 64)
    window, lines = Window(2, 1, 5, transient=False), np.arange(170, 230)
    every = estimate.local_polynomial(spectra, lines, window)
    monkeypatch.setattr(estimate, "VARIANCE_WORK", 1e4)  # of some dozen windows that of one
    monkeypatch.setattr(gram, "BATCH", 1)  # a window each
    some = estimate.local_polynomial(spectra, lines, window)
    np.testing.assert_allclose(some.htf, every.htf, rtol=1e-10, atol=1e-12)
    assert np.all(some.htf_variance > 0)
    assert np.median(some.htf_variance / every.htf_variance) == pytest.approx(1.0, rel=0.5)
