"""Gauss-Newton on the output error Y - A^-1 N U, with a prior on what the mesh is made of.

    d(A^-1 N U) = A^-1 (dN U - dA Y^),  Y^ = A^-1 N U: columns are made from the model's response, not from the measured
    one, so that noise does not bias them.

The harmonics of a piecewise smooth stiffness fall like 1/l (with edges of finite width faster): k_l has the prior
variance tau^2 / l^2, c_l likewise. tau follows from the estimate itself (MacKay 1992, evidence approximation). Zones of
phase bring a prior of their own (`shapes.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.model import Model, Operator
from gearbench.identification.feedback.shapes import Mesh, Shapes
from gearbench.identification.feedback.start import gauge_factor
from gearbench.identification.spectra.joint import Complexes, Floats

ROUNDS = 12
# Relative decrease of the cost at which the rounds end.
SETTLED = 1e-3
# Steps that do not lower the cost are tried again with more damping (Levenberg 1944, Marquardt 1963): relative to the
# diagonal, the first one, its growth, and how often. Steps that are merely shortened creep along a pole that noise all
# but hides, and end far from the least cost.
DAMPING, GROWTH, TRIALS = 1e-4, 10.0, 7
TINY = 1e-11
# What may be left of the equations, of their largest right-hand side.
UNSOLVED = 1e-6
# Weight of the row that keeps the common factor of all parameters where it is.
GAUGE = 1e3


@dataclass(frozen=True)
class Refined:
    """Model, the residual of its response (C, S, E) in units of the data, on all lines that dte is known on, `noise`
    variance per complex equation, `root` (P, X) of the covariance of the real parameters, `freedom`: complex equations
    less parameters that they determine; `mesh`: what the model's mesh is made of, harmonics for None."""

    model: Model
    left: Complexes
    noise: float
    root: Floats
    freedom: float
    mesh: Mesh | None = None

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
    return np.stack([operator.solve(index, source[index], even=True) for index in range(source.shape[0])])


def _responding(model: Model, data: ClassData) -> tuple[Operator, Complexes, float]:
    """The operator of a model, its deflection, and its output error: infinite where the deflection does not fulfil its
    equations. Rounding prevents that where the stiffness is negative over a part of the mesh cycle: deflections stay
    there without any force, and the matrix is singular."""
    operator = Operator(model, data.omega, data.modelled)
    deflection, source = _deflection(operator, data), operator.n[:, :, None] * data.force
    left = np.abs(operator.times(deflection) - source).max()
    solved = bool(left < UNSOLVED * np.abs(source).max())
    return operator, deflection, _cost(data, _shown(model, data, deflection)) if solved else np.inf


def _shown(model: Model, data: ClassData, deflection: Complexes) -> Complexes:
    """What the records would show (C, S, E) of a deflection."""
    seen = deflection
    if model.torsional:
        seen = model.shown(data.omega[:, :, None], deflection, data.force) * data.modelled[:, :, None]
    return seen if data.part == 0.0 else np.stack([data.sampled(one) for one in seen])


def refined(model: Model, data: ClassData, settled: float = SETTLED, mesh: Mesh | None = None) -> Refined:
    """The model of least output error, from a first one; rounds end where the objective falls by less than `settled`.

    `mesh`: what the model's mesh is made of, with the amplitudes that it has; of harmonics unless given.
    """
    mesh = mesh or Mesh.of_harmonics(model.vector()[model.free :])
    now, damping = State.of(model, mesh, data), 0.0
    if not np.isfinite(now.cost):  # any solvable neighbour is better
        now = replace(now, cost=_cost(data, _shown(model, data, now.deflection)))
    for _ in range(ROUNDS):
        noise = now.cost / _freedom(data, now)
        system = normal_system(now, data, noise)
        root = system.root()
        trial, damping = _damped(now, system, data, noise, damping)
        if trial is None:
            break  # no step along this direction helps
        gained = now.objective(noise) - trial.objective(noise)
        last = gained < settled * now.objective(noise)
        now = replace(trial, mesh=trial.mesh.told(root[model.free :]))
        if last:
            break
    left = np.where(data.dte != 0, data.dte - _shown(now.model, data, now.deflection), 0.0)
    freedom = _freedom(data, now)
    return Refined(now.model, left, now.cost / freedom, now.mesh.of_model(root, model.free), freedom, now.mesh)


def output_error(model: Model, data: ClassData) -> float:
    """Weighted sum of the squared residuals of the response; infinite for a model that has none."""
    return _responding(model, data)[2]


