"""A support beyond three standard deviations: found in the residuals, named by its size, put into a rig."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.linalg import norm
from shared.measured import nominal
from shared.synthetic import measurement

from gearbench.diagnosis.effects.effect import Fitted, Hypothesis, added
from gearbench.diagnosis.effects.library import all_unknowns
from gearbench.diagnosis.effects.support_stiffness import SUPPORT_STIFFNESS
from gearbench.diagnosis.evidence.decision import decide
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.search import Search, Tried
from gearbench.diagnosis.forces.condition import Condition, prepare
from gearbench.diagnosis.forces.equations import Equation
from gearbench.diagnosis.forces.nominal import NominalModel, nominal_model
from gearbench.diagnosis.forces.residuals import residuals
from gearbench.diagnosis.forces.steadiness import Unsteady
from gearbench.diagnosis.forces.unknowns import Unknowns

Prepared = tuple[NominalModel, Condition, Unknowns]


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    model = nominal_model(nominal(), 220.0, 100.0)
    condition = prepare(measurement(), model, 3000.0)
    return model, condition, all_unknowns(model, [condition])


def driven(model: NominalModel) -> Hypothesis:
    return SUPPORT_STIFFNESS.hypotheses(model)[1]


def test_a_rig_with_another_support_is_nominal_at_its_unknown(prepared: Prepared) -> None:
    """What the unknown does to the residuals is what the stiffness of the nominal rig itself does."""
    model, condition, unknowns = prepared
    case, p = nominal(), np.zeros(unknowns.size)
    p[unknowns["stiffness"]] = (0.0, np.log(1.7))
    fitted = Fitted(model, unknowns, p, np.full(unknowns.size, 0.02), {"base": 100.0})
    softer, (estimate,) = added(case, driven(model), fitted)
    assert softer.rig.support.driven.stiffness == pytest.approx(1.7e8)
    assert softer.rig.support.driver == case.rig.support.driver
    assert (estimate.name, estimate.unit) == ("driven.stiffness", "N/m")
    assert (estimate.value, estimate.std) == (pytest.approx(1.7e8), pytest.approx(0.034e8))
    other = nominal_model(softer, 220.0, 100.0)
    nothing = unknowns.departures(np.zeros(unknowns.size), condition)
    # The radial supports, whose stiffness goes by the nominal one, are held rigid on both sides.
    rigid = np.zeros(unknowns.size)
    rigid[unknowns["radial"]] = 30.0
    truth = residuals(other, condition, unknowns.departures(rigid, condition)).left
    got = residuals(model, condition, unknowns.departures(p + rigid, condition)).left
    plain = residuals(model, condition, nothing).left
    assert norm(got - truth) < 1e-9 * norm(truth)
    own = Equation.DRIVEN_SUPPORT
    assert norm(got[own] - plain[own]) > 0.1 * norm(plain[own])


def test_its_prior_is_wide_for_one_support_alone(prepared: Prepared) -> None:
    model, _, unknowns = prepared
    wide, plain = driven(model).prior(unknowns), unknowns.prior()
    at = unknowns["stiffness"].start + 1
    assert wide[at] == pytest.approx(np.log(2.0)) and plain[at] == pytest.approx(0.1)
    assert np.flatnonzero(wide != plain).tolist() == [at]


@pytest.mark.parametrize(("size", "verdict"), [(2.9, "none"), (3.1, "effects")])
def test_it_is_named_beyond_three_standard_deviations(prepared: Prepared, size: float, verdict: str) -> None:
    one = np.ones(1)
    fit = Fit(one, one, np.eye(1), np.eye(1), one, (), 0.0, 0.0, 1)
    tried = Tried(driven(prepared[0]), 40.0, fit, size)
    assert decide(Search(fit, (tried,)), np.zeros(5), Unsteady.nothing()).verdict == verdict
