"""What is said of a mesh whose stiffness changes over its phase as no body of the nominal teeth would have it."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.diagnosis.forces.unknowns import unknowns_of
from gearbench.diagnosis.output.contrast import CONTRAST_LARGEST, CONTRAST_LEAST, contrast_groups, other_flanks

UNKNOWNS = unknowns_of(contrast_groups(), 0)


@pytest.mark.parametrize(("value", "words"), [(CONTRAST_LEAST, "less than 0.5"), (CONTRAST_LARGEST, "more than 1.6")])
def test_at_its_bound_the_flanks_are_asked_about(value: float, words: str) -> None:
    (said,) = other_flanks(UNKNOWNS, np.array([value]))
    assert words in said and "reliefs" in said


def test_within_its_bounds_nothing_is_said() -> None:
    assert other_flanks(UNKNOWNS, np.array([0.9 * CONTRAST_LEAST])) == ()
