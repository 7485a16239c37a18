"""Exact ITF by harmonic balance: truncated Toeplitz blocks (Wereley and Hall, ACC 1990).

The varying part of A is factorised as A(t) - A_0 = W Z(t) V^T with the smallest possible ranks, so that a
gear mesh, whose variation enters through one force, costs one unknown a harmonic instead of n:

    f = Z v,  v = V^T x,  x_m = (j(w + m ws) - A_0)^-1 (B_m + W f_m).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve

from gearbench.identification.truth.periodic import Complexes, Floats, PeriodicSystem, PeriodicSystemError

RANK_TOLERANCE = 1e-13
HARMONICS_MAX = 4096


def harmonic_balance_itf(
    system: PeriodicSystem,
    frequency: ArrayLike,
    phase: ArrayLike,
    *,
    harmonics: int | None = None,
    tolerance: float = 1e-9,
) -> Complexes:
    """Exact ITF (frequency, phase) at frequencies [Hz] and phases [cycles], with `harmonics` response harmonics.

    Without `harmonics` their number is doubled until the ITF changes by less than `tolerance` (relative
    rms). The coefficients enter through the Fourier series of their samples, so the system must be
    trigonometric. Raises PeriodicSystemError for a piecewise system (its series converges too slowly to be
    called exact) and when HARMONICS_MAX harmonics do not suffice.
    """
    if system.interpolation != "trigonometric":
        raise PeriodicSystemError("harmonic balance needs a trigonometric system; this one is piecewise constant")
    frequencies = np.atleast_1d(np.asarray(frequency, dtype=float))
    phases = np.atleast_1d(np.asarray(phase, dtype=float))
    balanced = system.balanced()
    if harmonics is not None:
        return np.stack([_response(balanced, f, phases, harmonics) for f in frequencies])
    return np.stack([_converged(balanced, f, phases, tolerance) for f in frequencies])


def _converged(system: PeriodicSystem, frequency: float, phases: Floats, tolerance: float) -> Complexes:
    count = 16
    last = _response(system, frequency, phases, count)
    while count < HARMONICS_MAX:
        count *= 2
        new = _response(system, frequency, phases, count)
        if np.linalg.norm(new - last) <= tolerance * np.linalg.norm(new):
            return new
        last = new
    raise PeriodicSystemError(
        f"harmonic balance at {frequency:g} Hz has not converged to {tolerance:g} with {HARMONICS_MAX} harmonics"
    )


def _response(system: PeriodicSystem, frequency: float, phases: Floats, harmonics: int) -> Complexes:
    """ITF (phase,) at one frequency from 2H+1 response harmonics."""
    order = np.arange(-harmonics, harmonics + 1)
    mean = system.a.mean(axis=0)
    left, right, middle = _factorise(system.a - mean)
    laplace = 2j * np.pi * (frequency + order / system.period)
    eye = np.eye(system.states)
    inputs = _fourier(system.b, order)
    forces = np.broadcast_to(left.astype(complex), (order.size, *left.shape))
    columns = np.concatenate([inputs[:, :, None], forces], axis=2)
    solved = np.linalg.solve(laplace[:, None, None] * eye - mean, columns)
    free, compliance = solved[:, :, 0], solved[:, :, 1:]
    state = free
    if left.shape[1]:
        toeplitz = _toeplitz(middle, order)  # (H, rho1, H, rho2)
        size = order.size * left.shape[1]
        loop = np.einsum("aibj,bjk->aibk", toeplitz, right.T @ compliance).reshape(size, size)
        source = np.einsum("aibj,bj->ai", toeplitz, free @ right).reshape(size)
        force = solve(np.eye(size) - loop, source).reshape(order.size, -1)
        state = free + np.einsum("mij,mj->mi", compliance, force)
    turn = np.exp(2j * np.pi * np.outer(np.atleast_1d(phases), order))
    _, _, output = system.at(phases)
    return np.einsum("pi,pi->p", output, turn @ state) + system.d


def _factorise(varying: Floats) -> tuple[Floats, Floats, Floats]:
    """W (n, r1), V (n, r2), Z (P, r1, r2) with varying[p] = W Z[p] V^T to rounding."""
    states = varying.shape[1]
    left, strength, _ = np.linalg.svd(varying.transpose(1, 0, 2).reshape(states, -1), full_matrices=False)
    left = left[:, strength > RANK_TOLERANCE * max(strength[0], np.finfo(float).tiny)]
    right, strength, _ = np.linalg.svd(varying.transpose(2, 0, 1).reshape(states, -1), full_matrices=False)
    right = right[:, strength > RANK_TOLERANCE * max(strength[0], np.finfo(float).tiny)]
    return left, right, np.einsum("ia,pij,jb->pab", left, varying, right)


def _fourier(samples: Floats, order: np.ndarray) -> Complexes:
    """Fourier coefficients (len(order), ...) of the trigonometric interpolant of samples (P, ...)."""
    count = samples.shape[0]
    spectrum = np.fft.fft(samples, axis=0) / count
    if count % 2 == 0:  # the interpolant shares the Nyquist term between both signs
        spectrum[count // 2] *= 0.5
    result = np.zeros((order.size, *samples.shape[1:]), dtype=complex)
    inside = np.abs(order) <= count // 2
    result[inside] = spectrum[order[inside] % count]
    return result


def _toeplitz(samples: Floats, order: np.ndarray) -> Complexes:
    """T[m, :, m', :] = Z_{m - m'} for all response harmonics m, m'."""
    span = order[-1] - order[0]
    table = _fourier(samples, np.arange(-span, span + 1))
    index = np.subtract.outer(np.arange(order.size), np.arange(order.size)) + span
    return table[index].transpose(0, 2, 1, 3)
