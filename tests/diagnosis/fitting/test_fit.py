"""Output-error fit on lines that depend on unknowns by a formula: it comes back to where they were made."""

from __future__ import annotations

import numpy as np
import pytest
from shared.fake_simulator import LINES, FakeSimulator, sensitivities, target, unknowns

from gearbench.diagnosis.fitting.fit import Sensitivity, fit, fit_afresh, refreshed, sensitivity_of
from gearbench.diagnosis.simulation.quadratic import prior_cost, quadratic_of

MATRIX = sensitivities()
TRUE = np.array([0.12, -0.08, 0.05, 0.3, 0.0, 0.0, 0.0, 0.0])
SD = np.array([0.1, 0.1, 0.1, 0.5, 0.01, 0.01, 0.0, 0.0])
ALL = np.ones(8, dtype=bool)


def curved(p: np.ndarray) -> np.ndarray:
    """Lines that are no linear function of the unknowns."""
    return p @ MATRIX + 0.8 * p[3] ** 2 * MATRIX[0] + 0.5 * np.sin(4 * p[1]) * MATRIX[1]


def noise(size: float) -> np.ndarray:
    rng = np.random.default_rng(7)
    return size * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))


def test_it_converges_to_the_rig_that_made_the_records() -> None:
    simulator = FakeSimulator(curved, target(curved(TRUE) + noise(1e-3)))
    first = sensitivity_of(simulator, np.zeros(8), SD)
    assert first is not None
    best = fit(simulator, np.zeros(8), SD, first, renewals=4)
    assert best is not None and best.left < 0.5
    assert best.p == pytest.approx(TRUE, abs=2e-3)
    assert best.cost == pytest.approx(best.misfit + prior_cost(best.p, SD))
    # The covariance is that of least squares under the weights of the blocks.
    weights = best.sensitivity.quadratic.weights(np.zeros(8))[simulator.target.of_line]
    derivative = simulator.jacobian(best.p, SD, ALL)
    assert derivative is not None
    curvature = ((derivative.conj() * weights) @ derivative.T).real[:6, :6] + np.diag(SD[:6] ** -2)
    assert best.std[:6] == pytest.approx(np.sqrt(np.diag(np.linalg.inv(curvature))), rel=0.02)
    assert not best.std[6:].any()


def test_what_is_not_chosen_stays_as_it_is() -> None:
    simulator = FakeSimulator(lambda p: p @ MATRIX, target(TRUE @ MATRIX + noise(1e-3)))
    begin, free = np.where(np.arange(8) == 3, 0.28, 0.0), np.arange(8) != 3
    best = fit_afresh(simulator, begin, SD, renewals=1, chosen=free)
    assert best is not None and best.p[3] == 0.28
    whole = fit_afresh(simulator, best.p, SD, renewals=1)
    assert whole is not None and whole.p == pytest.approx(TRUE, abs=2e-3)


def test_what_is_not_chosen_promises_nothing_by_its_own_prior() -> None:
    """Its fifty nats stay whatever is moved: a fit that hopes for them renews its Jacobian in vain."""
    simulator = FakeSimulator(lambda p: p @ MATRIX, target(TRUE @ MATRIX + noise(1e-3)))
    begin = np.where(np.arange(8) == 4, 10.0 * SD[4], 0.0)
    best = fit_afresh(simulator, begin, SD, renewals=4, chosen=np.arange(8) != 4)
    assert best is not None and best.p[4] == begin[4] and best.left < 0.5
    assert best.cost == pytest.approx(best.misfit + prior_cost(best.p, SD)) and prior_cost(best.p, SD) > 50.0
    assert simulator.jacobians == 2  # one where it began, one where it ended


def test_a_step_to_where_no_rig_is_is_shortened() -> None:
    simulator = FakeSimulator(curved, target(curved(TRUE) + noise(1e-3)), largest=0.31)
    first = sensitivity_of(simulator, np.zeros(8), SD)
    assert first is not None
    best = fit(simulator, np.zeros(8), SD, first, renewals=4)
    assert best is not None and np.abs(best.p).max() <= 0.31
    assert best.cost < 0.6 * simulator.target.cost(simulator.target.lines)
    assert fit(simulator, np.full(8, 1.0), SD, first, renewals=1) is None


def test_unknowns_without_a_prior_stay_and_bounds_hold() -> None:
    true = TRUE.copy()
    true[6] = -0.2  # a tooth cannot gain stiffness
    simulator = FakeSimulator(lambda p: p @ MATRIX, target(true @ MATRIX))
    first = sensitivity_of(simulator, np.zeros(8), np.ones(8))
    assert first is not None
    sd = SD.copy()
    assert fit(simulator, np.zeros(8), sd, first, renewals=0).p[6] == 0.0  # type: ignore[union-attr]
    sd[6] = 0.35
    assert fit(simulator, np.zeros(8), sd, first, renewals=0).p[6] >= 0.0  # type: ignore[union-attr]
    assert unknowns().group("crack").low == 0.0


def test_what_the_records_do_not_show_is_known_as_before() -> None:
    blind = MATRIX.copy()
    blind[4] = 0.0
    simulator = FakeSimulator(lambda p: p @ blind, target(TRUE @ blind + noise(1e-3)))
    first = sensitivity_of(simulator, np.zeros(8), SD)
    assert first is not None
    best = fit(simulator, np.zeros(8), SD, first, renewals=1)
    assert best is not None and best.p[4] == 0.0
    assert best.std[4] == SD[4] and 0.0 < best.std[0] < SD[0]


