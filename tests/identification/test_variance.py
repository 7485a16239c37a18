"""Predicted variances against the scatter of repeated noisy identifications."""

from dataclasses import replace

import numpy as np
import pytest
from shared.ptv import periodic_filter, spectra_of

from gearbench.identification.lpm.covariance import CrossCovariance, diagonal_variance
from gearbench.identification.lpm.estimate import LpmResult, local_polynomial, needed_rows, plan_centres
from gearbench.identification.lpm.gram import grams
from gearbench.identification.lpm.local_solve import solve_windows
from gearbench.identification.lpm.regression import Window, prepare
from gearbench.identification.truth.periodic import itf_from_htf

RUNS = 150
NOISE = 0.3
# Away from frequency 0, around which rows mirror each other and the prediction is on the safe side.
LINES = np.arange(170, 210, 5)


def repeated(
    window: Window, experiments: int, period: int, runs: int = RUNS
) -> tuple[list[LpmResult], np.ndarray]:
    """Identifications of one system with one set of inputs and `runs` draws of white noise; true HTF."""
    system = periodic_filter(1, period)
    rng = np.random.default_rng(1)
    force = rng.standard_normal((experiments, 1024))
    clean = system.response(force)
    results = []
    for _ in range(runs):
        noisy = clean + NOISE * rng.standard_normal(clean.shape)
        results.append(local_polynomial(spectra_of(force, noisy, 1024 // period), LINES, window))
    return results, system.htf(LINES / 1024, window.harmonics)


@pytest.mark.parametrize(
    ("experiments", "period", "transient"),
    [
        pytest.param(4, 16, False, marks=pytest.mark.validation),  # d = 64 > 2n+1
        pytest.param(4, 128, False, marks=pytest.mark.validation),  # d = 8, overlapping windows
        pytest.param(1, 64, True, marks=pytest.mark.validation),  # one record
    ],
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


def test_itf_variance_of_overlapping_windows_by_brute_force() -> None:
    """Variance for unit noise on each line of each experiment, one line after another: the estimate is linear."""
    force = np.random.default_rng(2).standard_normal((2, 128))
    window, lines, phases = Window(3, 1, 12, transient=False), np.arange(40, 44), 8
    spectra = spectra_of(force, np.zeros_like(force), 2)
    regression = prepare(spectra, transient=False, reach=6)
    place = np.full(44, -1)
    place[lines] = np.arange(4)
    cross = CrossCovariance(regression, window, place, shifts=6)
    plan = plan_centres(needed_rows(lines, 3, 2), window, spectra.highest)
    diagonal = np.zeros(4)
    for indices, source, gram in grams(regression, [centre for centre, _ in plan], window):
        fits = solve_windows(source, gram, want_roots=range(len(indices)))
        for i, unit in enumerate(diagonal_variance(fits.roots, window)):
            centre, rows = plan[indices[i]]
            cross.add(fits.roots[i], source.part(i), rows, 1.0)
            for m in rows:
                weight = window.basis()[m - centre + 12]
                for j in range(-3, 4):
                    if 40 <= m + 2 * j < 44:
                        diagonal[m + 2 * j - 40] += weight @ unit[:, :, j + 3] @ weight
    sums = np.concatenate([diagonal[None, :], cross.sums])
    predicted = replace(local_polynomial(spectra, lines, window), itf_covariance=sums).itf_variance(phases)

    brute = np.zeros((4, phases))
    for experiment in range(2):
        for line in range(16, spectra.highest + 1):
            impulse = np.zeros_like(spectra.dte)
            impulse[experiment, line] = 1.0
            one = replace(spectra, dte=impulse)
            brute += np.abs(itf_from_htf(local_polynomial(one, lines, window).htf, phases)) ** 2
    assert predicted == pytest.approx(brute, rel=1e-9)
    assert np.abs(predicted / diagonal[:, None] - 1).max() > 0.2  # the cross terms matter here


def test_residual_tells_the_noise() -> None:
    results, _ = repeated(Window(2, 1, 5, transient=False), 4, 64, runs=40)
    system = periodic_filter(1, 64)
    force = np.random.default_rng(1).standard_normal((4, 1024))
    size = np.hypot(system.response(force).std(), NOISE)
    assert np.mean([r.residual for r in results]) == pytest.approx(NOISE / size, rel=0.05)
