"""Refit of all unknowns to the force residuals under one hypothesis, and its Laplace evidence.

The cost is the negative logarithm of the posterior: that of `blocks`, plus the Gaussian prior, less the logarithm of
the volume by which the unknowns stretch the measured motion into forces. Gauss-Newton steps with the missing parts
lambda re-estimated between them; a step that does not lower the cost is shortened, then refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.covariance import missing, of_level, square_of, whitened
from gearbench.diagnosis.forces.jacobian import linearised
from gearbench.diagnosis.forces.residuals import residuals
from gearbench.diagnosis.forces.volume import log_volume, log_volume_gradient, stiffening_gradient

Array = NDArray[np.float64]

ROUNDS = 12  # of expectation-maximisation between two steps
HALVINGS = 4
LONGEST = 12.0  # prior standard deviations that one step may move an unknown
COARSE_STEPS = 6
ROUNDING = (0.0, 1e-14, 1e-12, 1e-10, 1e-8)  # of the largest entry
ENOUGH = 1.0  # change of the cost that no longer matters


@dataclass(frozen=True)
class Fit:
    """The fit of one hypothesis.

    Unknowns `p` (size,), prior `sd` (size,), `precision` (size, size) of the posterior, `information` (size, size) of
    the data alone and their `pull` (size,): the data's cost is p' information p / 2 - pull p to second order.
    `factors`: lambda (equations + 1, blocks) of every condition; `cost` without the prior's normalisation; `steps`
    taken.
    """

    p: Array
    sd: Array
    precision: Array
    information: Array
    pull: Array
    factors: tuple[Array, ...]
    cost: float
    log_evidence: float
    steps: int

    @property
    def std(self) -> Array:
        """Posterior standard deviations (size,)."""
        root = root_of(self.precision * self.sd[:, None] * self.sd[None, :])
        inverse = solve_triangular(root, np.eye(len(self.sd)), lower=True)
        return np.asarray(self.sd * np.sqrt((inverse**2).sum(axis=0)))


def score(
    problem: Problem, p: Array, sd: Array, factors: Sequence[Array], rounds: int = ROUNDS
) -> tuple[float, list[Array]]:
    """Cost of unknowns (size,), and the lambda found there from those given. No rounds: plain weighted squares with the
    lambda given."""
    lambdas: list[Array] = []
    total = 0.5 * float(((p / sd) ** 2).sum())
    for condition, blocks, start in zip(problem.conditions, problem.blocks, factors, strict=True):
        departures = problem.unknowns.departures(p, condition)
        here = residuals(problem.model, condition, departures).at(blocks.used)
        if rounds == 0:
            total += square_of(blocks, replace(here, stiffening=0.0), start)
            lambdas.append(start)
            continue
        factor, cost = missing(blocks, here, start, rounds)
        total += cost - log_volume(problem.model, condition, blocks, departures, here.stiffening)
        lambdas.append(factor)
    return total, lambdas


def _normal(problem: Problem, p: Array, factors: Sequence[Array], plain: bool = False) -> tuple[Array, Array]:
    """Information (size, size) and gradient (size,) of the data's cost; `plain`: of the weighted squares alone."""
    model, unknowns = problem.model, problem.unknowns
    information, gradient = np.zeros((unknowns.size, unknowns.size)), np.zeros(unknowns.size)
    for condition, blocks, factor in zip(problem.conditions, problem.blocks, factors, strict=True):
        at = linearised(model, condition, unknowns, p, blocks.used)
        if plain:
            r, j = whitened(blocks, replace(at.residuals, stiffening=0.0), at.jacobian, factor)
            information += 2 * (j.T @ j)
            gradient += 2 * (j.T @ r)
            continue
        r, j = whitened(blocks, at.residuals, at.jacobian, factor)
        stiffer = stiffening_gradient(condition, unknowns, at.departures)
        slope, curve = of_level(blocks, at.residuals, at.jacobian, at.mesh_jacobian, factor, stiffer)
        information += 2 * (j.T @ j) + curve
        volume = log_volume_gradient(model, condition, blocks, unknowns, at.departures, stiffer)
        gradient += 2 * (j.T @ r) + slope - volume
    return information, gradient


def refit(
    problem: Problem,
    sd: Array,
    start: Array,
    factors: Sequence[Array] | None = None,
    *,
    most: int = 12,
    coarse: Sequence[float] = (),
) -> Fit:
    """The fit under prior standard deviations `sd` (size,), from `start` (size,) and, if known, lambda there.

    `coarse` lists values of lambda, the same everywhere, for first rounds of plain weighted least squares: no block is
    given up before the unknowns have had their chance (graduated non-convexity).
    """
    low, high = problem.unknowns.bounds()
    p = np.clip(start, low, high)
    if factors is None:
        factors = [np.ones((len(b.with_mesh), len(b.count))) for b in problem.blocks]
    steps = 0
    for least in coarse:
        fixed = [np.full_like(factor, least) for factor in factors]
        p, _, _, taken = _descend(problem, sd, p, fixed, COARSE_STEPS, 0)
        steps += taken
    p, cost, lambdas, taken = _descend(problem, sd, p, factors, most, ROUNDS)
    information, gradient = _normal(problem, p, lambdas)
    precision = information + np.diag(1 / sd**2)
    scaled = precision * sd[:, None] * sd[None, :]
    evidence = -cost - float(np.log(np.diag(root_of(scaled))).sum())
    pull = information @ p - gradient
    return Fit(p, sd, precision, information, pull, tuple(lambdas), cost, evidence, steps + taken)


def _descend(
    problem: Problem, sd: Array, p: Array, factors: Sequence[Array], most: int, rounds: int
) -> tuple[Array, float, Sequence[Array], int]:
    """Unknowns, cost, lambda and number of steps after at most `most` steps downhill."""
    low, high = problem.unknowns.bounds()
    cost, lambdas = score(problem, p, sd, factors, 4 * rounds)
    steps = 0
    for _ in range(most):
        steps += 1
        information, gradient = _normal(problem, p, lambdas, plain=rounds == 0)
        move = -_solve(information, sd, gradient + p / sd**2)
        length, before = min(1.0, LONGEST / float(np.abs(move / sd).max())), cost
        for _ in range(HALVINGS):
            trial = np.clip(p + length * move, low, high)
            value, better = score(problem, trial, sd, lambdas, rounds)
            if value < cost:
                p, cost, lambdas = trial, value, better
                break
            length *= 0.4
        if before - cost < ENOUGH:
            break
    return p, cost, lambdas, steps


def _solve(information: Array, sd: Array, right: Array) -> Array:
    """(information + diag sd^-2)^-1 right, scaled by the prior against the units' different sizes."""
    scaled = information * sd[:, None] * sd[None, :] + np.eye(len(sd))
    return np.asarray(sd * cho_solve((root_of(scaled), True), sd * right))


def root_of(scaled: Array) -> Array:
    """Lower Cholesky factor (size, size) of a precision in units of the prior. Where the data tell 1e16 times more of
    one unknown than the prior, rounding outweighs the prior's ones: then as little is added as makes it definite."""
    largest = float(np.diag(scaled).max())
    for part in ROUNDING:
        try:
            return np.asarray(np.linalg.cholesky(scaled + part * largest * np.eye(len(scaled))))
        except np.linalg.LinAlgError:
            continue
    raise DiagnosisError("the records leave no finite weight to the unknowns: look for channels of a wrong unit")
