"""A first model from the equations themselves: linear in all parameters, homogeneous, solved by projection.

All parameters may be multiplied by one number, so that one size must be given. It is that of the lowest harmonics of
the stiffness: without them D and N alone would fit wherever the sidebands drown in noise. Everything else is
projected out (Golub and Pereyra 1973), the higher harmonics with the prior that they fall like 1/l, and the smallest
eigenvector of what is left gives the lowest harmonics. Noise in Y biases this; the refinement on the output error
does away with that.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, solve

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.functions import Basis
from gearbench.identification.feedback.model import Model
from gearbench.identification.spectra.joint import Floats

# Part of the diagonal that keeps splines without data solvable.
TINY = 1e-10
# Bins of frequency in which levels are judged, and multiple of the quietest bin's response below which lines count
# less.
BINS = 60
QUIET = 30.0
# Harmonics of the stiffness whose size is taken as one: no solution may do without them.
LOWEST = 3


def first_model(data: ClassData, basis: Basis, harmonics: int) -> Model:
    """Model from weighted equations, N = 1 at the lowest excited lines; poles of the basis stay."""
    weights, quiet = equation_weights(data)
    size = basis.at(np.zeros(1)).shape[1]
    none = np.zeros(harmonics, dtype=complex)
    model = Model(basis, np.zeros(size), np.zeros(size), none, none)
    gram, free = _gram(data, model, weights), model.free
    gram[np.arange(free), np.arange(free)] += TINY * np.diagonal(gram)[:free].mean()
    order = np.arange(1, harmonics + 1)
    gram[np.arange(free, gram.shape[0]), np.arange(free, gram.shape[0])] += quiet * np.tile(order**2, 4)
    low = min(LOWEST, harmonics)
    chosen = np.zeros(gram.shape[0], dtype=bool)
    for part in (free, free + harmonics):
        chosen[part : part + low] = True
    others = solve(gram[np.ix_(~chosen, ~chosen)], gram[np.ix_(~chosen, chosen)], assume_a="pos")
    reduced = gram[np.ix_(chosen, chosen)] - gram[np.ix_(chosen, ~chosen)] @ others
    _, vectors = eigh(0.5 * (reduced + reduced.T))
    vector = np.empty(gram.shape[0])
    vector[chosen] = vectors[:, 0]
    vector[~chosen] = -others @ vectors[:, 0]
    vector[free - basis.pairs.size : free] = basis.parameters
    return gauged(model.moved(vector), data)


def equation_weights(data: ClassData) -> tuple[Floats, float]:
    """Rms of response over rms of force around each line, which makes errors those of the response; less where the
    response is near its lowest level and 0 beyond the excited lines."""
    bins = np.clip((np.abs(data.omega) * BINS).astype(int), 0, BINS - 1)
    used = data.valid & (np.abs(data.lines) <= data.excited) & (data.lines != 0)
    response, force = (
        np.bincount(bins[used], weights=np.sum(np.abs(x) ** 2, axis=2)[used], minlength=BINS)
        for x in (data.dte, data.force)
    )
    count = np.maximum(np.bincount(bins[used], minlength=BINS), 1)
    level = response / count
    quiet = level[level > 0].min()
    ratio = np.sqrt(level * count / np.maximum(force, np.finfo(float).tiny)) * (force > 0)
    ratio = ratio * level / (level + QUIET * quiet)
    return np.where(used, ratio[bins], 0.0), float(quiet)


def _gram(data: ClassData, model: Model, weights: Floats) -> Floats:
    """Gram matrix of all columns of the equations for the measured response."""
    gram = np.zeros((model.vector().size,) * 2)
    for index, omega in enumerate(data.omega):
        weight = weights[index] * data.weight[index]
        values = model.basis.at(omega)
        for experiment in range(data.dte.shape[2]):
            y, u = data.dte[index, :, experiment] * data.valid[index], data.force[index, :, experiment]
            if not y.any():
                continue
            matrix = model.columns(values, omega, y, u) * weight[:, None]
            stacked = np.concatenate([matrix.real, matrix.imag])
            gram += stacked.T @ stacked
    return gram


def gauged(model: Model, data: ClassData) -> Model:
    """The same response with N real and 1 at frequency 0.

    All of D, N, k, c may be multiplied by one real number without a change of the response.
    """
    return model.scaled(gauge_factor(model, data))


def gauge_factor(model: Model, data: ClassData) -> float:
    """The number that N has to be multiplied by for that: N = N(0) (1 - w^2 ..) over the lowest twentieth of the band.

    On average over these lines N is less than 1 by some thousandths, and k would be more by as much.
    """
    position = data.begins
    return 1.0 / float(np.polyfit(position**2, model.functions(position)[1].real, 1)[1])
