"""What a result expects of itself, and the choice of branches, order and window."""

import numpy as np
import pytest
from shared.ptv import periodic_filter, spectra_of

from gearbench.identification.lpm.accuracy import expected_accuracy, record_rule, tail
from gearbench.identification.lpm.estimate import LpmResult, local_polynomial
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.regression import Window
from gearbench.identification.lpm.selection import choose_window
from gearbench.identification.spectra.joint import Spectra

LINES = np.arange(100, 500, 4)


def result(htf: np.ndarray, *, variance: float, residual: float) -> LpmResult:
    spread = np.full(htf.shape, variance)
    total = spread.sum(axis=0)[None, :].astype(complex)
    return LpmResult(np.arange(1, htf.shape[1] + 1), htf, spread, total, residual, 1.0, 1, 2, 1, 1, "none")


def power_law(limit: int, exponent: float = 4.0) -> np.ndarray:
    order = np.abs(np.arange(-limit, limit + 1))
    return np.repeat(np.sqrt(np.maximum(order, 1.0) ** -exponent)[:, None], 3, axis=1).astype(complex)


@pytest.mark.parametrize("limit", [20, 60])
def test_tail_of_a_power_law(limit: int) -> None:
    whole = np.abs(power_law(4000)[:, 0]) ** 2
    order = np.abs(np.arange(-4000, 4001))
    truth = np.sqrt(whole[order > limit].sum() / whole[order <= limit].sum())
    assert tail(power_law(limit), np.zeros((2 * limit + 1, 3))) == pytest.approx(truth, rel=0.05)


def test_tail_ignores_what_is_noise() -> None:
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((121, 400)) + 1j * rng.standard_normal((121, 400))
    htf = np.repeat(power_law(60)[:, :1], 400, axis=1) + 0.001 * noise
    clean = tail(power_law(60), np.zeros((121, 3)))
    assert tail(htf, np.full(htf.shape, 2 * 0.001**2)) == pytest.approx(clean, rel=0.5)
    assert tail(htf, np.zeros(htf.shape)) > 3 * clean


def test_tail_without_decay_is_unknown() -> None:
    assert tail(np.ones((41, 3), complex), np.zeros((41, 3))) == np.inf
    assert tail(np.ones((5, 3), complex), np.zeros((5, 3))) == np.inf


def test_expected_error_adds_variance_and_missing_branches() -> None:
    htf = np.ones((3, 10), complex)  # power 3 per frequency, no tail to extrapolate
    accuracy = expected_accuracy(result(htf, variance=0.01 * 3 / 3.03, residual=0.2), noise=None)
    assert accuracy.variance == pytest.approx(0.1, rel=0.01)
    assert accuracy.truncation == pytest.approx(0.2)
    assert accuracy.expected == pytest.approx(np.hypot(0.1, 0.2), rel=0.01)
    # Noise that repeated periods have told apart is no missing response.
    known = expected_accuracy(result(htf, variance=0.0, residual=0.2), noise=0.16)
    assert known.expected == known.bound == pytest.approx(0.12)
    # A decaying tail caps what is missing; the residual stays as the bound.
    decaying = expected_accuracy(result(power_law(60), variance=0.0, residual=0.2), noise=None)
    assert decaying.expected < 0.01
    assert decaying.bound == pytest.approx(0.2)


def test_record_length_rule() -> None:
    """3 (2L+1) (R+1) / B: 100 records of 1 s for 101 to 1231 Hz of travel at 2 Hz mesh, 100 Hz bandwidth."""
    empty = np.zeros((100, 3), complex)
    spectra = Spectra(empty, empty, 1.0, 2, np.zeros(100), True)
    natural = np.linspace(1000.0, 1200.0, 1001)[None, :]
    rule = record_rule(spectra, 300, 1, natural, 50.0 / natural, 0.1)
    assert rule is not None
    assert rule.bandwidth == pytest.approx(100.0)
    assert rule.duration == 100.0
    assert rule.needed == pytest.approx(3 * 601 * 2 / 100)
    # Travel of 2 % to 98 %: 192 Hz, and 1.5 bandwidths, at 2 Hz a branch.
    assert rule.harmonics_needed == pytest.approx((192 + 150) / 2, abs=1)
    few = record_rule(spectra, 3, 1, natural, 50.0 / natural, 0.1)
    assert few is not None and few.needed == pytest.approx(3 * (2 * few.harmonics_needed + 1) * 2 / 100)
    # Where nothing is missing, the branches in use count.
    enough = record_rule(spectra, 3, 1, natural, 50.0 / natural, 0.01)
    assert enough is not None and enough.needed == pytest.approx(3 * 7 * 2 / 100)
    # Repeated excitation is not distinct.
    twice = Spectra(empty, empty, 1.0, 2, np.zeros(100), True, repeats=2)
    repeated = record_rule(twice, 300, 1, natural, 50.0 / natural, 0.1)
    assert repeated is not None and repeated.duration == 50.0
    assert record_rule(spectra, 3, 1, np.empty((0, 5)), np.empty((0, 5)), 0.1) is None


def noisy(noise: float, experiments: int = 3, harmonics: int = 4) -> tuple[Spectra, np.ndarray]:
    system = periodic_filter(harmonics, 64, taps=30, seed=2)
    rng = np.random.default_rng(3)
    force = rng.standard_normal((experiments, 2048))
    clean = system.response(force)
    dte = clean + noise * clean.std() * rng.standard_normal(clean.shape)
    return spectra_of(force, dte, 32), system.htf(LINES / 2048, 8)


def error(spectra: Spectra, truth: np.ndarray, window: Window) -> float:
    found = local_polynomial(spectra, LINES, window).htf
    pad = 8 - window.harmonics
    found = np.pad(found, ((pad, pad), (0, 0))) if pad >= 0 else found[-pad:pad]
    return float(np.linalg.norm(found - truth) / np.linalg.norm(truth))


def test_choice_without_noise_takes_all_branches() -> None:
    spectra, truth = noisy(0.0)
    window = choose_window(spectra, LINES, transient=False)
    assert window.harmonics in (4, 6)
    assert error(spectra, truth, window) < 0.01


def test_choice_under_noise_is_near_the_best_candidate() -> None:
    """Heavy noise: all branches would cost more than they bring; the choice is within 25 % of the best."""
    spectra, truth = noisy(1.5)
    window = choose_window(spectra, LINES, transient=False)
    candidates = [
        Window(harmonics, order, width, transient=False)
        for harmonics in (0, 1, 2, 4, 6)
        for order in (1, 2)
        for width in (6, 10, 15, 20)
        if 3 * (2 * width + 1) > 1.4 * (2 * harmonics + 1) * (order + 1)
    ]
    errors = [error(spectra, truth, candidate) for candidate in candidates]
    assert error(spectra, truth, window) < 1.25 * min(errors)
    assert max(errors) > 3 * min(errors)


def test_given_values_are_kept() -> None:
    spectra, _ = noisy(0.1)
    assert choose_window(spectra, LINES, transient=False, harmonics=3).harmonics == 3
    window = choose_window(spectra, LINES, transient=True, order=2, half_width=14)
    assert (window.order, window.half_width, window.transient) == (2, 14, True)


def test_choice_refuses_what_no_window_supports() -> None:
    spectra, _ = noisy(0.1, experiments=1)
    with pytest.raises(LpmError, match=r"with harmonics = 7, order = 3.*1 realisation.*60 unknowns"):
        choose_window(spectra, LINES, transient=False, harmonics=7, order=3)
