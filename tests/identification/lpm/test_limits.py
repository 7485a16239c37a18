"""What limits a result of the local polynomial method: parts of a known error, and of a record whose noise is known."""

from dataclasses import replace

import numpy as np
import pytest
from shared.ptv import periodic_filter

from gearbench.identification.lpm.accuracy import Accuracy, expected_accuracy
from gearbench.identification.lpm.estimate import LpmResult, local_polynomial
from gearbench.identification.lpm.limits import limits_of
from gearbench.identification.lpm.regression import Window
from gearbench.identification.spectra.joint import Spectra


def law(branches: int, share: float) -> LpmResult:
    """Branches that fall like 1/l, without variance; `share` of the residual is missing response."""
    order = np.abs(np.arange(-branches, branches + 1))
    htf = np.repeat((1.0 / np.maximum(order, 1))[:, None], 8, axis=1).astype(complex)
    none, ones = np.zeros(htf.shape), np.ones(8)
    return LpmResult(
        np.arange(8), htf, none, none[:1].astype(complex), share, 1.0, 1.0, 0.1, 1.0, 1, 2, 1, 1, "none", ones
    )


def test_parts_add_to_the_expected_error() -> None:
    accuracy = Accuracy(variance=0.04, truncation=0.01, record=0.01, expected=float(np.sqrt(18) / 100), bound=0.1)
    found = limits_of(law(40, 0.25), accuracy)
    assert found.noise == pytest.approx(np.sqrt(0.75) * 0.04)
    total = found.noise**2 + found.branches**2 + found.window**2 + found.channels**2
    assert total == pytest.approx(accuracy.expected**2)
    assert found.largest == "noise"
    assert limits_of(law(40, 1.0), accuracy).noise == 0.0
    assert limits_of(law(40, 0.0), Accuracy(0.01, 0.0, 0.2, 0.2, 0.2)).largest == "channels"


@pytest.mark.parametrize("branches", [8, 20])
def test_branches_beyond_are_foretold_by_their_law(branches: int) -> None:
    """Sum over l > L of 1/l^2 in closed form (pi^2/6 less the sum to L), twice, over the power of all known."""
    result = law(branches, 1.0)
    known = 1 + 2 * np.sum(1.0 / np.arange(1, branches + 1) ** 2)
    beyond = 2 * (np.pi**2 / 6 - np.sum(1.0 / np.arange(1, branches + 1) ** 2))
    found = limits_of(result, Accuracy(0.0, 1.0, 0.0, 1.0, 1.0))
    assert found.branches == pytest.approx(np.sqrt(beyond / known), rel=0.03)
    assert found.window == pytest.approx(np.sqrt(1.0 - found.branches**2))


@pytest.mark.parametrize(("fitted", "noise", "limit"), [(2, 0.0, "branches"), (4, 0.2, "noise")])
def test_cause_of_a_known_record(fitted: int, noise: float, limit: str) -> None:
    """A filter of four branches: fitted with two without noise, and with all of them in noise that is known."""
    system = periodic_filter(4, 16, taps=4)
    rng = np.random.default_rng(2)
    lines = np.fft.rfft(rng.standard_normal((4, 2048)), axis=1)
    lines[:, 500:] = 0.0  # so that no sideband is folded back
    force = np.fft.irfft(lines, axis=1)
    clean = system.response(force)
    size = noise * clean.std()
    dte = np.fft.rfft(clean + size * rng.standard_normal(clean.shape), axis=1) / 2048
    spectra = Spectra(np.fft.rfft(force, axis=1) / 2048, dte, 1.0 / 2048, 128, np.zeros(4), True)
    spectra = replace(spectra, noise=np.full(spectra.highest + 1, size**2 / 2048))
    found = local_polynomial(spectra, np.arange(20, 500, 4), Window(fitted, 2, 12, transient=False))
    assert limits_of(found, expected_accuracy(found)).largest == limit
