"""The evidence of shapes of the mesh around a fit, where the response is linear in them (MacKay 1992).

The squared error with D and N at their best is a quadratic function of the mesh's harmonics; that of any other
amplitudes, their likeliest sizes and the evidence follow from its Gram matrix without another solution.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.refine import Refined, linearised
from gearbench.identification.feedback.shapes import Shapes
from gearbench.identification.spectra.joint import Floats

# Least size of amplitudes relative to the first one, and least number of them that counts as determined.
LEAST_SIZE, LEAST_DETERMINED = 1e-10, 1e-6
# Standard deviations of a remainder over which is averaged, relative to that of the zones beside it.
DEVIATIONS = np.geomspace(1e-4, 1.0, 14)
# Added to the scaled Gram matrix of D and N, and relative error below which rounding has the word.
FIRMNESS, EXACT = 1e-11, 1e-12


@dataclass(frozen=True)
class Marginal:
    """Squared error of a mesh m (4 L,), or of amplitudes, with D and N at their best: left - 2 right^T m + m^T gram m;
    `count`: real equations less parameters of D and N."""

    gram: Floats
    right: Floats
    left: float
    count: float

    def within(self, shapes: Shapes) -> Marginal:
        """The same of the amplitudes of shapes of this mesh."""
        gram = shapes.columns(shapes.columns(self.gram).T)
        return Marginal(gram, shapes.columns(self.right), self.left, self.count)

    def least(self) -> Floats:
        """Amplitudes of least error."""
        return np.asarray(np.linalg.lstsq(self.gram, self.right, rcond=1e-10)[0])

    def error(self, amplitudes: Floats) -> float:
        """Squared error, of which rounding leaves a little."""
        value = self.left - 2 * float(self.right @ amplitudes) + float(amplitudes @ self.gram @ amplitudes)
        return max(value, EXACT * self.left)


@dataclass(frozen=True)
class Evident:
    """Likeliest `amplitudes` (A,) under the prior `precision` (A,) and the variance `noise` of a real equation;
    `determined`: amplitudes that the record tells; `value`: -2 log evidence but for what all shapes share."""

    amplitudes: Floats
    precision: Floats
    noise: float
    determined: Floats
    value: float

    @staticmethod
    def of(error: Marginal, precision: Floats, noise: float) -> Evident:
        """Of the `error` (A,) of the amplitudes."""
        lower = _root(error.gram / noise + np.diag(precision))
        a = cho_solve((lower, True), error.right / noise)
        inverse = solve_triangular(lower, np.eye(a.size), lower=True)
        volume = 2 * float(np.sum(np.log(np.diagonal(lower)))) - float(np.sum(np.log(precision)))
        unlikely = error.error(a) / noise + float(a @ (precision * a))
        value = error.count * float(np.log(noise)) + unlikely + volume
        return Evident(a, precision, noise, 1.0 - precision * np.sum(inverse**2, axis=0), value)


def _root(total: Floats) -> Floats:
    """Cholesky factor (A, A) of a symmetric matrix of positive diagonal. One that rounding has left indefinite, as that
    of a record without noise is, counts as far as its largest eigenvalue, balanced, tells of others."""
    scale = np.sqrt(np.diagonal(total))
    balanced = total / np.outer(scale, scale)
    try:
        return np.asarray(scale[:, None] * np.linalg.cholesky(balanced))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(0.5 * (balanced + balanced.T))
        firm = np.maximum(values, EXACT * values[-1])
        # A triangle whose square is V diag(firm) V^T.
        upper = np.linalg.qr(np.sqrt(firm)[:, None] * vectors.T, mode="r")
        return np.asarray(scale[:, None] * (upper * np.sign(np.diagonal(upper))[:, None]).T)


def evident(error: Marginal, shapes: Shapes, first: Floats, rounds: int) -> Evident:
    """The likeliest sizes and noise of shapes whose own `error` (A,) is given: MacKay's fixed point, from `first`
    amplitudes."""
    precision = shapes.precision(first**2)
    largest = precision / LEAST_SIZE
    found = Evident.of(error, precision, error.error(first) / error.count)
    for _ in range(rounds):
        a, determined, precision = found.amplitudes, found.determined, found.precision.copy()
        noise = error.error(a) / max(error.count - float(determined.sum()), 1.0)
        for group in range(shapes.groups):
            own = shapes.group == group
            size = float(np.sum((shapes.weight * a**2)[own])) / max(float(determined[own].sum()), LEAST_DETERMINED)
            precision[own] = np.minimum(shapes.weight[own] / max(size, np.finfo(float).tiny), largest[own])
        found = Evident.of(error, precision, noise)
    return found


def averaged(error: Marginal, shapes: Shapes, found: Evident, group: int, beside: int) -> Evident:
    """The same with the size of a group that its evidence gives on average, with a prior that is flat in its standard
    deviation (Gelman 2006), up to that of the group `beside` it.

    The likeliest size is often none at all, where the record says no more than that it is small; the variance would
    then be short of what may be there.
    """
    own = shapes.group == group
    size = 1.0 / float(found.precision[shapes.group == beside][0])
    tried = []
    for deviation in DEVIATIONS:
        precision = found.precision.copy()
        precision[own] = shapes.weight[own] / (size * deviation**2)
        tried.append((deviation, Evident.of(error, precision, found.noise).value))
    deviations, values = np.array(tried).T
    weight = deviations * np.exp(-0.5 * (values - values.min()))
    precision = found.precision.copy()
    precision[own] = shapes.weight[own] / (size * float(np.sum(weight * deviations**2) / np.sum(weight)))
    return Evident.of(error, precision, found.noise)


def marginal(fit: Refined, data: ClassData, harmonics: int) -> Marginal:
    """The error around a fit as a function of its mesh alone, of so many harmonics, which are no fewer than its own."""
    model = lengthened(fit.model, harmonics)
    gram, right = linearised(model, data)
    free, mesh = model.free, model.vector()[model.free :]
    kept = np.delete(np.arange(free), model.d.size)  # N's first number is held: all may be multiplied by one
    scale = np.sqrt(np.maximum(np.diagonal(gram)[kept], np.finfo(float).tiny))
    own = gram[np.ix_(kept, kept)] / scale / scale[:, None]
    own[np.diag_indices_from(own)] += FIRMNESS
    across = gram[kept, free:] / scale[:, None]
    found = cho_solve(cho_factor(own, lower=True), np.column_stack([across, right[kept] / scale]))
    inner = gram[free:, free:] - across.T @ found[:, :-1]
    turned = right[free:] - across.T @ found[:, -1]
    cost = fit.noise * fit.freedom - float(right[kept] / scale @ found[:, -1])
    left = cost + 2 * float(turned @ mesh) + float(mesh @ inner @ mesh)
    return Marginal(inner, turned + inner @ mesh, left, 2 * data.equations - kept.size)


def lengthened(model: Model, harmonics: int) -> Model:
    """The same with so many harmonics, those beyond its own 0."""
    more = (0, max(harmonics - model.harmonics, 0))
    return replace(model, k=np.pad(model.k, more)[:harmonics], c=np.pad(model.c, more)[:harmonics])