def linearised(model: Model, data: ClassData, shapes: Shapes | None = None) -> tuple[Floats, Floats]:
    """J^T J and J^T r of the output error of a model; with respect to its parameters, or to those of D and N and the
    amplitudes of `shapes` of its mesh."""
    operator = Operator(model, data.omega, data.modelled)
    return _normal(model, data, operator, _deflection(operator, data), shapes)


def told_beside(fit: Refined, data: ClassData, change: Complexes) -> tuple[float, float, Floats]:
    """Part of a `change` (C, S, E) of the response that is in the residual of a fit on the `data`, its deviation, and
    the shift (P,) of the parameters that the whole change makes: least squares beside all parameters, whose Jacobian
    and prior are those of `refined` (separable least squares; Golub and Pereyra 1973)."""
    assert fit.mesh is not None
    state, free = State.of(fit.model, fit.mesh, data), fit.model.free
    system = normal_system(state, data, fit.noise)
    seen = _shown(fit.model, data, state.deflection)
    _, along = _normal(fit.model, replace(data, dte=seen + change), state.operator, state.deflection, fit.mesh.shapes)
    precision = 2.0 / fit.noise
    counted = data.weight[:, None, None] ** 2 * data.valid[:, :, None] * (data.dte != 0)
    size, product = (
        precision * float(np.sum(counted * (change.conj() * other).real)) for other in (change, data.dte - seen)
    )
    taken = precision * along / system.size
    shift = cho_solve(cho_factor(system.total, lower=True), taken)
    # What the parameters cannot take in, of which rounding leaves a little all the same.
    told_by = max(size - float(taken @ shift), TINY * size)
    moved = shift / system.size
    whole = np.concatenate([moved[:free], fit.mesh.shapes.of(moved[free:])])
    return (product - float(shift @ system.pull)) / told_by, float(told_by**-0.5), whole


@dataclass(frozen=True)
class State:
    """A model, what its mesh is made of, its response (C, S, E), that of the deflection, and its output error: infinite
    where there is no response."""

    model: Model
    mesh: Mesh
    operator: Operator
    deflection: Complexes
    cost: float

    @staticmethod
    def of(model: Model, mesh: Mesh, data: ClassData) -> State:
        operator, deflection, cost = _responding(model, data)
        return State(model, mesh, operator, deflection, cost)

    def objective(self, noise: float) -> float:
        """What a step must lower: the error and, in its units, how unlikely amplitudes are under a prior that is held.
        One that follows the estimate does not hold a step back."""
        return self.cost + (0.5 * noise * self.mesh.unlikely if self.mesh.held else 0.0)

    def moved(self, step: Floats, data: ClassData) -> State:
        """The same with parameters moved by a step of D, N and the amplitudes, its common factor that of its own N."""
        free, mesh = self.model.free, self.mesh.moved(step[self.model.free :])
        model = self.model.moved(np.concatenate([self.model.vector()[:free] + step[:free], mesh.harmonics]))
        factor = gauge_factor(model, data)
        return State.of(model.scaled(factor), mesh.scaled(factor**model.gauge), data)


def normal_system(now: State, data: ClassData, noise: float) -> System:
    """Normal equations at a state."""
    model, mesh, free = now.model, now.mesh, now.model.free
    gram, right = _normal(model, data, now.operator, now.deflection, mesh.shapes)
    vector = np.concatenate([model.vector()[:free], mesh.amplitudes])
    direction = np.concatenate([model.scale_direction()[:free], model.gauge * mesh.amplitudes])
    prior = np.concatenate([np.zeros(free), mesh.precision])
    return System(vector, direction, gram, right, noise, prior)


def _damped(
    now: State, system: System, data: ClassData, noise: float, damping: float
) -> tuple[State | None, float]:
    """The state after the step, or the first of ever more damped ones that lowers the objective (does not raise it by
    SETTLED of it, where the prior is renewed all the same), if any; the damping that the next step begins with."""
    least = now.objective(noise) * (1.0 if now.mesh.held else 1.0 + SETTLED)
    for _ in range(TRIALS):
        trial = now.moved(system.step(damping), data)
        if trial.objective(noise) < least:
            return trial, damping / GROWTH if damping > DAMPING else 0.0
        damping = max(GROWTH * damping, DAMPING)
    return None, damping


def _cost(data: ClassData, predicted: Complexes) -> float:
    left = (data.dte - predicted) * data.weight[:, None, None] * data.valid[:, :, None]
    left = left * (np.abs(data.dte).sum(axis=1, keepdims=True) > 0)
    value = float(np.sum(left.real**2 + left.imag**2))
    return value if np.isfinite(value) else np.inf


