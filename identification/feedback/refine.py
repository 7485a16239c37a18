"""Gauss-Newton on the output error Y - A^-1 N U, with a prior on how fast the mesh's harmonics decay.

    d(A^-1 N U) = A^-1 (dN U - dA Y^),  Y^ = A^-1 N U: columns are made from the model's response, not from the measured
    one, so that noise does not bias them.

The harmonics of a piecewise smooth stiffness fall like 1/l (with edges of finite width faster): k_l has the prior
variance tau^2 / l^2, c_l likewise. tau follows from the estimate itself (MacKay 1992, evidence approximation).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.model import Model, Operator
from gearbench.identification.feedback.start import gauged
from gearbench.identification.spectra.joint import Complexes, Floats

ROUNDS = 12
# Relative decrease of the cost at which the rounds end.
SETTLED = 1e-3
# Steps that do not lower the cost are tried again with more damping (Levenberg 1944, Marquardt 1963): relative to the
# diagonal, the first one, its growth, and how often. Steps that are merely shortened creep along a pole that noise all
# but hides, and end far from the least cost.
DAMPING, GROWTH, TRIALS = 1e-4, 10.0, 7
TINY = 1e-11
# Weight of the row that keeps the common factor of all parameters where it is.
GAUGE = 1e3


@dataclass(frozen=True)
class Refined:
    """Model, the residual of its response (C, S, E) in units of the data, on all lines that dte is known on, `noise`
    variance per complex equation, `root` (P, P) of the covariance of the real parameters, and `freedom`: complex
    equations less parameters."""

    model: Model
    left: Complexes
    noise: float
    root: Floats
    freedom: float

    @property
    def covariance(self) -> Floats:
        """Covariance (P, P) of the real parameters: root root^T."""
        return np.asarray(self.root @ self.root.T)


def response(model: Model, data: ClassData) -> Complexes:
    """What the records would show of the model (C, S, E): Y^ = A^-1 N U or N Y^ + E U."""
    return _shown(model, data, _deflection(Operator(model, data.omega, data.modelled), data))


def _deflection(operator: Operator, data: ClassData) -> Complexes:
    """Y^ = A^-1 N U (C, S, E)."""
    source = operator.n[:, :, None] * data.force
    return np.stack([operator.solve(index, source[index]) for index in range(source.shape[0])])


def _shown(model: Model, data: ClassData, deflection: Complexes) -> Complexes:
    """What the records would show (C, S, E) of a deflection."""
    if not model.torsional:
        return deflection
    return model.shown(data.omega[:, :, None], deflection, data.force) * data.modelled[:, :, None]


def refined(model: Model, data: ClassData, settled: float = SETTLED) -> Refined:
    """The model of least output error, from a first one; rounds end at a relative decrease of the cost by `settled`."""
    operator = Operator(model, data.omega, data.modelled)
    predicted = _deflection(operator, data)
    cost = _cost(data, _shown(model, data, predicted))
    prior = _prior(model, None)
    damping = 0.0
    for _ in range(ROUNDS):
        gram, right = _normal(model, data, operator, predicted)
        freedom = _freedom(data, model)
        noise = cost / freedom
        system = _System(model, gram, right, noise, prior)
        root = system.root()
        trial, operator_of, of_trial, cost_of, damping = _damped(model, system, data, cost, damping)
        if cost_of > cost * (1 + SETTLED):
            break  # no step along this direction helps
        before, cost = cost, cost_of
        model, operator, predicted, prior = trial, operator_of, of_trial, _prior(trial, root)
        if before - cost < settled * before:
            break
    left = np.where(data.dte != 0, data.dte - _shown(model, data, predicted), 0.0)
    return Refined(model, left, cost / _freedom(data, model), root, _freedom(data, model))


def settled_covariance(fit: Refined, data: ClassData) -> Refined:
    """The same with the covariance at the model itself; that of `refined` belongs to the model before its last step,
    which is another one where a pole comes near zero frequency."""
    gram, right = linearised(fit.model, data)
    system = _System(fit.model, gram, right, fit.noise, _prior(fit.model, fit.root))
    return replace(fit, root=system.root())


def output_error(model: Model, data: ClassData) -> float:
    """Weighted sum of the squared residuals of the response; infinite for a model that has none."""
    return _cost(data, response(model, data))


def linearised(model: Model, data: ClassData) -> tuple[Floats, Floats]:
    """J^T J and J^T r of the output error of a model."""
    operator = Operator(model, data.omega, data.modelled)
    return _normal(model, data, operator, _deflection(operator, data))


def _damped(
    model: Model, system: _System, data: ClassData, cost: float, damping: float
) -> tuple[Model, Operator, Complexes, float, float]:
    """The model after the step, or the first of ever more damped ones that does not raise the cost; the damping that
    the next step begins with."""
    for _ in range(TRIALS):
        trial = gauged(model.moved(model.vector() + system.step(damping)), data)
        operator = Operator(trial, data.omega, data.modelled)
        predicted = _deflection(operator, data)
        found = _cost(data, _shown(trial, data, predicted))
        if found < cost * (1 + SETTLED):
            break
        damping = max(GROWTH * damping, DAMPING)
    following = damping / GROWTH if damping > DAMPING else 0.0
    return trial, operator, predicted, found, following


def _cost(data: ClassData, predicted: Complexes) -> float:
    left = (data.dte - predicted) * data.weight[:, None, None] * data.valid[:, :, None]
    left = left * (np.abs(data.dte).sum(axis=1, keepdims=True) > 0)
    value = float(np.sum(left.real**2 + left.imag**2))
    return value if np.isfinite(value) else np.inf


def _freedom(data: ClassData, model: Model) -> float:
    return max(data.equations - 0.5 * model.vector().size, 1.0)


def _prior(model: Model, root: Floats | None) -> Floats:
    """Prior precision of each real parameter, 0 for those of D and N, from their values and their covariance's root."""
    harmonics = model.harmonics
    order = np.arange(1, harmonics + 1)
    free = model.free
    precision = np.zeros(free + 4 * harmonics)
    spread = np.zeros(4 * harmonics) if root is None else np.sum(root[free:] ** 2, axis=1)
    for first, values in ((0, model.k), (2 * harmonics, model.c)):
        own = spread[first : first + 2 * harmonics].reshape(2, harmonics)
        size = np.mean(order**2 * (values.real**2 + values.imag**2 + own[0] + own[1])) / 2
        for part in (0, 1):
            start = free + first + part * harmonics
            precision[start : start + harmonics] = order**2 / max(size, np.finfo(float).tiny)
    return precision


