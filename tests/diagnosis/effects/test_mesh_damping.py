"""Damping of the mesh beyond three standard deviations: put into a rig, found in the residuals, named by its size."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.linalg import norm
from shared.measured import nominal
from shared.synthetic import measurement

from gearbench.diagnosis.effects.effect import Fitted, added
from gearbench.diagnosis.effects.library import all_unknowns
from gearbench.diagnosis.effects.mesh_damping import MESH_DAMPING
from gearbench.diagnosis.evidence.decision import decide
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.search import Search, Tried
from gearbench.diagnosis.forces.condition import Condition, prepare
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


def test_a_rig_with_another_damping_is_nominal_at_its_unknown(prepared: Prepared) -> None:
    """What the unknown does to the residuals is what the damping ratio of the nominal rig itself does."""
    model, condition, unknowns = prepared
    (one,) = MESH_DAMPING.hypotheses(model)
    p = np.zeros(unknowns.size)
    p[unknowns["mesh-ratio"]] = np.log(4.0)
    oily, (estimate,) = added(nominal(), one, Fitted(model, unknowns, p, np.full(p.size, 0.05), {"base": 100.0}))
    before = nominal().rig.damping.mesh_ratio
    assert oily.rig.damping.mesh_ratio == pytest.approx(4.0 * before)
    assert (estimate.name, estimate.value, estimate.std) == (
        "ratio",
        pytest.approx(4.0 * before),
        pytest.approx(0.2 * before),
    )
    nothing = unknowns.departures(np.zeros(unknowns.size), condition)
    truth = residuals(nominal_model(oily, 220.0, 100.0), condition, nothing).left
    got = residuals(model, condition, unknowns.departures(p, condition)).left
    plain = residuals(model, condition, nothing).left
    assert norm(got - truth) < 1e-9 * norm(truth)
    assert norm(got - plain) > 1e-3 * norm(plain)


def test_its_prior_is_wide_for_the_ratio_alone(prepared: Prepared) -> None:
    model, _, unknowns = prepared
    (one,) = MESH_DAMPING.hypotheses(model)
    wide, plain = one.prior(unknowns), unknowns.prior()
    at = unknowns["mesh-ratio"].start
    assert np.flatnonzero(wide != plain).tolist() == [at]
    assert wide[at] == pytest.approx(5.0 * plain[at])  # 5 sd of 0.4: more than a factor of two


@pytest.mark.parametrize(("size", "verdict"), [(2.9, "none"), (3.1, "effects")])
def test_it_is_named_beyond_three_standard_deviations(prepared: Prepared, size: float, verdict: str) -> None:
    ones = np.ones(1)
    fit = Fit(ones, ones, np.eye(1), np.eye(1), ones, (), 0.0, 0.0, 1)
    tried = Tried(MESH_DAMPING.hypotheses(prepared[0])[0], 40.0, fit, size)
    assert decide(Search(fit, (tried,)), np.zeros(5), Unsteady.nothing()).verdict == verdict
