"""The quadratic of the cost: against the cost itself, and a general minimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from shared.fake_simulator import LINES, sensitivities, target, unknowns

from gearbench.diagnosis.simulation.quadratic import quadratic_of

RNG = np.random.default_rng(5)
MATRIX = sensitivities()
RESIDUAL = np.array([0.2, -0.1, 0.05, 0.3, 0, 0, 0, 0]) @ MATRIX
RESIDUAL = RESIDUAL + 0.02 * (RNG.standard_normal(LINES) + 1j * RNG.standard_normal(LINES))
FREE = (np.full(8, -np.inf), np.full(8, np.inf))


def made():  # type: ignore[no-untyped-def]
    where = target(RESIDUAL)
    return where, quadratic_of(where, RESIDUAL, MATRIX, np.arange(8))


def test_cost_and_information_are_those_of_the_lines() -> None:
    where, quadratic = made()
    step = 0.1 * RNG.standard_normal(8)
    assert quadratic.cost(step) == pytest.approx(where.cost(RESIDUAL - step @ MATRIX), rel=1e-9)
    weights = 2 * where.counts / ((where.floors + where.energies(RESIDUAL - step @ MATRIX)) * where.sizes)
    direct = (MATRIX.conj() * weights[where.of_line]) @ MATRIX.T
    assert quadratic.information(step) == pytest.approx(direct.real, rel=1e-9)


def test_the_best_step_is_that_of_a_general_minimiser() -> None:
    where, quadratic = made()
    p, sd = 0.05 * np.ones(8), np.array([0.1, 0.1, 0.1, 0.5, 0.01, 0.01, 0.02, 0.0])

    def whole(step: np.ndarray) -> float:
        step = np.append(step, 0.0)
        return where.cost(RESIDUAL - step @ MATRIX) + 0.5 * float((((p + step)[:7] / sd[:7]) ** 2).sum())

    step, cost, _ = quadratic.best(p, sd, FREE)
    wanted = minimize(whole, step[:7], method="BFGS", options={"gtol": 1e-6})
    assert step[7] == 0.0
    assert cost == pytest.approx(whole(step[:7]), rel=1e-9)
    assert cost - wanted.fun < 0.1 and step[:7] == pytest.approx(wanted.x, abs=2e-3)


def test_a_damped_step_is_that_of_a_general_minimiser_that_is_tied_to_where_it_begins() -> None:
    where, quadratic = made()
    p, sd, reach = 0.05 * np.ones(8), np.array([0.1, 0.1, 0.1, 0.5, 0.01, 0.01, 0.02, 0.0]), 0.03

    def whole(step: np.ndarray) -> float:
        step = np.append(step, 0.0)
        return where.cost(RESIDUAL - step @ MATRIX) + 0.5 * float((((p + step)[:7] / sd[:7]) ** 2).sum())

    def tied(step: np.ndarray) -> float:
        return whole(step) + 0.5 * float(((step / sd[:7] / reach) ** 2).sum())

    step, cost, _ = quadratic.best(p, sd, FREE, reach=reach)
    wanted = minimize(tied, np.zeros(7), method="BFGS", options={"gtol": 1e-6})
    assert cost == pytest.approx(whole(step[:7]), rel=1e-9)
    assert tied(step[:7]) - wanted.fun < 0.1 and step[:7] == pytest.approx(wanted.x, abs=1e-3)
    far, _, _ = quadratic.best(p, sd, FREE)
    assert np.linalg.norm(step[:7] / sd[:7]) < 0.5 * np.linalg.norm(far[:7] / sd[:7])


def test_the_cost_of_a_step_holds_the_prior_of_what_no_step_moves() -> None:
    where, _ = made()
    p, sd = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.3]), np.full(8, 0.1)
    step, cost, _ = quadratic_of(where, RESIDUAL, MATRIX, np.arange(6)).best(p, sd, FREE)
    prior = 0.5 * float(((p[:6] + step) ** 2).sum() + (p[6:] ** 2).sum()) / 0.01
    assert cost == pytest.approx(where.cost(RESIDUAL - step @ MATRIX[:6]) + prior, rel=1e-9)


def test_bounds_hold_and_the_rest_is_the_best_beside_them() -> None:
    _, quadratic = made()
    p, sd = np.zeros(8), np.full(8, 0.5)
    low, high = np.full(8, -np.inf), np.full(8, np.inf)
    high[3] = 0.1  # 0.3 would be the best
    step, _, _ = quadratic.best(p, sd, (low, high))
    assert step[3] == pytest.approx(0.1)
    held = sd.copy()
    held[3] = 0.0
    moved = np.zeros(8)
    moved[3] = 0.1
    where = target(RESIDUAL - moved @ MATRIX)
    beside, _, _ = quadratic_of(where, where.lines, MATRIX, np.arange(8)).best(p, held, FREE)
    assert step[:3] == pytest.approx(beside[:3], abs=2e-3)


def test_evidence_of_a_linear_problem_is_that_of_its_gaussian() -> None:
    _, quadratic = made()
    sd = np.full(unknowns().size, 0.3)
    _, cost, information = quadratic.best(np.zeros(8), sd, FREE)
    posterior = np.linalg.inv(information + np.diag(sd**-2.0))
    wanted = -cost + 0.5 * np.linalg.slogdet(posterior)[1] - np.log(sd).sum()
    assert quadratic.evidence(cost, information, sd) == pytest.approx(wanted, rel=1e-9)


def test_steps_are_drawn_as_uncertain_as_the_unknowns_are() -> None:
    _, quadratic = made()
    sd = np.array([0.1, 0.1, 0.1, 0.5, 0.01, 0.01, 0.02, 0.0])
    steps = quadratic.drawn(sd, np.random.default_rng(3).standard_normal((40_000, 8)))
    assert not steps[:, 7].any()
    wanted = np.linalg.inv(quadratic.information(np.zeros(8))[:7, :7] + np.diag(sd[:7] ** -2.0))
    scale = np.sqrt(np.diag(wanted))
    assert np.cov(steps[:, :7].T) / np.outer(scale, scale) == pytest.approx(wanted / np.outer(scale, scale), abs=0.03)


def test_what_has_no_prior_goes_where_its_bounds_are() -> None:
    """So is an effect taken out of a fit again that the background does not know, as a crack."""
    where, quadratic = made()
    p, sd = np.zeros(8), np.full(8, 0.5)
    sd[3] = 0.0
    low, high = np.full(8, -np.inf), np.full(8, np.inf)
    low[3] = high[3] = -0.4
    step, cost, _ = quadratic.best(p, sd, (low, high))
    assert step[3] == -0.4
    assert cost == pytest.approx(where.cost(RESIDUAL - step @ MATRIX) + 0.5 * float((step[sd > 0] ** 2).sum()) / 0.25)
    stays, least, _ = quadratic.best(p, sd, FREE)
    assert stays[3] == 0.0 and cost > least + 5.0


def test_derivatives_too_large_for_their_equations_cost_no_fit() -> None:
    """Where flanks part, eight unknowns do two things far more strongly than any prior holds them."""
    huge = 1e12 * (np.random.default_rng(2).standard_normal((8, 2)) @ MATRIX[:2])
    quadratic = quadratic_of(target(RESIDUAL), RESIDUAL, huge, np.arange(8))
    sd = np.full(8, 0.5)
    width = 0.25 * quadratic.information(np.zeros(8)) + np.eye(8)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(width)
    step, cost, _ = quadratic.best(np.zeros(8), sd, FREE)
    assert np.isfinite(step).all() and cost < target(RESIDUAL).cost(RESIDUAL)
