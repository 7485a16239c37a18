"""What closes a part of the gap, on lines made by hand whose residuals are written out."""

from __future__ import annotations

import numpy as np
import pytest
from shared.fake_simulator import LINES, of_lines

from gearbench.diagnosis.judging.closing import GAIN, closing_of

NOTHING = np.zeros(LINES, dtype=complex)


@pytest.mark.parametrize(
    ("without", "with_it", "due"),
    [
        ((1.3, 5.0), (1.0, 5.0), True),  # the whole is closer by what the part is
        ((1.3, 5.0), (1.0, 5.2), False),  # worse elsewhere by more than that
        ((2.5, 5.0), (1.0, 5.8), True),  # but a part of less than half speaks for itself
        ((1.05, 5.0), (1.0, 5.0), False),
    ],
)
def test_a_part_that_closes_at_the_cost_of_the_whole_must_close_by_half(
    without: tuple[float, float], with_it: tuple[float, float], due: bool
) -> None:
    held = of_lines(NOTHING)
    one, other = ({"lines": np.where(held.of_line == 0, *sizes)} for sizes in (without, with_it))
    found = closing_of(held, one, other)
    assert (found.growth > 1.1) is due
    if due:
        assert found.growth == pytest.approx(without[0] / with_it[0], rel=1e-6)


def test_what_makes_the_whole_worse_is_spoken_against() -> None:
    """Though the record is likelier with it: no other is asked then."""
    held = of_lines(NOTHING)
    sizes = ((1.5, 5.0), (1.0, 5.1), (1.4, 5.0))
    one, worse, little = ({"lines": np.where(held.of_line == 0, *pair)} for pair in sizes)
    found = closing_of(held, one, worse)
    assert found.gain > GAIN and not found.due and not found.open
    assert closing_of(held, one, little).open
