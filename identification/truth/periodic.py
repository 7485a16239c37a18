"""Linear periodically time-varying systems and their exact instantaneous transfer function (ITF).

    x'(t) = A(t) x(t) + B(t) u(t),   y(t) = C(t) x(t) + D u(t),   period T, phase = t / T [cycles].

The ITF is the periodic response to u = exp(j w t): y(t) = G(jw, t) exp(j w t) (Zadeh, Proc. IRE 38, 1950).
Two independent formulations live in `monodromy.py` and `harmonic_balance.py`; here are the value they
share, the frozen transfer function (not the truth: it ignores that the coefficients move) and the Fourier
pair ITF <-> HTF, G(jw, t) = sum_l G_l(jw) exp(2 pi j l phase).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import matrix_balance

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Interpolation = Literal["piecewise", "trigonometric"]


class PeriodicSystemError(ValueError):
    """A periodic system that is malformed or has no steady state."""


@dataclass(frozen=True)
class PeriodicSystem:
    """Matrices of a single-input single-output periodic system on the phase grid p/P, p = 0..P-1 [cycles].

    period [s]; a (P, n, n) [1/s-scaled states]; b (P, n) or (n,); c (P, n) or (n,); d scalar.
    `interpolation` says what happens between grid points: "piecewise": constant on [p/P, (p+1)/P);
    "trigonometric": the trigonometric interpolant of the samples (for smooth coefficients). Arrays are
    copied and made read-only.
    """

    period: float
    a: Floats
    b: Floats
    c: Floats
    d: float = 0.0
    interpolation: Interpolation = "piecewise"

    def __post_init__(self) -> None:
        a = np.array(self.a, dtype=float)
        if a.ndim != 3 or a.shape[1] != a.shape[2] or not a.size:
            raise PeriodicSystemError(f"a has shape {a.shape}, but must be (phases, states, states)")
        shapes = {"b": np.array(self.b, dtype=float), "c": np.array(self.c, dtype=float)}
        for name, value in shapes.items():
            if value.shape not in ((a.shape[1],), a.shape[:2]):
                raise PeriodicSystemError(
                    f"{name} has shape {value.shape}, but must be {(a.shape[1],)} or {a.shape[:2]}"
                )
            shapes[name] = np.array(np.broadcast_to(value, a.shape[:2]))
        if not (np.isfinite(self.period) and self.period > 0):
            raise PeriodicSystemError(f"period = {self.period:g} s must be positive")
        if self.interpolation not in ("piecewise", "trigonometric"):
            raise PeriodicSystemError(f"interpolation = {self.interpolation!r} must be piecewise or trigonometric")
        for name, value in {"a": a, **shapes}.items():
            if not np.isfinite(value).all():
                raise PeriodicSystemError(f"{name} holds values that are not finite")
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def phases(self) -> int:
        """Number P of phase grid points."""
        return self.a.shape[0]

    @property
    def states(self) -> int:
        """Number n of states."""
        return self.a.shape[1]

    def at(self, phase: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """A (Q, n, n), B (Q, n), C (Q, n) at the given phases [cycles], by the system's interpolation."""
        points = np.atleast_1d(np.asarray(phase, dtype=float)) % 1.0
        if self.interpolation == "piecewise":
            # A phase that is a grid point up to rounding belongs to the piece that begins there.
            index = np.floor(points * self.phases + 1e-9).astype(int) % self.phases
            return self.a[index], self.b[index], self.c[index]
        return tuple(_trigonometric(value, points) for value in (self.a, self.b, self.c))  # type: ignore[return-value]

    def balanced(self) -> PeriodicSystem:
        """The same system in states scaled by a constant diagonal matrix, so that |A| is well balanced."""
        magnitude = np.abs(self.a).mean(axis=0)
        _, (scale, _) = matrix_balance(magnitude, permute=False, separate=True)
        return PeriodicSystem(
            self.period,
            self.a * (scale[None, None, :] / scale[None, :, None]),
            self.b / scale,
            self.c * scale,
            self.d,
            self.interpolation,
        )


