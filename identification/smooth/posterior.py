"""Branches as smooth random functions of frequency, given the rows of one window.

A branch is the transform of an impulse response that dies away: with a variance exp(-2 a t) at the lag t its values at
two lines correlate like

    k(f - f') = 1 / (1 + j (f - f') / B),      B = a / pi, the half-power bandwidth of what dies away like exp(-a t)

(the diagonal kernel of Chen, Ohlsson and Ljung, Automatica 48, 2012, in the frequency domain; Lataire and Chen,
Automatica 72, 2016). Rows Y = sum_l Gs_l U_l + V then have the covariance

    K = sum_l s_l^2 k o (U_l U_l^H) + n I      (o: element by element),

and what is known of a branch follows from Gaussian conditioning (Rasmussen and Williams 2006, 2.2): unknowns cost only
what the data say of them, so that there may be more branches than a polynomial model could pay for.

The sizes s_l^2 and n are the fixed points s_l^2 = |branch|^2 / (its well-determined number of unknowns) of MacKay
(Neural Computation 4, 1992), where the likelihood of the data is stationary; branches of nearly the same order share
one size, lest there be more sizes than data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from gearbench.identification.spectra.joint import Complexes, Floats

# Branches that share a size with branch l: within this part of |l|.
SHARED = 0.15
# Least noise as part of the rows' prior variance: what rounding bears.
LEAST_NOISE = 1e-10
# Largest change of a size in a round: far from the fixed point the next one may lie anywhere.
LARGEST_CHANGE = 10.0
# Noise as part of the data's power, and least size of a branch beside the law 1/l^2, before anything is known.
FIRST_NOISE, LEAST_SIZE = 0.03, 1e-4


@dataclass(frozen=True)
class Equations:
    """Rows of a window: `data` (N,), `columns` (N, C), `offset` (N,) of each row from the middle [lines]; the first
    2L+1 columns are branches, the rest transients, one for each experiment."""

    data: Complexes
    columns: Complexes
    offset: Floats
    harmonics: int

    @property
    def power(self) -> float:
        """Mean |data|^2 [m^2]."""
        return float(np.mean(np.abs(self.data) ** 2))


@dataclass(frozen=True)
class Sizes:
    """Prior variances (C,) of the columns' functions, and the variance of the `noise` on a row [m^2]."""

    functions: Floats
    noise: float


@dataclass(frozen=True)
class Posterior:
    """What the data of `equations` say: K^-1 (N, N), K^-1 Y (N,), and the log likelihood `evidence` but for a
    constant."""

    equations: Equations
    sizes: Sizes
    bandwidth: float
    inverse: Complexes
    weights: Complexes
    evidence: float

    @property
    def determined(self) -> float:
        """Number of unknowns that the data determine, N - n tr K^-1."""
        return self.equations.data.size - self.sizes.noise * float(np.trace(self.inverse).real)

    def mean(self, offset: Floats) -> Complexes:
        """Functions (M, C) at the `offset` (M,) [lines]."""
        rows = correlation(offset[:, None] - self.equations.offset, self.bandwidth)
        return np.asarray(self.sizes.functions * (rows @ (self.equations.columns.conj() * self.weights[:, None])))

    def variance(self, offset: float) -> tuple[Floats, Floats]:
        """E|error|^2 (C,) of the functions at one `offset`, and the part of it that is noise."""
        row = correlation(offset - self.equations.offset, self.bandwidth)
        shared = row.conj()[:, None] * self.equations.columns
        return spread(self.sizes.functions, self.sizes.noise, shared, self.inverse @ shared)


def spread(size: Floats, noise: float, shared: Complexes, seen: Complexes) -> tuple[Floats, Floats]:
    """E|error|^2 (C,) of functions of prior variance `size` (C,) that share `shared` (N, C) with the rows, of which the
    data show `seen` (N, C) = K^-1 shared, and the part of it that is `noise`."""
    known = size**2 * np.einsum("nc,nc->c", shared.conj(), seen).real
    noisy = size**2 * noise * np.einsum("nc,nc->c", seen.conj(), seen).real
    return np.maximum(size - known, 0.0), noisy


def correlation(lines: Floats, bandwidth: float) -> Complexes:
    """Correlation of a branch's values at a distance of `lines`, for a `bandwidth` [lines]."""
    return np.asarray(1.0 / (1.0 + 1j * lines / bandwidth))


def first_sizes(equations: Equations) -> Sizes:
    """Sizes that fall like the harmonics of a stiffness that jumps, 1/l^2, and explain the data's power."""
    strength = np.mean(np.abs(equations.columns) ** 2, axis=0)
    branches = 2 * equations.harmonics + 1
    law = np.ones(strength.size)
    law[:branches] = 1.0 / np.maximum(np.abs(np.arange(branches) - equations.harmonics), 0.5) ** 2
    total = float(law[:branches] @ strength[:branches])
    law[:branches] *= equations.power / max(total, np.finfo(float).tiny)
    law[branches:] = FIRST_NOISE * equations.power
    return Sizes(law * (strength > 0), FIRST_NOISE * equations.power)