class Jumping(FakeSimulator):
    """Feels friction from 0.2 on; the derivative is that of the jump there."""

    def jacobian(self, p: np.ndarray, sd: np.ndarray, chosen: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
        return np.where(chosen[:, None], ALIKE, 0.0)


ALIKE = MATRIX.copy()
ALIKE[3] = MATRIX[0] + 2.0 * MATRIX[1]  # what the first unknown does, once the second takes back the rest


def test_what_is_not_felt_yet_does_not_stand_in_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """A jump and the second unknown promise cheaply what the first one can do alone: with bounds that do not hold it
    the fit stays where it begins."""
    monkeypatch.setattr("gearbench.diagnosis.fitting.fit.least_steps", lambda unknowns: {"friction": 0.2})
    simulator = Jumping(lambda p: np.where(np.arange(8) == 3, p * (p >= 0.2), p) @ ALIKE, target(0.12 * MATRIX[0]))
    sd = np.array([0.02, *SD[1:]])
    first = sensitivity_of(simulator, np.zeros(8), sd)
    assert first is not None
    best = fit(simulator, np.zeros(8), sd, first, renewals=2)
    assert best is not None and best.left < 0.5
    assert best.p[0] == pytest.approx(0.12, abs=2e-3)


def test_a_valley_that_bends_is_followed_to_its_end() -> None:
    """Renewed derivatives give a small part of what they promise where a valley bends, and do so again from there."""

    def bent(p: np.ndarray) -> np.ndarray:
        return p @ MATRIX + 2.0 * p[0] ** 2 * MATRIX[1]

    true = np.array([0.5, 0.0, 0.05, 0.3, 0.0, 0.0, 0.0, 0.0])
    begin = np.array([-0.5, -0.5, 0.05, 0.3, 0.0, 0.0, 0.0, 0.0])
    wide = np.where(SD > 0.0, 10.0, 0.0)
    simulator = FakeSimulator(bent, target(bent(true) + noise(1e-3)))
    first = sensitivity_of(simulator, begin, wide)
    assert first is not None
    best = fit(simulator, begin, wide, first, renewals=20)
    assert best is not None and best.left < 0.5
    assert best.p == pytest.approx(true, abs=5e-3)


@pytest.mark.parametrize("begin", [-0.4, -0.3])
def test_a_narrow_valley_that_winds_is_followed_by_damped_steps(begin: float) -> None:
    """Where two unknowns make up for each other along a curve, each alone costs much: no part of a long step is of use,
    and none whose unknowns are held to a box each."""

    def winding(p: np.ndarray) -> np.ndarray:
        return 0.1 * p[0] * MATRIX[0] + 2.0 * (p[1] - np.sin(2.5 * p[0])) * MATRIX[1]

    true, start = (np.array([at, np.sin(2.5 * at), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) for at in (0.9, begin))
    wide = np.where(np.arange(8) < 2, 3.0, 0.0)
    simulator = FakeSimulator(winding, target(winding(true) + noise(2e-2)))
    first = sensitivity_of(simulator, start, wide)
    assert first is not None
    best = fit(simulator, start, wide, first, renewals=60)
    assert best is not None and best.left < 0.5
    assert best.p[:2] == pytest.approx(true[:2], abs=0.02)


def test_derivatives_that_stayed_behind_are_taken_anew() -> None:
    """A fit led astray by one that is wrong by a half stops short; with it taken anew it arrives."""
    simulator = FakeSimulator(curved, target(curved(TRUE) + noise(1e-3)))
    fresh = sensitivity_of(simulator, np.zeros(8), SD)
    assert fresh is not None
    stale = fresh.jacobian.copy()
    stale[3] = 0.5 * stale[3] + MATRIX[5]
    active = fresh.quadratic.active
    wrong = quadratic_of(simulator.target, simulator.target.lines - curved(np.zeros(8)), stale, active)
    stuck = fit(simulator, np.zeros(8), SD, Sensitivity(stale, wrong))
    assert stuck is not None and abs(stuck.p[3] - TRUE[3]) > 0.02
    here = refreshed(simulator, stuck, np.arange(8) == 3)
    assert here.cost == stuck.cost and (here.p == stuck.p).all()
    derivative = simulator.jacobian(stuck.p, SD, ALL)
    assert derivative is not None
    assert here.sensitivity.jacobian[3] == pytest.approx(derivative[3])
    assert (here.sensitivity.jacobian[:3] == stale[:3]).all()
    best = fit(simulator, here.p, SD, here.sensitivity, renewals=2)
    assert best is not None and best.p == pytest.approx(TRUE, abs=2e-3)


class Keeping(FakeSimulator):
    """What the fourth unknown does is only taken anew where nothing near is given."""

    def jacobian(
        self, p: np.ndarray, sd: np.ndarray, chosen: np.ndarray, near: np.ndarray | None = None
    ) -> np.ndarray | None:
        out = super().jacobian(p, sd, chosen)
        if out is not None and near is not None:
            out[3] = near[3]
        return out


def test_where_no_step_keeps_its_promise_slopes_that_stay_behind_are_renewed_too() -> None:
    """One of the wrong sign: no step along it helps, however short."""
    simulator = Keeping(curved, target(curved(TRUE) + noise(1e-3)))
    fresh = sensitivity_of(simulator, np.zeros(8), SD)
    assert fresh is not None
    wrong = np.where(np.arange(8)[:, None] == 3, -0.5, 1.0) * fresh.jacobian
    here = simulator.target.lines - curved(np.zeros(8))
    near = quadratic_of(simulator.target, here, wrong, fresh.quadratic.active)
    best = fit(simulator, np.zeros(8), SD, Sensitivity(wrong, near), renewals=6)
    assert best is not None and best.left < 0.5
    assert best.p == pytest.approx(TRUE, abs=2e-3)
