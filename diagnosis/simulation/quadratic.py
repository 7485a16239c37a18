"""The cost near a rig, from its residual and Jacobian alone: block by block a quadratic, so that any prior can be tried
without simulating.

With residual r and Jacobian J of a block, C(step) = |r - J step|^2 / size; `squares` are Re J* J, `slopes` Re J* r.
The logarithm is concave: least squares with weights n / (s^2 + C) bound the cost from above, and their solutions walk
downhill to its minimum under a prior.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gearbench.diagnosis.simulation.target import Target

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

ROUNDS = 12
ENOUGH = 0.1  # nats


@dataclass(frozen=True)
class Quadratic:
    """`squares` (blocks, q, q) and `slopes` (blocks, q) over the active unknowns `active` (q,); real and imaginary
    parts of residual (2 K,) and derivatives (q, 2 K), line by line in the order of the target's blocks."""

    target: Target
    active: NDArray[np.int64]
    squares: Array
    slopes: Array
    residual: Array
    derivatives: Array

    def moved(self, residual: Complex) -> Quadratic:
        """The same curvature about another residual (K,)."""
        parts = real_parts(residual[self.target.order])
        return replace(self, slopes=_slopes(self.target, parts, self.derivatives), residual=parts)

    @property
    def energy(self) -> Array:
        """Sums of squares (blocks,) of the residual."""
        return _summed(self.target, self.residual)

    def cost(self, step: Array) -> float:
        """Nats of the data after a step (q,)."""
        return self._cost(self._energies(step))

    def _cost(self, energies: Array) -> float:
        return float(np.sum(self.target.counts * self.target.nats(energies)))

    def _energies(self, step: Array) -> Array:
        return _summed(self.target, self.residual - step @ self.derivatives) / self.target.sizes

    def weights(self, step: Array) -> Array:
        """2 n / ((s^2 + C) size) (blocks,) after a step."""
        return self._weights(self._energies(step))

    def _weights(self, energies: Array) -> Array:
        target = self.target
        return 2 * target.counts / ((target.floors + energies) * target.sizes)

    def information(self, step: Array) -> Array:
        """Curvature (q, q) of the data's cost there."""
        return np.asarray(np.tensordot(self.weights(step), self.squares, axes=1))

    def best(
        self, p: Array, sd: Array, bounds: tuple[Array, Array], start: Array | None = None, reach: float = inf
    ) -> tuple[Array, float, Array]:
        """The step (q,) to the least cost under the prior `sd` (size,) from unknowns `p` (size,) within bounds (size,),
        what it costs with the prior of all, and the information there. Unknowns of sd 0 stay, or go where their bounds
        are.
        A step is damped to about `reach` standard deviations (Levenberg 1944)."""
        here, width = p[self.active], sd[self.active]
        low, high = (bound[self.active] - here for bound in bounds)
        step = np.clip(np.zeros(len(here)) if start is None else start, low, high)
        free, tied = width > 0.0, reach**-2
        # What no step moves costs as much before as after: a step that saved it would promise what none can keep.
        unmoved = prior_cost(np.delete(p, self.active), np.delete(sd, self.active))
        energies = self._energies(step)
        cost = self._cost(energies) + prior_cost(here + step, width) + unmoved
        held = tied * prior_cost(step, width)
        for _ in range(ROUNDS):
            weights = self._weights(energies)
            information = np.tensordot(weights, self.squares, axes=1)
            trial = self._solved(information, weights @ self.slopes, here, width, free, (low, high), tied)
            there = self._energies(trial)
            value = self._cost(there) + prior_cost(here + trial, width) + unmoved
            pull = tied * prior_cost(trial, width)
            if value + pull < cost + held:
                gained = cost + held - value - pull
                step, energies, cost, held = trial, there, value, pull
                if gained > ENOUGH:
                    continue
            break
        return step, cost, information

    def _solved(
        self, information: Array, slope: Array, here: Array, width: Array, free: Flags, bounds: tuple[Array, Array],
        tied: float,
    ) -> Array:  # fmt: skip
        """Least squares under the prior, `tied` to where it begins by so much of it; what would leave its bounds stays
        on them."""
        low, high = bounds
        step = np.clip(np.zeros(len(here)), low, high)
        free = free.copy()
        for _ in range(len(here)):
            scale = width[free]
            inside = information[free]
            matrix = inside[:, free] * scale[:, None] * scale[None, :] + (1.0 + tied) * np.eye(len(scale))
            pull = (slope[free] - inside[:, ~free] @ step[~free]) * scale - here[free] / scale
            step[free] = scale * _solution(matrix, pull)
            outside = free & ((step < low) | (step > high))
            if not outside.any():
                return step
            step[outside] = np.clip(step[outside], low[outside], high[outside])
            free &= ~outside
        return step

    def evidence(self, cost: float, information: Array, sd: Array) -> float:
        """Laplace's log evidence of a cost with its prior, and the information there."""
        _, matrix = self._scaled(information, sd)
        return -cost - 0.5 * float(np.linalg.slogdet(matrix)[1])

    def std(self, information: Array, sd: Array) -> Array:
        """Posterior standard deviations (q,) under the prior `sd` (size,); nothing of what that holds."""
        free, matrix = self._scaled(information, sd)
        out = sd[self.active]
        out[free] *= np.sqrt(np.diag(np.linalg.inv(matrix)))
        return out

    def drawn(self, sd: Array, normal: Array) -> Array:
        """Steps (n, q) as uncertain as the unknowns are under the prior `sd` (size,), from independent normal numbers
        (n, q)."""
        free, matrix = self._scaled(self.information(np.zeros(len(self.active))), sd)
        out = np.zeros(normal.shape)
        out[:, free] = np.linalg.solve(np.linalg.cholesky(matrix).T, normal[:, free].T).T * sd[self.active][free]
        return out

    def _scaled(self, information: Array, sd: Array) -> tuple[Flags, Array]:
        """Which unknowns (q,) are free, and data and prior's information about these in standard deviations."""
        width = sd[self.active]
        free = width > 0.0
        scale = width[free]
        return free, information[np.ix_(free, free)] * scale[:, None] * scale[None, :] + np.eye(len(scale))