def conditioned(equations: Equations, sizes: Sizes, bandwidth: float) -> Posterior:
    """The posterior for known sizes and `bandwidth` [lines]. Raises numpy.linalg.LinAlgError where K is singular."""
    count = equations.data.size
    near = correlation(equations.offset[:, None] - equations.offset, bandwidth)
    total = near * ((equations.columns * sizes.functions) @ equations.columns.conj().T)
    noise = max(sizes.noise, LEAST_NOISE * max(float(np.trace(total).real) / count, equations.power))
    total[np.diag_indices(count)] += noise
    inverse, weights, evidence = factored(total, equations.data)
    return Posterior(equations, Sizes(sizes.functions, noise), bandwidth, inverse, weights, evidence)


def factored(total: Complexes, data: Complexes) -> tuple[Complexes, Complexes, float]:
    """K^-1 (N, N), K^-1 Y (N,) and the log likelihood but for a constant, of a covariance K = `total` (N, N) and `data`
    (N,). Raises numpy.linalg.LinAlgError where K is singular."""
    triangle, failed = lapack.zpotrf(total, lower=1, clean=1)
    if failed:
        raise np.linalg.LinAlgError("the covariance of the rows is singular")
    evidence = -2.0 * float(np.log(np.diagonal(triangle).real).sum())
    half, _ = lapack.zpotri(triangle, lower=1)
    inverse = np.tril(half) + np.tril(half, -1).conj().T
    weights = inverse @ data
    return inverse, weights, evidence - float(np.vdot(data, weights).real)


def refined(equations: Equations, start: Sizes, bandwidth: float, rounds: int) -> Posterior:
    """The posterior after so many `rounds` of the fixed point for the sizes."""
    ties = _ties(equations)
    found = conditioned(equations, start, bandwidth)
    for _ in range(rounds):
        found = conditioned(equations, _next_sizes(found, ties), bandwidth)
    return found


def _next_sizes(found: Posterior, ties: Floats) -> Sizes:
    """One round: each size is what the functions that share it hold over how much of them the data determine."""
    equations, size = found.equations, found.sizes.functions
    near = correlation(equations.offset[:, None] - equations.offset, found.bandwidth)
    columns = equations.columns
    turned = columns.conj() * found.weights[:, None]
    held = size**2 * np.einsum("nc,nc->c", turned.conj(), near @ turned).real
    determined = size * np.einsum("nc,nc->c", columns, (found.inverse.T * near) @ columns.conj()).real
    held, determined = ties @ np.maximum(held, 0.0), ties @ np.maximum(determined, 0.0)
    return next_sizes(found.sizes, held, determined, found.weights, found.inverse)


def next_sizes(sizes: Sizes, held: Floats, determined: Floats, weights: Complexes, inverse: Complexes) -> Sizes:
    """Sizes of functions that hold so much power `held` (C,) over numbers that the data have `determined` (C,); the
    noise likewise, from K^-1 Y and K^-1. No size changes by more than LARGEST_CHANGE."""
    found = np.where(determined > 0, held / np.where(determined > 0, determined, 1.0), 0.0)
    least, most = sizes.functions / LARGEST_CHANGE, sizes.functions * LARGEST_CHANGE
    change = float(np.vdot(weights, weights).real / np.trace(inverse).real)
    change = min(max(change, 1.0 / LARGEST_CHANGE), LARGEST_CHANGE)
    return Sizes(np.clip(found, least, most), sizes.noise * change)


def _ties(equations: Equations) -> Floats:
    """Which columns (C, C) share a size: branches of nearly the same order, and all transients."""
    count, branches = equations.columns.shape[1], 2 * equations.harmonics + 1
    ties = np.ones((count, count))
    ties[:branches, branches:] = ties[branches:, :branches] = 0.0
    ties[:branches, :branches] = tied_orders(equations.harmonics)
    return ties


def tied_orders(harmonics: int) -> Floats:
    """Which of the branches -L..L (2L+1, 2L+1) share a size."""
    order = np.arange(-harmonics, harmonics + 1)
    return np.asarray(np.abs(order[:, None] - order) <= np.round(SHARED * np.abs(order))[:, None], dtype=float)


def continued(equations: Equations, before: Sizes) -> Sizes:
    """Sizes to begin with beside a window whose sizes are known; none is nothing, lest it stay so."""
    law = first_sizes(equations)
    return Sizes(np.maximum(before.functions, LEAST_SIZE * law.functions) * (law.functions > 0), before.noise)
