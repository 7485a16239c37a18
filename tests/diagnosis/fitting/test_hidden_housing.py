"""Housings on which the displacement sensors stand, looked for by the excited lines of a demonstration's record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.simulated_lines import demonstration

from gearbench.diagnosis.fitting.beginning import linear_cost
from gearbench.diagnosis.fitting.fit import cost_of, fit_afresh
from gearbench.diagnosis.fitting.hidden_housing import on_a_housing, with_hidden_motions, without_housing
from gearbench.diagnosis.fitting.hidden_motion import APART
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.structure import (
    ACROSS,
    HOUSING,
    MODE,
    OBLIQUE,
    SEAT,
    kind_of,
    structure_found,
    with_motion,
)


def recorded(simulator: Simulator, p: np.ndarray) -> Simulator:
    """The simulator of a record whose rig has the unknowns `p`."""
    lines = simulator.lines(p)
    assert lines is not None
    return simulator.of_target(replace(simulator.target, lines=lines))


def test_a_housing_under_the_sensors_is_told_by_the_transmission_error() -> None:
    """Of a rig on a housing that moves across, whose sensors go along with it, the resonance is found, though the
    supports are off across."""
    simulator = demonstration()
    layout = simulator.layout
    keys, p = layout.unknowns, np.zeros(layout.size)
    p[keys[ACROSS]], p[keys[SEAT]] = (0.2, 0.15), 1.0
    p[keys[HOUSING]], p[keys[MODE]], p[keys[OBLIQUE]] = (0.0, 0.05), (0.0, 0.0, -1.1, 0.1), (0.0, 0.0, 1.1, -0.9)
    moving = recorded(simulator, p)
    sd = keys.prior()
    plain = without_housing(moving, np.zeros(layout.size))
    assert plain is not None
    (gain, begin), *further = with_hidden_motions(moving, plain, sd, 1)
    others = [other for _, other in further]
    assert begin[keys[SEAT]] == 1.0 and others
    assert others[0][keys[MODE]] == pytest.approx(begin[keys[MODE]]) and not others[0][keys[OBLIQUE]].any()
    assert all(abs(begin[keys[MODE]] - other[keys[MODE]])[2] > APART for other in others[1:])
    assert begin[keys[MODE]][2] == pytest.approx(-1.1, abs=0.1)
    assert begin[keys[HOUSING]] == pytest.approx([0.0, 0.05], abs=0.03) and begin[keys[HOUSING]][0] == 0.0
    assert kind_of(keys, begin, 1) == "rocking" and begin[keys[OBLIQUE]][2] > 0.0 > begin[keys[OBLIQUE]][3]
    assert gain > 10.0 and linear_cost(moving, begin, sd) < linear_cost(moving, plain, sd)


def test_a_soft_housing_far_below_the_supports_is_found() -> None:
    """A heavy housing that resonates at a ninth of the frequency of a gear on its support."""
    simulator = demonstration()
    layout = simulator.layout
    keys, p = layout.unknowns, np.zeros(layout.size)
    p[keys[ACROSS]], p[keys[SEAT]] = (0.2, 0.15), 1.0
    p = with_motion(keys, p, 0, -2.2, 0.06, 1)
    moving = recorded(simulator, p)
    plain = without_housing(moving, p)
    assert plain is not None
    ((_, found),) = with_hidden_motions(moving, plain, keys.prior(), 0)
    assert found[keys[MODE]][0] == pytest.approx(-2.2, abs=0.07)
    assert kind_of(keys, found, 0) == "rocking"


@pytest.mark.parametrize("ahead", [False, True])
def test_two_resonances_of_one_kind_under_the_sensors_are_told_apart(ahead: bool) -> None:
    """Also beside a fit without them that lies ahead of any with but one of them."""
    simulator = demonstration(faster=3)
    layout = simulator.layout
    keys, p = layout.unknowns, np.zeros(layout.size)
    p[keys[ACROSS]], p[keys[SEAT]], p[keys[OBLIQUE]] = (0.2, 0.15), 1.0, (-1.0, 1.0, 1.1, -0.9)
    p = with_motion(keys, with_motion(keys, p, 0, -0.3, 0.02, 1), 1, -1.1, 0.03, 1)
    moving, sd = recorded(simulator, p), keys.prior()
    without = fit_afresh(moving, np.zeros(layout.size), sd, renewals=0)
    assert without is not None and cost_of(moving, p, sd) + 3.0 < 0.1 * without.cost
    beside = replace(without, cost=cost_of(moving, p, sd) + 20.0) if ahead else without
    found = on_a_housing(moving, beside)
    assert found is not None and found.cost < cost_of(moving, p, sd) + 3.0
    assert sorted(found.p[keys[MODE]][[0, 2]]) == pytest.approx([-1.1, -0.3], abs=0.01)
    assert sorted(found.p[keys[HOUSING]]) == pytest.approx([0.02, 0.03], rel=0.3)
    assert kind_of(keys, found.p, 0) == kind_of(keys, found.p, 1) == "rocking"


def test_what_is_told_of_a_housing_goes_by_its_shares() -> None:
    keys = demonstration().layout.unknowns
    p = with_motion(keys, with_motion(keys, np.zeros(keys.size), 0, 0.2, 0.05, 1), 1, -0.4, 0.08, 0)
    told = structure_found(keys, p, np.full(keys.size, 0.01))
    by_name = {one.name: one.value for one in told if one.name.startswith("housing")}
    words = "housing compliance over the supports', where it"
    assert by_name == {f"{words} rocks": pytest.approx(0.05), f"{words} moves along": pytest.approx(0.08)}
