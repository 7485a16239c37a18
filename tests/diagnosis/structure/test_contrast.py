"""A mesh whose pairs share more or less compliance, and what is said where no body, rim or web does that."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.diagnosis.forces.unknowns import unknowns_of
from gearbench.diagnosis.structure.contrast import (
    CONTRAST_LARGEST,
    CONTRAST_LEAST,
    contrast_groups,
    contrast_slope,
    kept_mean,
    other_flanks,
)

UNKNOWNS = unknowns_of(contrast_groups(), 0)
# One pair for a third of the cycle, two for the rest.
TANGENTS = np.repeat([2e8, 3e8], [10, 20])


@pytest.mark.parametrize(("value", "words"), [(CONTRAST_LEAST, "less compliance"), (CONTRAST_LARGEST, "more")])
def test_at_its_bound_the_flanks_are_asked_about(value: float, words: str) -> None:
    (said,) = other_flanks(UNKNOWNS, np.array([value]))
    assert words in said and "reliefs" in said


def test_within_its_bounds_nothing_is_said() -> None:
    assert other_flanks(UNKNOWNS, np.array([0.9 * CONTRAST_LEAST])) == ()


@pytest.mark.parametrize("more", [-0.4, 0.0, 0.3])
def test_the_mean_stiffness_stays_and_the_contrast_falls_with_what_is_shared(more: float) -> None:
    compliance = more / TANGENTS.mean()
    found = kept_mean(TANGENTS, more) / (1.0 / TANGENTS + compliance)
    assert found.mean() == pytest.approx(TANGENTS.mean(), rel=1e-12)
    ratio = found.max() / found.min()
    assert ratio > 1.5 if more < 0.0 else ratio <= 1.5


def test_the_slope_is_that_of_the_force_at_an_unchanged_deflection() -> None:
    """Linear springs: F = factor delta / (1/k + c), whose logarithm is differentiated."""
    more, step = 0.2, 1e-5

    def force(value: float) -> np.ndarray:
        return kept_mean(TANGENTS, value) / (1.0 / TANGENTS + value / TANGENTS.mean())

    wanted = np.log(force(more + step) / force(more - step)) / (2 * step)
    yielding = 1.0 / (1.0 / TANGENTS + more / TANGENTS.mean())
    assert contrast_slope(TANGENTS, more, yielding) == pytest.approx(wanted, rel=1e-6, abs=1e-9)


def test_pairs_cannot_share_less_than_nothing_leaves() -> None:
    with pytest.raises(ValueError, match=r"cannot share -0\.9"):
        kept_mean(TANGENTS, -0.9)
