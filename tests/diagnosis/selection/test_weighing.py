"""What hypotheses are weighed over, and from which beginnings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.fake_simulator import (
    FakeSimulator,
    noisy,
    target,
    unknowns,
)
from shared.selected_lines import FRICTION, LISTED, MATRIX, names

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.fit import Optimum, Sensitivity, fit, fit_afresh, sensitivity_of
from gearbench.diagnosis.selection import selection as module
from gearbench.diagnosis.selection import weighing
from gearbench.diagnosis.simulation.quadratic import quadratic_of


def test_a_beginning_that_means_deny_does_not_hide_one_that_they_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(0.4 * MATRIX[3]))
    base = fit_afresh(simulator, np.zeros(8), prior_of(simulator, unknowns().prior()), renewals=1)  # type: ignore[arg-type]
    assert base is not None
    late = base.p.copy()
    late[3] = 0.3

    def begun(simulator: object, base: Optimum, one: Hypothesis, begin: np.ndarray) -> Optimum:
        return replace(base, p=begin, sd=one.widened(unknowns(), base.sd), evidence=base.evidence + 20.0)

    monkeypatch.setattr(weighing, "called_for", lambda simulator, base, one: late)
    monkeypatch.setattr(weighing, "begun_late", begun)
    monkeypatch.setattr(weighing, "denied_by_means", lambda simulator, one, optimum: optimum.p[3] > 0.35)
    (found,) = weighing.weigh(simulator, base, (FRICTION,), {})  # type: ignore[arg-type]
    assert found.optimum is not None and found.optimum.p[3] == 0.3 and found.log_bayes_factor == pytest.approx(20.0)


def test_effects_are_weighed_by_derivatives_taken_where_the_background_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that its fit carried along may not know of the effect at all, however close it is."""
    lines = np.array([0.08, -0.1, 0.02, 0.4, 0.0, 0.0, 0.0, 0.0]) @ MATRIX
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(noisy(lines)))
    monkeypatch.setattr(module, "is_close", lambda simulator, found: True)
    base = fit_afresh(simulator, np.zeros(8), prior_of(simulator, unknowns().prior()), renewals=1)  # type: ignore[arg-type]
    assert base is not None
    blind = MATRIX.copy()
    blind[3] = 0.0
    quadratic = quadratic_of(simulator.target, simulator.target.lines - base.lines, blind, np.delete(np.arange(8), 3))
    stale = replace(base, sensitivity=Sensitivity(blind, quadratic))
    found = module.select(simulator, stale, LISTED, {})  # type: ignore[arg-type]
    assert names(found) == ["friction"]


def test_what_a_background_had_still_to_gain_is_no_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Weighed over a fit that stopped on its way, whatever is fitted on beside it seems to be at work."""
    sound = np.array([0.08, -0.1, 0.02, 0.004, -0.005, 0.006, 0.0, 0.0]) @ MATRIX
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(noisy(sound)))
    monkeypatch.setattr(module, "is_close", lambda simulator, found: True)
    sd, begin = prior_of(simulator, unknowns().prior()), np.zeros(8)  # type: ignore[arg-type]
    first = sensitivity_of(simulator, begin, sd)  # type: ignore[arg-type]
    stopped = fit(simulator, begin, 1e-3 * sd, first)  # type: ignore[arg-type]
    assert stopped is not None
    stopped = replace(stopped, sd=sd, left=20.0)
    found = module.select(simulator, stopped, LISTED, {})  # type: ignore[arg-type]
    assert names(found) == [] and found.base.cost < stopped.cost - 20.0
