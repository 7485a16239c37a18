"""Motions of a housing that a fit lacks, or has where they are not, on a demonstration's record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.simulated_lines import demonstration

from gearbench.diagnosis.fitting.fit import cost_of, fit_afresh
from gearbench.diagnosis.fitting.moved_motions import with_motions_moved
from gearbench.diagnosis.structure.structure import ACROSS, HOUSING, MODE, with_motion

# Where the fit begins that is to be mended: without the second motion, or with it nearly two octaves too low.
LACKING, ASTRAY = None, -1.3


@pytest.mark.parametrize("begun", [LACKING, ASTRAY])
def test_a_motion_is_put_where_the_records_have_it(begun: float | None) -> None:
    whole = demonstration(faster=3)
    # With the mean, which says nothing of a housing, the fit without a second motion finds it on a way of its own.
    simulator = whole.of_target(whole.target.of_lines(whole.target.fluctuating[whole.target.of_line]))
    layout = simulator.layout
    keys, p = layout.unknowns, np.zeros(layout.size)
    p[keys[ACROSS]] = (0.2, 0.15)
    p = with_motion(keys, p, 0, 0.5, 0.03, 1)
    true = with_motion(keys, p, 1, -0.1, 0.03, 1)
    lines = simulator.lines(true)
    assert lines is not None
    record, sd = simulator.of_target(replace(simulator.target, lines=lines)), keys.prior()
    least = cost_of(record, true, sd)
    if begun is not None:
        p = with_motion(keys, p, 1, begun, 0.03, 1)
    found = fit_afresh(record, p, sd, renewals=2)
    assert found is not None and found.cost > least + 20.0
    told = list[str]()
    moved = with_motions_moved(record, found, told.append)
    assert told and moved.cost < least + 3.0
    assert sorted(moved.p[keys[MODE]][[0, 2]]) == pytest.approx([-0.1, 0.5], abs=0.03)
    assert moved.p[keys[HOUSING]] == pytest.approx([0.03, 0.03], rel=0.3)
    assert with_motions_moved(record, moved) is moved
