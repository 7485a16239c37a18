"""The plan of the demonstration's first condition: its promise against simulated records with the effect."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.cases import case_files
from gearbench.diagnosis.detection.information import Known
from gearbench.diagnosis.detection.smallest import View, direction, smallest, wide_prior
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.library import hypotheses
from gearbench.diagnosis.planning.known import known_of
from gearbench.diagnosis.planning.planned import Planned, planned
from gearbench.diagnosis.selection.weighing import limit_of, relief
from gearbench.diagnosis.simulation.quadratic import prior_cost
from gearbench.rig import read_case


@pytest.fixture(scope="module")
def made() -> tuple[Planned, Known]:
    nominal = read_case(case_files()["gap_demo"])
    plan = planned(nominal.under(nominal.conditions[0]))
    return plan, known_of(plan)


def chosen(plan: Planned, name: str) -> Hypothesis:
    return next(one for one in hypotheses(plan.problem.model) if one.name == name)


@pytest.mark.parametrize("name", ["friction", "eccentricity driver", "bearing-nonlinearity driven", "torque-ripple"])
def test_an_effect_of_the_stated_size_is_what_a_record_calls_for(made: tuple[Planned, Known], name: str) -> None:
    """Simulated with half and twice the size: evidence of the fits to that record falls short of the limit, and clears
    it."""
    plan, known = made
    one = chosen(plan, name)
    found = smallest(View(known, (one,)), 0)
    assert found is not None
    simulator = plan.simulator(plan.fitted, plan.conditions)
    nothing, unknowns = np.zeros(plan.layout.size), known.unknowns
    before, jacobian = simulator.lines(nothing), simulator.jacobian(nothing, unknowns.prior(), nothing == 0.0)
    assert before is not None and jacobian is not None
    worth = []
    for part in (0.5, 2.0):
        after = simulator.lines(part * found * direction(known, one))
        assert after is not None
        noise = known.search.target.lines - before
        quadratic = known.search.quadratic.moved(after - before + noise)
        wide, p = wide_prior(known, one), part * found * direction(known, one)
        _, cost, information = quadratic.best(nothing, known.narrow, unknowns.bounds())
        plain = quadratic.evidence(cost, information, known.narrow)
        # The effect's own fit ends at the truth, to which one step need not get.
        truth = known.search.quadratic.moved(noise)
        cost, information = (
            truth.target.cost(noise) + prior_cost(p, wide),
            truth.information(np.zeros(known.active.size)),
        )
        factor = truth.evidence(cost, information, wide) - plain - np.log(one.choices)
        worth.append(min(factor, relief(unknowns, known.narrow, one, p, wide)))
    assert worth[0] < limit_of(unknowns, one) < worth[1]


def test_half_of_the_noise_tells_more_of_what_is_loud(made: tuple[Planned, Known]) -> None:
    _, known = made
    view = View(known, ())
    quiet = View(known, (), quiet=0.25)
    grown = np.linalg.eigvalsh(quiet.information - view.information)
    assert grown.min() > -1e-6 * grown.max() and grown.max() > 0.0


def test_a_plan_whose_flanks_part_in_every_record_tells_what_held_simulations_would() -> None:
    swinging = read_case(case_files()["gap_demo"], ["experiment.multisine.amplitude_nm=130.0"])
    plan = planned(swinging.under(swinging.conditions[0]))
    names = [one.name for one in plan.inputs.measurements]
    assert plan.fitted == plan.inputs.measurements and list(plan.nudges) == names
    assert [plan.inputs.measurements[number].name for number in plan.rough] == names
    found = smallest(View(known_of(plan), (chosen(plan, "friction"),)), 0)
    assert found is not None
