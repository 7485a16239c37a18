"""Refit of all unknowns to the force residuals under one hypothesis, and its Laplace evidence.

The cost is the negative logarithm of the posterior: that of `blocks`, plus the Gaussian prior, less the logarithm of
how much the unknowns stretch the measured motion into forces (without it, zero stiffness would explain every error of
motion). Gauss-Newton steps with the missing parts lambda re-estimated between them; a step that does not lower the
cost is shortened, then refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.covariance import Blocks, missing, of_level, square_of, whitened
from gearbench.diagnosis.forces.jacobian import rows_and_columns, stiffening_slope
from gearbench.diagnosis.forces.nominal import Machine
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.residuals import rows
from gearbench.diagnosis.forces.unknowns import ROWS, SUPPORTS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROUNDS = 12  # of expectation-maximisation between two steps
HALVINGS = 4
LONGEST = 12.0  # prior standard deviations that one step may move an unknown
COARSE_STEPS = 6
ROUNDING = (0.0, 1e-14, 1e-12, 1e-10, 1e-8)  # of the largest entry
ENOUGH = 1.0  # change of the cost that no longer matters


@dataclass(frozen=True)
class Problem:
    """Everything that the hypotheses share."""

    machine: Machine
    conditions: tuple[Condition, ...]
    where: Layout
    blocks: tuple[Blocks, ...]


@dataclass(frozen=True)
class Fit:
    """The fit of one hypothesis.

    Unknowns `p` (P,), prior `sd` (P,), `precision` (P, P) of the posterior, `information` (P, P) of the data alone and
    their `pull` (P,): the data's cost is p' information p / 2 - pull p to second order. `factors`: lambda
    (rows + 1, blocks) of every condition; `cost` without the prior's normalisation; `steps` taken.
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
        """Posterior standard deviations (P,)."""
        root = root_of(self.precision * self.sd[:, None] * self.sd[None, :])
        inverse = solve_triangular(root, np.eye(len(self.sd)), lower=True)
        return np.asarray(self.sd * np.sqrt((inverse**2).sum(axis=0)))


def score(
    problem: Problem, p: Array, sd: Array, factors: Sequence[Array], rounds: int = ROUNDS
) -> tuple[float, list[Array]]:
    """Cost of unknowns (P,), and the lambda found there from those given. No rounds: plain weighted squares with the
    lambda given."""
    total, found = 0.5 * float(((p / sd) ** 2).sum()), []
    for condition, blocks, start in zip(problem.conditions, problem.blocks, factors, strict=True):
        found_here = rows(problem.machine, condition, problem.where, p).at(blocks.used)
        if rounds == 0:
            total += square_of(blocks, replace(found_here, stiffening=0.0), start)
            found.append(start)
            continue
        factor, cost = missing(blocks, found_here, start, rounds)
        total += cost - stretch(problem, condition, blocks, p, found_here.stiffening)
        found.append(factor)
    return total, found


def _normal(problem: Problem, p: Array, factors: Sequence[Array], plain: bool = False) -> tuple[Array, Array]:
    """Information (P, P) and gradient (P,) of the data's cost; `plain`: of the weighted squares alone."""
    size = problem.where.size
    information, gradient = np.zeros((size, size)), np.zeros(size)
    for condition, blocks, factor in zip(problem.conditions, problem.blocks, factors, strict=True):
        found, columns, pressing = rows_and_columns(problem.machine, condition, problem.where, p, blocks.used)
        if plain:
            r, j = whitened(blocks, replace(found, stiffening=0.0), columns, factor)
            information += 2 * (j.T @ j)
            gradient += 2 * (j.T @ r)
            continue
        r, j = whitened(blocks, found, columns, factor)
        stiffer = stiffening_slope(condition, problem.where, p)
        slope, curve = of_level(blocks, found, columns, pressing, factor, stiffer)
        information += 2 * (j.T @ j) + curve
        gradient += 2 * (j.T @ r) + slope - stretch_slope(problem, condition, blocks, p, stiffer)
    return information, gradient


