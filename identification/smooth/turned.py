"""The force turned with the mesh phase and delayed: what smooth branches at a speed that varies are made of.

A branch is a sum of delays, turned half before and half after each (Weyl's order; `lpm/moving.py`):

    y(t) = sum_l sum_p sum_q h_lpq sigma^p exp(j l (theta(t) + theta(t - tau_q)) / 2) F(t - tau_q)

sigma is the departure of the mesh frequency over its largest one, at the middle of the delay: p = 0 is the branch at
the mean speed, p = 1, 2 what the speed changes of it. No product is taken to commute; at a constant speed it is the
smooth branch of `posterior.py`. The operating response of order o is the same of a constant force, the transient of
each record the same of an impulse at its beginning.

The delays are nodes of Gauss and Legendre's quadrature for the lags 0..LAST of the variance exp(-u), so that

    sum_q w_q exp(-j x u_q) = 1 / (1 + j x)      within 1e-4, |x| up to what PER_BANDWIDTH and FEWEST nodes are for.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.spectra.course import Course
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra

# Lags [1 / 2a, a the decay of amplitudes] that are kept; nodes at least, and more of them for each bandwidth that the
# lines of a window span.
LAST, FEWEST, PER_BANDWIDTH = 9.5, 7, 2.15
# Powers of the departure of the speed that a branch has: itself, its change in proportion, and with the square.
POWERS = 3


@dataclass(frozen=True)
class Delays:
    """`lags` (Q,) [samples] and prior variances (Q,) `weights` of the coefficients, which add to one; `samples` of the
    record."""

    lags: Floats
    weights: Floats
    samples: int

    def turn(self, lines: Floats) -> Complexes:
        """exp(-j w tau) (..., Q) on lines, fractions of lines too."""
        return np.asarray(np.exp(-2j * np.pi * lines[..., None] * self.lags / self.samples))


@dataclass(frozen=True)
class Turned:
    """Spectra on the lines -`before`.. of the turned and delayed force: `branches` (POWERS, E, 2J+1, Q, S), turned by
    -J..J, and `operating` (E, O, Q, S) of order 0..O-1; `orders` (O, 2): lowest and highest line of each."""

    branches: NDArray[np.complex64]
    operating: NDArray[np.complex64]
    orders: Floats
    delays: Delays
    before: int
    mesh_lines: int


def delays_for(bandwidth: float, span: float, samples: int) -> Delays:
    """Delays of branches of a `bandwidth` [lines] that are read over a `span` of lines."""
    nodes, weights = np.polynomial.legendre.leggauss(ceil(FEWEST + PER_BANDWIDTH * span / bandwidth))
    lags = LAST * (nodes + 1.0) / 2.0
    weights = weights * np.exp(-lags)
    return Delays(lags * samples / (2 * np.pi * bandwidth), weights / weights.sum(), samples)


def span_of(course: Course, harmonics: int, half_width: int) -> float:
    """Lines of middle frequency that rows of a window of 2n+1 lines read from a branch, at all speeds."""
    return 2.0 * half_width + 1.0 + 0.5 * harmonics * float(np.ptp(course.shift))


def room_of(spectra: Spectra, harmonics: int, delays: int) -> float:
    """Bytes of the branches' spectra."""
    return 8.0 * POWERS * spectra.realisations * (2 * harmonics + 1) * delays * spectra.highest


def turned(spectra: Spectra, course: Course, harmonics: int, delays: Delays, before: int) -> Turned:
    """Spectra of the force of all realisations, turned by up to `harmonics` branches."""
    lines = np.arange(-before, spectra.highest + 1)
    mesh = spectra.mesh_lines
    slowest, fastest = mesh + float(course.shift.min()), mesh + float(course.shift.max())
    count = int(spectra.highest / max(slowest, 1.0)) + 2
    runs, nodes = spectra.realisations, delays.lags.size
    branches = np.empty((POWERS, runs, 2 * harmonics + 1, nodes, lines.size), dtype=np.complex64)
    operating = np.empty((runs, count, nodes, lines.size), dtype=np.complex64)
    for run in range(runs):
        for node, lag in enumerate(delays.lags):
            force, middle, departure = _delayed(course, run, float(lag))
            turn = np.exp(-2j * np.pi * middle)
            source = force.astype(complex)
            for j in range(harmonics + 1):
                for power in range(POWERS):
                    whole = np.fft.fft(source * departure**power) / source.size
                    branches[power, run, harmonics + j, node] = whole[lines]
                    branches[power, run, harmonics - j, node] = whole[-lines].conj()
                source = source * turn
            order = np.ones(middle.size, dtype=complex)
            for number in range(count):
                operating[run, number, node] = (np.fft.fft(order) / order.size)[lines]
                order = order * turn.conj()
    bounds = np.outer(np.arange(count), [slowest, fastest])
    return Turned(branches, operating, bounds, delays, before, mesh)


def _delayed(course: Course, run: int, lag: float) -> tuple[Floats, Floats, Floats]:
    """F(t - tau), (theta(t) + theta(t - tau)) / 2 and sigma between both (N,), of a force that repeats with the record;
    before the record the speed is that of its first sample."""
    force, cycles, shift = course.force[run], course.cycles[run], course.shift[run]
    size = force.size
    spectrum = np.fft.rfft(force)
    delayed = np.fft.irfft(spectrum * np.exp(-2j * np.pi * np.arange(spectrum.size) * lag / size), size)
    steps = np.arange(size, dtype=float)
    earlier = steps - lag
    first = cycles[1] - cycles[0]
    before = np.where(earlier < 0, cycles[0] + first * earlier, np.interp(earlier, steps, cycles))
    largest = max(float(np.abs(course.shift).max()), np.finfo(float).tiny)
    departure = 0.5 * (shift + np.interp(earlier, steps, shift)) / largest
    return delayed, 0.5 * (cycles + before), departure
