"""Noise told from missing response in residuals, and the power of branches beyond the known ones."""

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.identification.lpm.missing import MissingPower, power_beyond

RESPONSE = np.linspace(1.0, 3.0, 12)
FREEDOM = np.full(12, 400.0)


class _Parts(MissingPower):
    """Residuals of the parts of a band, as if measured."""

    def __init__(self, level: NDArray[np.float64]) -> None:
        self.given = level

    def _parts(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        return self.given, FREEDOM, RESPONSE


def test_noise_of_an_even_residual_is_all_of_it() -> None:
    """A band whose response differs by 3 only: the quietest part alone, less its share of everything, says 0.5."""
    scatter = 1.0 + np.random.default_rng(1).standard_normal(12) / np.sqrt(400.0)
    assert 0.9 < _Parts(scatter).flat() <= 1.02
    assert _Parts(scatter).apart() < 0.6


def test_noise_beside_missing_response_is_found() -> None:
    scatter = 1.0 + np.random.default_rng(2).standard_normal(12) / np.sqrt(400.0)
    assert _Parts((1.0 + 0.5 * RESPONSE) * scatter).flat() == pytest.approx(1.0, abs=0.25)
    assert _Parts(0.5 * RESPONSE * scatter).flat() < 0.1


@pytest.mark.parametrize(("fall", "kept"), [(1.0, 1.0), (0.6, 0.3)])
def test_branches_beyond_follow_the_last_octaves(fall: float, kept: float) -> None:
    """|G_l|^2 = 1/l^2: L = 16 leaves 2/(L + 1/2); where the last octave is weaker than that foretells, less."""
    order = np.abs(np.arange(-16, 17))
    power = np.where(order > 0, 1.0 / np.maximum(order, 1) ** 2, 1.0) * np.where(order > 8, fall, 1.0)
    htf = np.sqrt(power)[:, None] * np.ones(3)
    known = power_beyond(htf.astype(complex), np.zeros(htf.shape))
    assert known == pytest.approx(3 * kept * 2 / 16.5, rel=0.12)


def test_noise_on_the_last_branches_foretells_none() -> None:
    htf = np.full((9, 2), 1e-3 + 0j)
    assert power_beyond(htf, np.full((9, 2), 2e-6)) == 0.0
    assert power_beyond(htf[3:6], np.zeros((3, 2))) == np.inf