def _solution(matrix: Array, pull: Array) -> Array:
    """Of symmetric equations (n, n) whose eigenvalues are one at least; where they are so large that rounding has left
    some below nothing, the shortest one."""
    try:
        return np.asarray(cho_solve(cho_factor(matrix, lower=True), pull))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, pull)[0])


def quadratic_of(target: Target, residual: Complex, jacobian: Complex, active: NDArray[np.int64]) -> Quadratic:
    """The quadratic about a residual (K,) with Jacobian (size, K) for the active unknowns."""
    derivatives = real_parts(jacobian[active][:, target.order])
    squares = np.empty((len(target.floors), len(active), len(active)))
    for block, inside in enumerate(_inside(target)):
        part = derivatives[:, inside]
        squares[block] = part @ part.T
    parts = real_parts(residual[target.order])
    return Quadratic(target, active, squares, _slopes(target, parts, derivatives), parts, derivatives)


def real_parts(values: Complex) -> Array:
    """Real and imaginary parts (..., 2 K), line by line."""
    return np.ascontiguousarray(values).view(np.float64)


def prior_cost(p: Array, sd: Array) -> float:
    """Nats of the prior `sd` (n,) of unknowns `p` (n,); those of sd 0 count nothing."""
    held = sd > 0.0
    return 0.5 * float(((p[held] / sd[held]) ** 2).sum())


def _inside(target: Target) -> list[slice]:
    """Where the parts of each block lie."""
    return [slice(2 * one.start, 2 * one.stop) for one in target.runs]


def _summed(target: Target, parts: Array) -> Array:
    """Sums (blocks,) of the squares of parts (2 K,)."""
    return np.array([parts[inside] @ parts[inside] for inside in _inside(target)])


def _slopes(target: Target, residual: Array, derivatives: Array) -> Array:
    return np.array([derivatives[:, inside] @ residual[inside] for inside in _inside(target)])
