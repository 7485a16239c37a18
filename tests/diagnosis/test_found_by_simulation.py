"""What simulation justifies: what changes between repetitions as far as it matters."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gearbench.diagnosis.found_by_simulation import changing_of
from gearbench.diagnosis.judging.judged import Sizes


@pytest.mark.parametrize(("final", "found"), [(0.1, 0.06 / 0.7), (0.25, 0.0)])
def test_what_changes_counts_where_it_makes_what_is_left_a_tenth_larger(final: float, found: float) -> None:
    """0.06 of a channel beside 0.1 of noise and remainder make 0.117 of it, beside 0.25 no more than 0.257."""
    sizes = {"dte": Sizes(1.0, 0.7, 0.3, final, 0.1), "y_driver": Sizes(10.0, 7.0, 3.0, 2.0, 0.1)}
    judged: Any = SimpleNamespace(sizes=sizes)
    assert changing_of(judged, {"dte": 0.06, "y_driver": 0.05, "torque_driven": 1.0}) == pytest.approx(found)
    assert changing_of(judged, {}) == 0.0
