"""What a result expects of itself, and the choice of branches, order and window."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shared.ptv import periodic_filter, spectra_of
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification.lpm.accuracy import expected_accuracy, record_rule
from gearbench.identification.lpm.estimate import LpmResult, local_polynomial
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.regression import Window
from gearbench.identification.lpm.selection import choose_window
from gearbench.identification.spectra.joint import Spectra
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import itf_from_htf

LINES = np.arange(100, 500, 4)


def result(htf: np.ndarray, *, variance: float, missing: float, bound: float) -> LpmResult:
    spread = np.full(htf.shape, variance)
    total = spread.sum(axis=0)[None, :].astype(complex)
    lines = np.arange(1, htf.shape[1] + 1)
    ones = np.ones(lines.size)
    return LpmResult(lines, htf, spread, total, missing, bound, bound, 0.25, 1.0, 1, 2, 1, 1, "none", ones)


def test_expected_error_adds_variance_and_missing_branches() -> None:
    htf = np.ones((3, 10), complex)  # power 3 per frequency
    found = result(htf, variance=0.01 * 3 / 3.03, missing=30 * 0.2**2, bound=30 * 0.25**2)
    accuracy = expected_accuracy(found, record=0.15)
    assert accuracy.variance == pytest.approx(0.1, rel=0.01)
    assert accuracy.truncation == pytest.approx(0.2, rel=0.01)
    assert accuracy.expected == pytest.approx(np.sqrt(0.1**2 + 0.2**2 + 0.15**2), rel=0.01)
    assert accuracy.bound == pytest.approx(np.sqrt(0.1**2 + 0.25**2 + 0.15**2), rel=0.01)


@pytest.mark.parametrize(("experiments", "noise"), [(3, 0.0), (6, 0.1)])
def test_missing_power_is_that_of_the_branches_left_out(experiments: int, noise: float) -> None:
    """Four branches are there, two are fitted: what is missing against the closed form, with the noise known.

    Unless the noise is taken off it is high by a quarter in the second case.
    """
    lines = np.arange(4, 900, 4)  # so that nothing that is missing comes from elsewhere
    spectra, truth = noisy(noise, experiments, lines=lines)
    size = float(np.mean(np.abs(spectra.dte) ** 2)) / (1 + noise**2)
    known = replace(spectra, noise=np.full(spectra.highest + 1, noise**2 * size))
    found = local_polynomial(known, lines, Window(2, 1, 5, transient=False))
    wanted = np.sum(np.abs(truth[np.abs(np.arange(-8, 9)) > 2]) ** 2)
    assert np.sqrt(found.missing) == pytest.approx(np.sqrt(wanted), rel=0.15)
    assert found.missing_bound == found.missing
    # Nothing of this response is quiet: without knowledge of the noise all of the residual counts.
    unknown = local_polynomial(spectra, lines, Window(2, 1, 5, transient=False))
    assert 0.9 * wanted < unknown.missing <= unknown.missing_bound


@cache
def at_500_hz() -> tuple[Spectra, np.ndarray, np.ndarray]:
    """One second of the reference system, output lines, and the exact ITF on every fourth of them."""
    rig = ReferenceRig(mesh_frequency=500.0)
    record = reference_record(rig, realisations=1, duration=1.0, sampling_rate=16000.0, band=(1.0, 5000.0), noise=0.01)
    spectra, _, _ = record_spectra([record], top=2500.0, sidebands=9)
    lines = np.arange(704, 2500, 8)
    return spectra, lines, exact_itf(rig.system(256), lines[::4].astype(float), np.arange(128) / 128)


@pytest.mark.parametrize(
    ("window", "transient"), [((3, 1, 14), False), ((6, 2, 50), False), ((6, 2, 50), True), ((9, 1, 40), False)]
)
def test_expected_error_is_the_error(window: tuple[int, int, int], transient: bool) -> None:
    """One record at 500 Hz mesh, with too few branches, too wide windows or neither, against the exact ITF.

    With the missing response of every row taken for that of output lines (share 1) the first one is high by a third.
    """
    spectra, lines, exact = at_500_hz()
    found = local_polynomial(spectra, lines, Window(*window, transient))
    error = np.linalg.norm(itf_from_htf(found.htf, 128)[::4] - exact) / np.linalg.norm(exact)
    assert expected_accuracy(found).expected == pytest.approx(error, rel=0.25)


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


def noisy(
    noise: float, experiments: int = 3, harmonics: int = 4, lines: np.ndarray = LINES
) -> tuple[Spectra, np.ndarray]:
    system = periodic_filter(harmonics, 64, taps=30, seed=2)
    rng = np.random.default_rng(3)
    force = rng.standard_normal((experiments, 2048))
    clean = system.response(force)
    dte = clean + noise * clean.std() * rng.standard_normal(clean.shape)
    return spectra_of(force, dte, 32), system.htf(lines / 2048, 8)


def error(spectra: Spectra, truth: np.ndarray, window: Window) -> float:
    found = local_polynomial(spectra, LINES, window).htf
    pad = 8 - window.harmonics
    found = np.pad(found, ((pad, pad), (0, 0))) if pad >= 0 else found[-pad:pad]
    return float(np.linalg.norm(found - truth) / np.linalg.norm(truth))


def test_choice_without_noise_takes_all_branches() -> None:
    spectra, truth = noisy(0.0)
    window = choose_window(spectra, LINES, transient=False)
    assert 4 <= window.harmonics <= 6
    assert error(spectra, truth, window) < 0.01


@pytest.mark.validation
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
    with pytest.raises(LpmError, match=r"with harmonics = 8, order = 4.*1 realisation.*85 unknowns"):
        choose_window(spectra, LINES, transient=False, harmonics=8, order=4)


@pytest.mark.validation
def test_choice_at_high_mesh_frequency_takes_the_branches_that_mirror_resonances() -> None:
    """500 Hz mesh: branches that lead from one resonance to the mirror image of another count again after many that do
    not. Error against the exact ITF, within a quarter of the best of many prescribed choices."""
    rig = ReferenceRig(mesh_frequency=500.0)
    record = reference_record(rig, realisations=1, duration=1.0, sampling_rate=16000.0, band=(1.0, 5000.0), noise=0.01)
    spectra, _, _ = record_spectra([record], top=1800.0, sidebands=12)
    lines = np.arange(800, 1800, 8)
    exact = exact_itf(rig.system(256), lines.astype(float), np.arange(64) / 64)

    def error_of(window: Window) -> float:
        found = itf_from_htf(local_polynomial(spectra, lines, window).htf, 64)
        return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))

    window = choose_window(spectra, lines, transient=False)
    candidates = [
        Window(harmonics, order, int(margin * (2 * harmonics + 1) * (order + 1) / 2), transient=False)
        for harmonics in (3, 5, 7, 9, 11)
        for order in (1, 2, 3)
        for margin in (1.25, 1.7)
    ]
    errors = [error_of(candidate) for candidate in candidates]
    assert error_of(window) < 1.25 * min(errors)
    assert max(errors) > 3 * min(errors)
