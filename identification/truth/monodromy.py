"""Exact ITF by the piecewise-constant monodromy: state transition over the pieces of one period.

Within a piece of length h with constant A and B the response to exp(j w t) is known in closed form,

    x(t + h) = exp(A h) x(t) + (jw - A)^-1 (exp(jw h) - exp(A h)) B exp(jw t),

and the steady state satisfies x(t + T) = exp(jw T) x(t). Smooth coefficients are brought to this form by
the fourth-order commutator-free exponential integrator (Blanes and Moan, Appl. Numer. Math. 56, 2006): each
step becomes two pieces of half its length with combined coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from gearbench.identification.truth.periodic import Complexes, Floats, PeriodicSystem, PeriodicSystemError

# Smooth coefficients: largest step times the fastest frozen eigenvalue [rad].
SMOOTH_STEP = 1.0
# States kept at once (pieces x states x frequencies): 64 MB of complex numbers.
STATES_AT_ONCE = 4_000_000
# Change of phase and size within a piece below which the series of the exponentials is taken.
SHORT = 1e-4
# Above this condition number of its eigenvectors a piece is solved instead of diagonalised.
DEFECTIVE = 1e6


@dataclass(frozen=True)
class _Pieces:
    """Consecutive constant pieces of one period: lengths (K,) [s], a (K, n, n), b (K, n)."""

    length: Floats
    a: Floats
    b: Floats


@dataclass(frozen=True)
class _Modal:
    """Of each piece: eigenvalues (K, n), eigenvectors (K, n, n), b in them (K, n), whether they can be used (K,)."""

    values: Complexes
    vectors: Complexes
    source: Complexes
    good: np.ndarray


def exact_itf(system: PeriodicSystem, frequency: ArrayLike, phase: ArrayLike, *, steps: int | None = None) -> Complexes:
    """Exact ITF (frequency, phase) [output/input] at the frequencies [Hz] and phases [cycles].

    `steps` per period matters for trigonometric systems only (default: SMOOTH_STEP, at least one per grid point;
    good to 5e-6);
    piecewise systems are exact. Raises PeriodicSystemError if the system is unstable (no steady state
    exists).
    """
    frequencies = np.atleast_1d(np.asarray(frequency, dtype=float))
    phases = np.atleast_1d(np.asarray(phase, dtype=float)) % 1.0
    balanced = system.balanced()
    count = _step_count(balanced, steps)
    if system.interpolation != "piecewise":
        count = _with_phases(count, phases)
    edges, wanted = _edges(count, phases)
    pieces, every = _pieces(balanced, edges)
    modal = _modal(pieces)
    transition = expm(pieces.a * pieces.length[:, None, None])
    _require_stable(transition)
    _, _, output = balanced.at(phases)
    itf = np.empty((frequencies.size, phases.size), dtype=complex)
    stride = max(1, STATES_AT_ONCE // pieces.b.size)
    for start in range(0, frequencies.size, stride):
        part = slice(start, start + stride)
        omega = 2 * np.pi * frequencies[part]
        states = _periodic_states(pieces, modal, transition, omega)[wanted * every]
        turn = np.exp(-1j * np.outer(omega, phases * system.period))
        itf[part] = np.einsum("pi,pif->fp", output, states) * turn + system.d
    return itf


def floquet_multipliers(system: PeriodicSystem, *, steps: int | None = None) -> Complexes:
    """Eigenvalues (n,) of the monodromy matrix; the system is stable when all lie inside the unit circle."""
    balanced = system.balanced()
    edges, _ = _edges(_step_count(balanced, steps), np.zeros(1))
    pieces, _ = _pieces(balanced, edges)
    monodromy = _product(expm(pieces.a * pieces.length[:, None, None]))
    return np.asarray(np.linalg.eigvals(monodromy), dtype=complex)


def _step_count(system: PeriodicSystem, steps: int | None) -> int:
    if system.interpolation == "piecewise":
        return system.phases
    if steps is not None:
        return steps
    fastest = np.abs(np.linalg.eigvals(system.a[:: max(1, system.phases // 64)])).max()
    # Neither the fastest mode nor the coefficients may be strode over.
    return max(system.phases, int(np.ceil(fastest * system.period / SMOOTH_STEP)))


def _with_phases(steps: int, phases: Floats) -> int:
    """Steps rounded up until phases k/P lie on their grid: pieces of one length, coefficients by FFT."""
    uniform = phases.size > 1 and np.abs(phases - np.arange(phases.size) / phases.size).max() < 1e-13
    return -(-steps // phases.size) * phases.size if uniform else steps


def _edges(steps: int, phases: Floats) -> tuple[Floats, np.ndarray]:
    """Edges of all pieces [cycles], from 0 to 1, that include the wanted phases, and the index of each of those."""
    grid = np.arange(steps) / steps
    # Phases on the grid up to rounding must not create pieces of vanishing length.
    snapped = np.round(phases * steps) / steps
    points = np.where(np.abs(snapped - phases) < 1e-10, snapped, phases) % 1.0
    edges = np.union1d(grid, points)
    return np.append(edges, 1.0), np.searchsorted(edges, points)


def _pieces(system: PeriodicSystem, edges: Floats) -> tuple[_Pieces, int]:
    """Constant pieces between the edges, and how many pieces each interval has become."""
    length = np.diff(edges) * system.period
    if system.interpolation == "piecewise":
        a, b, _ = system.at(0.5 * (edges[1:] + edges[:-1]))
        return _Pieces(length, a, b), 1
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    root = np.sqrt(3.0)
    a1, b1, _ = system.at(middle - half / root)
    a2, b2, _ = system.at(middle + half / root)
    weight = 0.5 + 1.0 / root
    first, second = ((w * a1 + (1 - w) * a2, w * b1 + (1 - w) * b2) for w in (weight, 1 - weight))
    a = np.stack([first[0], second[0]], axis=1).reshape(-1, system.states, system.states)
    b = np.stack([first[1], second[1]], axis=1).reshape(-1, system.states)
    return _Pieces(np.repeat(length / 2, 2), a, b), 2


def _product(transition: Floats) -> Floats:
    """transition[-1] @ ... @ transition[0], pairwise."""
    while transition.shape[0] > 1:
        odd = transition[-1:] if transition.shape[0] % 2 else transition[:0]
        even = transition[: transition.shape[0] // 2 * 2]
        transition = np.concatenate([even[1::2] @ even[::2], odd])
    return transition[0]


def _require_stable(transition: Floats) -> None:
    largest = np.abs(np.linalg.eigvals(_product(transition))).max()
    if largest >= 1.0:
        raise PeriodicSystemError(
            f"the periodic system is unstable (largest Floquet multiplier {largest:.4g} >= 1): no steady state"
        )


def _periodic_states(pieces: _Pieces, modal: _Modal, transition: Floats, omega: Floats) -> Complexes:
    """States (K, n, F) at the beginning of each piece in the periodic response to exp(j w t)."""
    forcing = _forcing(pieces, modal, transition, omega)
    particular, homogeneous = _propagate(transition, forcing)
    closing = np.exp(1j * omega * pieces.length.sum())[:, None, None] * np.eye(pieces.b.shape[1])
    initial = np.linalg.solve(closing - homogeneous[-1], particular[-1].T[:, :, None])[:, :, 0].T
    return particular[:-1] + homogeneous[:-1] @ initial


def _propagate(transition: Floats, forcing: Complexes) -> tuple[Complexes, Floats]:
    """From rest the states (K+1, n, F), and from the unit states the states (K+1, n, n), at all piece edges.

    The pieces are cut into about sqrt(K) runs that advance side by side; then the runs are joined.
    """
    count, states, width = forcing.shape
    steps = int(np.ceil(np.sqrt(count)))
    runs = -(-count // steps)
    padding = runs * steps - count
    matrices = np.concatenate([transition, np.broadcast_to(np.eye(states), (padding, states, states))])
    matrices = matrices.reshape(runs, steps, states, states)
    # A complex column is two real ones: the transition matrices are real.
    source = np.zeros((runs * steps, states, 2 * width))
    source[:count] = np.ascontiguousarray(forcing).view(float)
    source = source.reshape(runs, steps, states, 2 * width)
    particular = np.zeros((runs, steps + 1, states, 2 * width))
    homogeneous = np.zeros((runs, steps + 1, states, states))
    homogeneous[:, 0] = np.eye(states)
    for step in range(steps):
        particular[:, step + 1] = matrices[:, step] @ particular[:, step] + source[:, step]
        homogeneous[:, step + 1] = matrices[:, step] @ homogeneous[:, step]
    for run in range(1, runs):
        particular[run] += homogeneous[run] @ particular[run - 1, -1]
        homogeneous[run] = homogeneous[run] @ homogeneous[run - 1, -1]
    x = np.concatenate([particular[:, :-1].reshape(-1, states, 2 * width), particular[-1:, -1]])[: count + 1]
    phi = np.concatenate([homogeneous[:, :-1].reshape(-1, states, states), homogeneous[-1:, -1]])[: count + 1]
    return np.ascontiguousarray(x).view(complex), phi


def _modal(pieces: _Pieces) -> _Modal:
    values, vectors = np.linalg.eig(pieces.a)
    good = np.linalg.cond(vectors) < DEFECTIVE
    source = np.zeros(pieces.b.shape, dtype=complex)
    source[good] = np.linalg.solve(vectors[good], pieces.b[good][:, :, None].astype(complex))[:, :, 0]
    return _Modal(values, vectors, source, good)


def _forcing(pieces: _Pieces, modal: _Modal, transition: Floats, omega: Floats) -> Complexes:
    """Contribution (K, n, F) of the input within each piece to the state at its end."""
    start = np.concatenate([[0.0], np.cumsum(pieces.length)[:-1]])
    carrier = np.exp(1j * np.outer(start, omega))
    growth = _growth(modal.values, pieces.length, omega)
    growth *= modal.source[:, :, None]
    forcing = modal.vectors @ growth
    for index in map(int, np.flatnonzero(~modal.good)):
        forcing[index] = _forcing_by_solving(pieces, transition[index], index, omega)
    forcing *= carrier[:, None, :]
    return forcing


def _growth(values: Complexes, length: Floats, omega: Floats) -> Complexes:
    """(exp(jw h) - exp(lambda h)) / (jw - lambda), (K, n, F), for the eigenvalues (K, n) of pieces of length h (K,)."""
    gap = 1j * omega - values[:, :, None]
    # Most pieces are equally long: each length's carrier is computed once, which an exponential of the gap is not.
    lengths, which = np.unique(length, return_inverse=True)
    end = np.exp(values * length[:, None])
    growth = np.exp(1j * np.outer(lengths, omega))[which][:, None, :] - end[:, :, None]
    growth /= gap
    # The difference loses the digits that a short piece's exponentials share: there by the series.
    short = np.abs(gap) * length[:, None, None] < SHORT
    if short.any():
        piece, mode, _ = np.nonzero(short)
        change = gap[short] * length[piece]
        growth[short] = length[piece] * end[piece, mode] * (1 + change / 2 * (1 + change / 3 * (1 + change / 4)))
    return growth


def _forcing_by_solving(pieces: _Pieces, transition: Floats, index: int, omega: Floats) -> Complexes:
    a, b, length = pieces.a[index], pieces.b[index], pieces.length[index]
    eye = np.eye(b.size)
    right = np.exp(1j * omega * length)[:, None] * b - (transition @ b)[None, :]
    return np.linalg.solve(1j * omega[:, None, None] * eye - a, right[:, :, None])[:, :, 0].T