def _trigonometric(samples: Floats, points: Floats) -> Floats:
    """Trigonometric interpolant of samples (P, ...) on p/P at `points` (Q,): (Q, ...)."""
    count = samples.shape[0]
    flat = samples.reshape(count, -1)
    moving = np.flatnonzero(np.ptp(flat, axis=0) > 0)
    result = np.repeat(flat[:1], points.size, axis=0)
    if moving.size:
        spectrum = np.fft.rfft(flat[:, moving], axis=0) / count
        spectrum[1:] *= 2.0
        if count % 2 == 0:
            spectrum[-1] *= 0.5
        result[:, moving] = _real_fourier_sum(spectrum, points)
    return result.reshape(points.size, *samples.shape[1:])


def _real_fourier_sum(spectrum: Complexes, points: Floats) -> Floats:
    """Re sum_l spectrum[l] exp(2 pi j l points): (Q, columns); by FFT when the points are uniform on the circle."""
    count, order = points.size, np.arange(spectrum.shape[0])
    if count > 1 and np.abs(points - points[0] - np.arange(count) / count).max() < 1e-13:
        turned = spectrum * np.exp(2j * np.pi * order * points[0])[:, None]
        folded = np.zeros((count, spectrum.shape[1]), dtype=complex)
        np.add.at(folded, order % count, turned)
        return (np.fft.ifft(folded, axis=0) * count).real
    parts = np.array_split(points, max(1, count * order.size // 4_000_000))
    return np.concatenate([(np.exp(2j * np.pi * np.outer(p, order)) @ spectrum).real for p in parts])


def frozen_itf(system: PeriodicSystem, frequency: ArrayLike, phase: ArrayLike) -> Complexes:
    """Frozen transfer function C (jw - A)^-1 B + D with the coefficients held at each phase: (frequency, phase).

    frequency [Hz], phase [cycles]. This is what the ITF tends to for an infinitely slow variation.
    """
    a, b, c = system.balanced().at(phase)
    values, vectors = np.linalg.eig(a)
    modal_b = np.linalg.solve(vectors, b[:, :, None].astype(complex))[:, :, 0]
    modal_c = np.einsum("pi,pij->pj", c, vectors)
    laplace = 2j * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float))
    if np.linalg.cond(vectors).max() > 1e8:  # nearly defective: solve instead of diagonalising
        eye = np.eye(system.states)
        states = [np.linalg.solve(s * eye - a, b[:, :, None])[:, :, 0] for s in laplace]
        return np.asarray([np.einsum("pi,pi->p", c, x) + system.d for x in states], dtype=complex)
    residues = modal_c * modal_b
    result = np.full((laplace.size, a.shape[0]), system.d, dtype=complex)
    for mode in range(system.states):
        result += residues[:, mode] / (laplace[:, None] - values[:, mode])
    return result


def htf_from_itf(itf: Complexes, harmonics: int) -> Complexes:
    """HTF (2L+1, frequency), l = -L..L, of an ITF (frequency, phase) sampled on the uniform phases 0, 1/Q, ...

    Needs Q >= 2L+1 phases; the ITF's own harmonics beyond Q/2 alias.
    """
    count = itf.shape[1]
    if count < 2 * harmonics + 1:
        raise PeriodicSystemError(
            f"{count} phases cannot resolve harmonics up to {harmonics}; {2 * harmonics + 1} are needed"
        )
    spectrum = np.fft.fft(itf, axis=1) / count
    return spectrum[:, np.arange(-harmonics, harmonics + 1) % count].T


def itf_from_htf(htf: Complexes, phases: int) -> Complexes:
    """ITF (frequency, phases) on the uniform phases 0, 1/Q, ... of an HTF (2L+1, frequency)."""
    limit = htf.shape[0] // 2
    folded = np.zeros((htf.shape[1], phases), dtype=complex)
    # With fewer phases than harmonics the sum is still right: exp(2 pi j l q / Q) depends on l mod Q only.
    for harmonic in range(-limit, limit + 1):
        folded[:, harmonic % phases] += htf[harmonic + limit]
    return np.fft.ifft(folded, axis=1) * phases


def truncation_error(itf: Complexes, harmonics: int) -> float:
    """Relative rms error of an ITF (frequency, phase; uniform phases) that keeps only the branches -L..L."""
    spectrum = np.fft.fft(itf, axis=1)
    order = np.abs(np.fft.fftfreq(itf.shape[1], 1.0 / itf.shape[1]))
    power = np.sum(np.abs(spectrum) ** 2, axis=0)
    return float(np.sqrt(power[order > harmonics + 0.5].sum() / power.sum()))