def _freedom(data: ClassData, now: State) -> float:
    return max(data.equations - 0.5 * (now.model.free + now.mesh.determined), 1.0)


def derivatives(
    model: Model, data: ClassData, operator: Operator, deflection: Complexes, shapes: Shapes | None = None
) -> Iterator[tuple[int, Complexes, Complexes]]:
    """Class, weighted derivatives (S, P) of its response, 0 on lines that are not valid, and weighted residual (S,) of
    each realisation, at the model's own `deflection` (C, S, E): with respect to its parameters, or to those of D and N
    and the amplitudes of `shapes` of the mesh."""
    free = model.free
    for index in range(data.lines.shape[0]):
        omega, modelled = data.omega[index], data.modelled[index]
        values, weight = model.basis.at(omega), data.weight[index] * data.valid[index]
        for experiment in range(data.dte.shape[2]):
            measured = data.dte[index, :, experiment]
            if not measured.any():
                continue
            y = deflection[index, :, experiment] * modelled
            u = data.force[index, :, experiment]
            columns = -model.columns(values, omega, y, u)
            if shapes is not None:
                columns = np.concatenate([columns[:, :free], shapes.columns(columns[:, free:])], axis=1)
            columns = operator.solve(index, columns * modelled[:, None], even=True)
            columns = data.sampled(model.shown_columns(values, omega, columns, y, u)) * weight[:, None]
            shown = data.sampled(model.shown(omega, y, u) * modelled)
            yield index, columns, (measured - shown) * weight


def _normal(
    model: Model, data: ClassData, operator: Operator, deflection: Complexes, shapes: Shapes | None = None
) -> tuple[Floats, Floats]:
    """J^T J and J^T r of the stacked real equations of `derivatives`."""
    count = model.vector().size if shapes is None else model.free + shapes.weight.size
    gram, right = np.zeros((count, count)), np.zeros(count)
    for index, columns, left in derivatives(model, data, operator, deflection, shapes):
        own, mirrored = data.valid[index], 2 * data.weight[index] ** 2 <= 1.01
        if mirrored:  # its own mirror image: one half says all
            own = own & (data.lines[index] >= 0)
        columns, left = columns[own], left[own]
        if mirrored:
            columns, left = columns * np.sqrt(2.0), left * np.sqrt(2.0)
        stacked = np.concatenate([columns.real, columns.imag])
        gram += stacked.T @ stacked
        right += stacked.T @ np.concatenate([left.real, left.imag])
    return gram, right


class System:
    """Normal equations of all real parameters `vector`, scaled to a diagonal of one; `direction`: along which all have
    a common factor; `noise`: variance of a complex equation."""

    def __init__(
        self, vector: Floats, direction: Floats, gram: Floats, right: Floats, noise: float, prior: Floats
    ) -> None:
        precision = 2.0 / noise
        total = precision * gram + np.diag(prior)
        self.size = np.sqrt(np.maximum(np.diagonal(total), TINY * np.diagonal(total).max()))
        self.pull = (precision * right - prior * vector) / self.size
        self.total = total / self.size / self.size[:, None]
        self.total[np.diag_indices_from(self.total)] += TINY
        scaled = direction * self.size
        scaled /= np.linalg.norm(scaled)
        self.total += GAUGE * np.outer(scaled, scaled)

    def step(self, damping: float) -> Floats:
        """Step of all parameters; `damping` relative to the diagonal."""
        total = self.total + damping * np.eye(self.size.size)
        return np.asarray(cho_solve(cho_factor(total, lower=True), self.pull) / self.size)

    def root(self, middle: Floats | None = None) -> Floats:
        """R of the covariance R R^T of all parameters: the inverse, or that on both sides of a `middle` (P, P) of other
        units than these equations' (White 1982, of errors that differ between equations).

        A factor's inverse, not the inverse's factor: where parameters stand in for each other the inverse loses what
        the lines know well, and draws from it leave the record by many deviations.
        """
        lower, own = np.linalg.cholesky(self.total), np.eye(self.size.size)
        if middle is not None:
            scaled = middle / self.size / self.size[:, None]
            scaled[np.diag_indices_from(scaled)] += TINY
            own = solve_triangular(lower, np.linalg.cholesky(scaled), lower=True)
        inverse = solve_triangular(lower, own, lower=True, trans="T")
        return np.asarray(inverse / self.size[:, None])