def _normal(model: Model, data: ClassData, operator: Operator, deflection: Complexes) -> tuple[Floats, Floats]:
    """J^T J and J^T r of the stacked real equations, at the model's own `deflection` (C, S, E)."""
    count = model.vector().size
    gram, right = np.zeros((count, count)), np.zeros(count)
    for index in range(data.lines.shape[0]):
        omega, valid, modelled = data.omega[index], data.valid[index], data.modelled[index]
        values = model.basis.at(omega)
        for experiment in range(data.dte.shape[2]):
            measured = data.dte[index, :, experiment]
            if not measured.any():
                continue
            y = deflection[index, :, experiment] * modelled
            u = data.force[index, :, experiment]
            columns = -model.columns(values, omega, y, u)
            columns = operator.solve(index, columns * modelled[:, None])
            columns = model.shown_columns(values, omega, columns, y, u) * data.weight[index]
            own = valid & (omega >= 0) if 2 * data.weight[index] ** 2 <= 1.01 else valid
            columns, left = columns[own], ((measured - model.shown(omega, y, u)) * data.weight[index])[own]
            if own is not valid:
                columns, left = columns * np.sqrt(2.0), left * np.sqrt(2.0)
            stacked = np.concatenate([columns.real, columns.imag])
            gram += stacked.T @ stacked
            right += stacked.T @ np.concatenate([left.real, left.imag])
    return gram, right


class _System:
    """Normal equations of all real parameters, scaled to a diagonal of one; `noise`: variance of a complex equation."""

    def __init__(self, model: Model, gram: Floats, right: Floats, noise: float, prior: Floats) -> None:
        precision = 2.0 / noise
        total = precision * gram + np.diag(prior)
        self.size = np.sqrt(np.maximum(np.diagonal(total), TINY * np.diagonal(total).max()))
        self.pull = (precision * right - prior * model.vector()) / self.size
        self.total = total / self.size / self.size[:, None]
        self.total[np.diag_indices_from(self.total)] += TINY
        scaled = model.scale_direction() * self.size
        scaled /= np.linalg.norm(scaled)
        self.total += GAUGE * np.outer(scaled, scaled)

    def step(self, damping: float) -> Floats:
        """Step of all parameters; `damping` relative to the diagonal."""
        total = self.total + damping * np.eye(self.size.size)
        return np.asarray(cho_solve(cho_factor(total, lower=True), self.pull) / self.size)

    def root(self) -> Floats:
        """R of the covariance R R^T of all parameters.

        A factor's inverse, not the inverse's factor: where parameters stand in for each other the inverse loses what
        the lines know well, and draws from it leave the record by many deviations.
        """
        lower = np.linalg.cholesky(self.total)
        inverse = solve_triangular(lower, np.eye(self.size.size), lower=True, trans="T")
        return np.asarray(inverse / self.size[:, None])
