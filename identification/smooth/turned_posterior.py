"""Smooth branches at a speed that varies, given the rows of one window: `posterior.py` with delays for functions.

Each function is a sum over delays with prior variances s^2 w_q, so that rows have the covariance

    K = sum_g s_g^2 Phi_g diag(w) Phi_g^H + n I

over branches, what the speed changes of them, orders of the operating response, and transients. Sizes are MacKay's
fixed points again; all orders of the operating response share one, transients likewise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.smooth.posterior import (
    FIRST_NOISE,
    LEAST_NOISE,
    LEAST_SIZE,
    Sizes,
    factored,
    next_sizes,
    spread,
    tied_orders,
)
from gearbench.identification.smooth.turned import POWERS, Turned
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra


@dataclass(frozen=True)
class TurnedEquations:
    """Rows of a window around the line `centre`: `data` (N,), `columns` (N, G, Q), each times the root of its prior
    weight. Groups: (POWERS, 2J+1) branches, `orders` of the operating response, a transient for each realisation; `law`
    (G,): sizes to begin with, relative to one another."""

    data: Complexes
    columns: Complexes
    centre: int
    turned: Turned
    orders: int
    law: Floats

    @property
    def power(self) -> float:
        """Mean |data|^2 [m^2]."""
        return float(np.mean(np.abs(self.data) ** 2))

    @property
    def harmonics(self) -> int:
        """Branches on each side."""
        return self.turned.branches.shape[2] // 2

    @property
    def of_branches(self) -> int:
        """Groups of branches."""
        return POWERS * (2 * self.harmonics + 1)

    @property
    def flat(self) -> Complexes:
        """Columns (N, G Q)."""
        return self.columns.reshape(self.data.size, -1)


@dataclass(frozen=True)
class TurnedPosterior:
    """As `Posterior`, of `TurnedEquations`."""

    equations: TurnedEquations
    sizes: Sizes
    inverse: Complexes
    weights: Complexes
    evidence: float

    @property
    def determined(self) -> float:
        """Number of unknowns that the data determine, N - n tr K^-1."""
        return self.equations.data.size - self.sizes.noise * float(np.trace(self.inverse).real)

    def mean(self, offset: Floats) -> Complexes:
        """Branches (M, 2J+1) at the mean speed, at the `offset` (M,) [lines] from the middle."""
        equations = self.equations
        count = 2 * equations.harmonics + 1
        held = np.einsum("ngq,n->gq", equations.columns[:, :count].conj(), self.weights)
        held *= self.sizes.functions[:count, None] * np.sqrt(equations.turned.delays.weights)
        return np.asarray(np.einsum("mgq,gq->mg", self._turn(offset), held))

    def variance(self, offset: float) -> tuple[Floats, Floats]:
        """E|error|^2 (2J+1,) of the branches at one `offset`, and the part of it that is noise."""
        equations = self.equations
        count = 2 * equations.harmonics + 1
        turn = self._turn(np.array([offset]))[0].conj() * np.sqrt(equations.turned.delays.weights)
        shared = np.einsum("ngq,gq->ng", equations.columns[:, :count], turn)
        return spread(self.sizes.functions[:count], self.sizes.noise, shared, self.inverse @ shared)

    def _turn(self, offset: Floats) -> Complexes:
        """exp(-j w tau) (M, 2J+1, Q) at the middle between input and output line."""
        turned = self.equations.turned
        j = np.arange(-self.equations.harmonics, self.equations.harmonics + 1)
        return turned.delays.turn(self.equations.centre + offset[:, None] + 0.5 * j * turned.mesh_lines)


def turned_equations(spectra: Spectra, turned: Turned, centre: int, half_width: int) -> TurnedEquations:
    """The equations of the window of 2n+1 lines around `centre`, of all realisations."""
    rows = np.arange(centre - half_width, centre + half_width + 1)
    at, runs, delays = rows + turned.before, spectra.realisations, turned.delays
    root = np.sqrt(delays.weights)
    low, high = turned.orders.T
    orders = np.flatnonzero((high >= rows[0] - 1) & (low <= rows[-1] + 1))
    count = runs * rows.size
    # (P, E, J, Q, S) -> (E, S, P, J, Q)
    branches = turned.branches[..., at].transpose(1, 4, 0, 2, 3).reshape(count, -1, root.size)
    operating = turned.operating[:, orders][..., at].transpose(0, 3, 1, 2).reshape(count, -1, root.size)
    ends: Complexes = np.zeros((runs, rows.size, runs, root.size), dtype=complex)
    ends[np.arange(runs), :, np.arange(runs)] = delays.turn(rows.astype(float))
    columns = np.concatenate([branches, operating, ends.reshape(count, runs, root.size)], axis=1) * root
    dte = np.where(rows < 0, spectra.dte[:, np.abs(rows)].conj(), spectra.dte[:, np.abs(rows)])
    dte = np.where(rows == 0, 0.0, dte).ravel()
    return TurnedEquations(dte, columns, centre, turned, orders.size, _law(columns, dte, turned, orders.size))


def _law(columns: Complexes, data: Complexes, turned: Turned, orders: int) -> Floats:
    """Sizes (G,) that explain the data's power: branches like 1/l^2, what the speed changes of them a tenth of that,
    each order of the operating response and transients by themselves."""
    strength = np.mean(np.sum(np.abs(columns) ** 2, axis=2), axis=0)
    power = float(np.mean(np.abs(data) ** 2))
    harmonics = turned.branches.shape[2] // 2
    order = np.maximum(np.abs(np.arange(-harmonics, harmonics + 1)), 0.5)
    law = np.empty(strength.size)
    first = POWERS * order.size
    law[:first] = np.concatenate([0.1**power_ / order**2 for power_ in range(POWERS)])
    law[:first] *= power / max(float(law[:first] @ strength[:first]), np.finfo(float).tiny)
    total = max(float(strength[first : first + orders].sum()), np.finfo(float).tiny)
    law[first : first + orders] = power / total
    law[first + orders :] = FIRST_NOISE * power / np.maximum(strength[first + orders :], np.finfo(float).tiny)
    return np.where(strength > 0, law, 0.0)


def turned_posterior(equations: TurnedEquations, before: TurnedPosterior | None, rounds: int) -> TurnedPosterior:
    """The posterior after so many `rounds` of the fixed point, beginning with the sizes of the window `before`."""
    ties = _ties(equations)
    found = _conditioned(equations, _first(equations, before))
    for _ in range(rounds):
        found = _conditioned(equations, _next(found, ties))
    return found


def _first(equations: TurnedEquations, before: TurnedPosterior | None) -> Sizes:
    law = equations.law
    if before is None:
        return Sizes(law, FIRST_NOISE * equations.power)
    first, known = equations.of_branches, before.sizes.functions
    sizes = np.concatenate([
        known[:first], np.full(equations.orders, known[first] if before.equations.orders else 0.0),
        known[first + before.equations.orders :],
    ])  # fmt: skip
    return Sizes(np.maximum(sizes, LEAST_SIZE * law) * (law > 0), before.sizes.noise)


def _conditioned(equations: TurnedEquations, sizes: Sizes) -> TurnedPosterior:
    """The posterior for known sizes. Raises numpy.linalg.LinAlgError where K is singular."""
    scaled = (equations.columns * np.sqrt(sizes.functions)[:, None]).reshape(equations.data.size, -1)
    total = scaled @ scaled.conj().T
    trace = float(np.trace(total).real) / equations.data.size
    noise = max(sizes.noise, LEAST_NOISE * max(trace, equations.power))
    total[np.diag_indices(equations.data.size)] += noise
    inverse, weights, evidence = factored(total, equations.data)
    return TurnedPosterior(equations, Sizes(sizes.functions, noise), inverse, weights, evidence)


def _next(found: TurnedPosterior, ties: Floats) -> Sizes:
    """One round, as at constant speed."""
    equations, size, flat = found.equations, found.sizes.functions, found.equations.flat
    shape = equations.columns.shape[1:]
    held = size**2 * np.sum(np.abs((flat.conj().T @ found.weights).reshape(shape)) ** 2, axis=1)
    seen = found.inverse @ flat
    each = np.einsum("nf,nf->f", flat.real, seen.real) + np.einsum("nf,nf->f", flat.imag, seen.imag)
    determined = size * each.reshape(shape).sum(axis=1)
    return next_sizes(found.sizes, ties @ held, ties @ determined, found.weights, found.inverse)


def _ties(equations: TurnedEquations) -> Floats:
    """Which groups (G, G) share a size: branches of nearly the same order and power, all orders, all transients."""
    own = tied_orders(equations.harmonics)
    runs = equations.columns.shape[1] - equations.of_branches - equations.orders
    blocks: list[NDArray[np.float64]] = [own] * POWERS + [np.ones((n, n)) for n in (equations.orders, runs)]
    ties = np.zeros((equations.columns.shape[1],) * 2)
    at = 0
    for block in blocks:
        ties[at : at + block.shape[0], at : at + block.shape[0]] = block
        at += block.shape[0]
    return ties
