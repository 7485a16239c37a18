"""Predicted variances against the scatter of repeated noisy identifications."""

import numpy as np
import pytest
from shared.ptv import periodic_filter, spectra_of

from gearbench.identification.lpm import LpmResult, local_polynomial
from gearbench.identification.periodic import itf_from_htf
from gearbench.identification.regression import Window

RUNS = 150
NOISE = 0.3
# Away from frequency 0, around which rows mirror each other and the prediction is on the safe side.
LINES = np.arange(170, 210, 5)


def repeated(window: Window, experiments: int, period: int) -> tuple[list[LpmResult], np.ndarray]:
    """Identifications of one system with one set of inputs and RUNS draws of white noise; true HTF."""
    system = periodic_filter(1, period)
    rng = np.random.default_rng(1)
    force = rng.standard_normal((experiments, 1024))
    clean = system.response(force)
    results = []
    for _ in range(RUNS):
        noisy = clean + NOISE * rng.standard_normal(clean.shape)
        results.append(local_polynomial(spectra_of(force, noisy, 1024 // period), LINES, window))
    return results, system.htf(LINES / 1024, window.harmonics)


@pytest.mark.parametrize(
    ("experiments", "period", "transient"),
    [(4, 16, False), (4, 128, False), (1, 64, True)],  # d = 64 > 2n+1; d = 8, overlapping windows; one record
)
def test_variances_are_those_of_the_errors(experiments: int, period: int, transient: bool) -> None:
    window = Window(2, 1, 5 if experiments > 1 else 12, transient)
    results, truth = repeated(window, experiments, period)
    error = np.array([r.htf for r in results]) - truth
    actual = np.mean(np.abs(error) ** 2, axis=0)
    predicted = np.mean([r.htf_variance for r in results], axis=0)
    ratio = actual / predicted
    # A mean of RUNS squared moduli scatters by 1 / sqrt(RUNS) = 8 %.
    assert ratio.mean() == pytest.approx(1.0, abs=0.04)
    assert np.abs(ratio - 1).max() < 5 / np.sqrt(RUNS)

    itf_error = np.array([itf_from_htf(e, 8) for e in error])
    actual = np.mean(np.abs(itf_error) ** 2, axis=0)
    predicted = np.mean([r.itf_variance(8) for r in results], axis=0)
    ratio = actual / predicted
    assert ratio.mean() == pytest.approx(1.0, abs=0.04)
    assert np.abs(ratio - 1).max() < 5 / np.sqrt(RUNS)
    assert results[0].cross_terms == ("none" if period == 16 else "exact")


def test_residual_tells_the_noise() -> None:
    results, _ = repeated(Window(2, 1, 5, transient=False), 4, 64)
    system = periodic_filter(1, 64)
    force = np.random.default_rng(1).standard_normal((4, 1024))
    size = np.hypot(system.response(force).std(), NOISE)
    assert np.mean([r.residual for r in results]) == pytest.approx(NOISE / size, rel=0.05)