def stretch(problem: Problem, condition: Condition, blocks: Blocks, p: Array, stiffening: float) -> float:
    """Log of the volume by which the unknowns stretch one condition's measured motion into residuals: the mesh's
    stiffness (`stiffening` is the mean logarithm of its factor) the deflection, dynamic stiffness the supports."""
    total = 2 * blocks.used.size * stiffening
    for _, _, whole in _dynamic_stiffness(problem, condition, blocks, p):
        total += 2 * float(np.log(np.abs(whole)).sum())
    return total


def stretch_slope(problem: Problem, condition: Condition, blocks: Blocks, p: Array, stiffer: Array) -> Array:
    """Gradient (P,) of `stretch`; `stiffer` (P,) is that of its `stiffening`."""
    gradient = 2 * blocks.used.size * stiffer
    for side, parts, whole in _dynamic_stiffness(problem, condition, blocks, p):
        for key, part in parts.items():
            gradient[problem.where[key].start + side] += 2 * float((part / whole).real.sum())
    return gradient


def _dynamic_stiffness(
    problem: Problem, condition: Condition, blocks: Blocks, p: Array
) -> Iterator[tuple[int, dict[str, Complex], Complex]]:
    """Of each support that has a row: side, derivatives of its dynamic stiffness to its unknowns, and it (B,)."""
    where, machine, omega = problem.where, problem.machine, condition.omega[blocks.used]
    for side, (row, *_) in enumerate(SUPPORTS):
        if row not in blocks.rows:
            continue
        spring = np.full(omega.size, machine.stiffness[side] * np.exp(p[where["stiffness"]][side]), dtype=complex)
        damper = np.asarray(1j * omega * machine.damping[side] * np.exp(p[where["damping"]][side]), dtype=complex)
        inertia = -(omega**2) * machine.mass[side] + 0j
        whole = spring + damper + inertia * (1 + p[where["mass"]][side])
        parts = {"stiffness": spring, "damping": damper, "mass": np.asarray(inertia, dtype=complex)}
        yield side, parts, whole


def refit(
    problem: Problem,
    sd: Array,
    start: Array,
    factors: Sequence[Array] | None = None,
    *,
    most: int = 12,
    coarse: Sequence[float] = (),
) -> Fit:
    """The fit under prior standard deviations `sd` (P,), from `start` (P,) and, if known, lambda there.

    `coarse` lists values of lambda, the same everywhere, for first rounds of plain weighted least squares: no block is
    given up before the unknowns have had their chance (graduated non-convexity).
    """
    low, high = problem.where.bounds()
    p = np.clip(start, low, high)
    if factors is None:
        factors = [np.ones((len(ROWS) + 1, len(b.count)))[[*b.rows, len(ROWS)]] for b in problem.blocks]
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
    low, high = problem.where.bounds()
    cost, lambdas = score(problem, p, sd, factors, 4 * rounds)
    steps = 0
    for _ in range(most):
        steps += 1
        information, gradient = _normal(problem, p, lambdas, plain=rounds == 0)
        move = -_solve(information, sd, gradient + p / sd**2)
        length, before = min(1.0, LONGEST / float(np.abs(move / sd).max())), cost
        for _ in range(HALVINGS):
            trial = np.clip(p + length * move, low, high)
            value, found = score(problem, trial, sd, lambdas, rounds)
            if value < cost:
                p, cost, lambdas = trial, value, found
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
    """Lower Cholesky factor (P, P) of a precision in units of the prior. Where the data tell 1e16 times more of one
    unknown than the prior, rounding outweighs the prior's ones: then as little is added as makes it definite."""
    largest = float(np.diag(scaled).max())
    for part in ROUNDING:
        try:
            return np.asarray(np.linalg.cholesky(scaled + part * largest * np.eye(len(scaled))))
        except np.linalg.LinAlgError:
            continue
    raise DiagnosisError("the records leave no finite weight to the unknowns: look for channels of a wrong unit")
