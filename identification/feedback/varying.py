"""Mesh feedback at a speed that varies: the equations of `model.py` with the measured phase in place of shifted lines.

    D(k) Y(k) + sum_{l /= 0} DFT{exp(j l theta) (k_l y + c_l y')} = N(k) U(k) + T(k) + sum_l f_l DFT{exp(j l theta)}

theta(t) is the measured mesh phase, f_l the force of the static transmission error, T what the record's ends leave
(smooth in frequency; Pintelon and Schoukens 2012, section 6.3), with exp(j l theta) y' = d/dt(exp(j l theta) y)
- j l theta' exp(j l theta) y. Lines no longer fall into residue classes. All parameters are linear; D, N and T are
cubic splines, N = 1 at the lowest excited lines. Least squares is biased by the noise in Y: the model's own response,
solved for by GMRES, serves as instrument, and again with the better model (refined instrumental variables; Young 2011,
chapter 7).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.sparse.linalg import LinearOperator, gmres

from gearbench.identification.feedback.functions import Splines
from gearbench.identification.feedback.loud import FEWEST_PARTS, LEAST_EQUATIONS, PARTS, loud_parts
from gearbench.identification.feedback.model import Model
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.spectra.joint import Complexes, Floats

# Harmonics of the mesh unless given; their prior keeps those that the record does not show small. It falls like that of
# a mesh that switches, 1/l, from the size of the first ones, which every record tells.
HARMONICS = 100
TOLD = 8
# Of a first solution, which nothing has told yet how large they are; what holds the others, of a scaled diagonal of 1.
FIRST, HELD = 40, 1e9
# Lines for each interval of the splines, and fewest and most intervals.
SUPPORT = 60
INTERVALS = (20, 120)
# Lines beyond the excited ones, as part of them, on which the response is followed.
MARGIN = 0.05
ROUNDS = 3
# Rows whose splines are written down at a time.
CHUNK = 800
# Lines over which the levels that weigh first equations are averaged.
LEVEL = 101
FLOOR = 0.1
RIDGE = 1e-9
# Equations of a window in which residuals are compared with the inputs; least part of the strongest window's input.
COMPARED, REACHED = 80, 1e-2
# Relative residual at which the model's response counts as solved, and GMRES' rounds.
SOLVED, KRYLOV, RESTARTS = 1e-4, 60, 4


@dataclass(frozen=True)
class Signals:
    """`dte`, `force` (E, N) over `dte_unit` [m] and `force_unit` [N], `cycles` (E, N): mesh phase; `rate` [Hz].

    `lowest`, `excited`: first and last excited line; `top`: last line that is followed.
    """

    dte: Floats
    force: Floats
    cycles: Floats
    rate: float
    lowest: int
    excited: int
    dte_unit: float
    force_unit: float

    @property
    def top(self) -> int:
        """Last line that is followed."""
        return min(int((1 + MARGIN) * self.excited), self.dte.shape[1] // 2 - 1)

    @property
    def omega(self) -> Floats:
        """Lines 1..top over `top`."""
        return np.arange(1, self.top + 1) / self.top

    @property
    def omega_unit(self) -> float:
        """Angular frequency of the line `top` [rad/s]."""
        return 2 * np.pi * self.top * self.rate / self.dte.shape[1]

    def lines(self, values: NDArray) -> Complexes:
        """DFT of values (N,) over N on the lines 1..top."""
        return np.asarray(np.fft.fft(values)[1 : self.top + 1] / values.size)

    def along_time(self, spectrum: Complexes, mean: float = 0.0) -> Floats:
        """Values (N,) of a spectrum on the lines 1..top."""
        size = self.dte.shape[1]
        whole = np.zeros(size // 2 + 1, dtype=complex)
        whole[0], whole[1 : self.top + 1] = mean, spectrum
        return np.asarray(np.fft.irfft(whole, size) * size)


@dataclass(frozen=True)
class Varying:
    """Model in units of the signals, `covariance` of its parameters (as `Model.vector`), `left` (E, S): lines of what
    the model's own response leaves of the measured one, `residual`: its rms, relative, `equations` (complex) and
    `unknowns`."""

    model: Model
    covariance: Floats
    left: Complexes
    residual: float
    equations: int
    unknowns: int


def varying_feedback(
    signals: Signals, harmonics: int | None = None, progress: Callable[[float, str], None] | None = None
) -> Varying:
    """Identify D, N, k and c from signals whose mesh phase is known at each instant. Raises LpmError where they hold
    fewer equations than unknowns."""
    report = progress or (lambda part, message: None)
    count = harmonics if harmonics is not None else HARMONICS
    intervals = int(np.clip(signals.excited * signals.dte.shape[0] / SUPPORT, *INTERVALS))
    fit = _Fit(signals, count, Splines(intervals), Splines(max(intervals // 2, INTERVALS[0] // 2)))
    equations = signals.excited * signals.dte.shape[0]
    if 2 * equations < fit.size:
        raise LpmError(
            f"under-determined: {fit.size} unknowns of the mesh-feedback model at varying speed against {2 * equations}"
            " equations; record longer or more realisations, or give fewer harmonics"
        )
    measured = [fit.regressors(row, signals.dte[row]) for row in range(signals.dte.shape[0])]
    weights = fit.first_weights()
    vector, covariance = fit.solve(measured, measured, weights, fit.few())
    residual, left = np.inf, np.zeros((signals.dte.shape[0], signals.top), dtype=complex)
    for turn in range(ROUNDS):
        report((turn + 0.5) / ROUNDS, f"mesh feedback at varying speed: round {turn + 1}")
        own = [fit.response(vector, row) for row in range(signals.dte.shape[0])]
        swing = np.sqrt(sum(float(np.var(row)) for row in signals.dte))
        residual = float(np.sqrt(sum(np.mean((a - b) ** 2) for a, b in zip(own, signals.dte, strict=True))) / swing)
        left = np.array([signals.lines(b - a) for a, b in zip(own, signals.dte, strict=True)])
        instruments = [fit.regressors(row, values) for row, values in enumerate(own)]
        weights = 1.0 / np.abs(fit.spline @ vector[: fit.width])
        vector, covariance = fit.solve(measured, instruments, weights, fit.prior(measured, vector, weights))
    kept = np.concatenate([np.arange(2 * fit.width), np.arange(fit.mesh, fit.mesh + 4 * count)])
    return Varying(fit.model(vector), covariance[np.ix_(kept, kept)], left, residual, equations, fit.size)


def unexplained_at(
    signals: Signals, left: Complexes, mesh_lines: float, band: tuple[int, int]
) -> tuple[float, float]:
    """Estimated sum over the lines of the `band` and all branches of |error of G_l|^2 in units of the signals, as
    `unexplained` of `result.py`: what `left` (E, S) shares with the force times exp(j l theta), less what noise would;
    and the standard deviation of that number from noise alone.

    `mesh_lines`: lines to the mean mesh frequency.
    """
    runs, size = left.shape
    width = max(3, COMPARED // runs)
    starts = np.arange(0, size - width + 1, width)
    kept = starts.size * width
    noise = np.mean(np.abs(left[:, :kept].reshape(runs, -1, width)) ** 2, axis=(0, 2))
    middle = 1 + starts + width // 2
    reach = int((band[1] + size) / mesh_lines) + 1
    turn = np.exp(2j * np.pi * signals.cycles)
    swing = signals.force - signals.force.mean(axis=1, keepdims=True)
    total = scatter = 0.0
    for branch in range(-reach, reach + 1):
        source = np.abs(middle - branch * mesh_lines)
        read = (source >= band[0]) & (source <= band[1])
        if not read.any():
            continue
        inputs = np.array([signals.lines(row) for row in turn**branch * swing])[:, :kept].reshape(runs, -1, width)
        power = np.sum(np.abs(inputs) ** 2, axis=(0, 2))
        product = np.sum(inputs.conj() * left[:, :kept].reshape(runs, -1, width), axis=(0, 2))
        read &= power > REACHED * power.max()
        total += width * float(np.sum((np.abs(product[read]) ** 2 / power[read] - noise[read]) / power[read]))
        scatter += float(np.sum((width * noise[read] / power[read]) ** 2))
    return total, float(np.sqrt(scatter))


def loud_at(signals: Signals, left: Complexes, band: tuple[int, int]) -> float:
    """As the first number of `unexplained_at`, of what `left` (E, S) holds at loud mesh phases beyond the level of the
    others (`loud.py`)."""
    runs, own = left.shape[0], slice(max(band[0], 1) - 1, band[1])
    count = left[:, own].size
    parts = int(min(PARTS, count / LEAST_EQUATIONS))
    if parts < FEWEST_PARTS:
        return 0.0
    kept = np.zeros_like(left)
    kept[:, own] = left[:, own]
    power = np.zeros(parts)
    for cycles, lines in zip(signals.cycles, kept, strict=True):
        power += np.bincount((cycles % 1.0 * parts).astype(int) % parts, signals.along_time(lines) ** 2, parts)
    loud = loud_parts(count / parts, power)
    excess = float(np.sum((power - np.median(power))[loud]) / np.sum(power))
    force = np.array([signals.lines(row)[own] for row in signals.force])
    return excess * float(np.sum(np.abs(kept) ** 2) / np.sum(np.abs(force) ** 2)) * count / runs


@dataclass(frozen=True)
class _Regressors:
    """What the equations of one realisation hold of the response: lines (S,) and its modulations (S, 4 L)."""

    lines: Complexes
    mesh: Complexes


class _Fit:
    """The linear equations: parameters d, n (M each), T of each realisation, f (2 L), and k, c (4 L)."""

    def __init__(self, signals: Signals, harmonics: int, basis: Splines, ends: Splines) -> None:
        self.signals, self.harmonics, self.basis = signals, harmonics, basis
        self.spline, self.of_ends = basis.at(signals.omega), ends.at(signals.omega)
        self.width, runs = self.spline.shape[1], signals.dte.shape[0]
        self.static = 2 * self.width + runs * self.of_ends.shape[1]
        self.mesh = self.static + 2 * harmonics
        self.size = self.mesh + 4 * harmonics
        self.input = [signals.lines(force) for force in signals.force]
        self.turn = [np.exp(2j * np.pi * cycles) for cycles in signals.cycles]
        self.periodic = [self._periodic(row) for row in range(runs)]
        low = np.linspace(signals.lowest, signals.lowest + 0.05 * (signals.excited - signals.lowest), 16)
        self.gauge = np.zeros(self.size)
        self.gauge[self.width : 2 * self.width] = basis.at(low / signals.top).real.mean(axis=0)

    def _periodic(self, row: int) -> Complexes:
        """Columns (S, 2 L) of the periodic force."""
        orders = [self.signals.lines(self.turn[row] ** order) for order in range(1, self.harmonics + 1)]
        back = [self.signals.lines(self.turn[row] ** -order) for order in range(1, self.harmonics + 1)]
        one, two = np.stack(orders, axis=1), np.stack(back, axis=1)
        return np.concatenate([one + two, 1j * (one - two)], axis=1)

    def regressors(self, row: int, dte: Floats) -> _Regressors:
        """Lines and modulations of a response (N,) of realisation `row`."""
        signals, omega = self.signals, self.signals.omega
        speed = 2 * np.pi * np.gradient(signals.cycles[row]) * signals.rate / signals.omega_unit
        found = np.empty((4, signals.top, self.harmonics), dtype=complex)
        for order in range(1, self.harmonics + 1):
            for place, sign in ((0, 1), (1, -1)):
                turned = self.turn[row] ** (sign * order) * dte
                plain = signals.lines(turned)
                found[place, :, order - 1] = plain
                # exp(j l theta) y' by parts; what the ends add is constant, and in T.
                found[place + 2, :, order - 1] = 1j * omega * plain - signals.lines(1j * sign * order * speed * turned)
        up, down, fast_up, fast_down = found
        mesh = [up + down, 1j * (up - down), fast_up + fast_down, 1j * (fast_up - fast_down)]
        return _Regressors(signals.lines(dte), np.concatenate(mesh, axis=1))

    def first_weights(self) -> Floats:
        """Response over force, both averaged over neighbouring lines: errors become those of the response."""
        response, force = (
            sum(np.abs(self.signals.lines(row)) ** 2 for row in rows) for rows in (self.signals.dte, self.signals.force)
        )
        force = uniform_filter1d(force, LEVEL)
        return np.asarray(np.sqrt(uniform_filter1d(response, LEVEL) / np.maximum(force, FLOOR * force.max())))

    def _rows(self, found: _Regressors, row: int, part: slice) -> Complexes:
        """All columns (rows, P) of the equations of realisation `row`."""
        spline, ends = self.spline[part], self.of_ends[part]
        matrix = np.zeros((spline.shape[0], self.size), dtype=complex)
        matrix[:, : self.width] = spline * found.lines[part, None]
        matrix[:, self.width : 2 * self.width] = -spline * self.input[row][part, None]
        first = 2 * self.width + row * ends.shape[1]
        matrix[:, first : first + ends.shape[1]] = -ends
        matrix[:, self.static : self.mesh] = -self.periodic[row][part]
        matrix[:, self.mesh :] = found.mesh[part]
        return matrix

    def few(self) -> Floats:
        """The prior (P,) of a first solution: its first harmonics are free, the others held at 0."""
        found = np.zeros(self.size)
        for part in range(4):
            found[self.mesh + part * self.harmonics + FIRST : self.mesh + (part + 1) * self.harmonics] = np.inf
        return found

    def prior(self, measured: list[_Regressors], vector: Floats, weights: Floats) -> Floats:
        """What the prior variances of k and c add to the diagonal (P,) of weighted equations. The FIRST harmonics have
        none: shrunk before the rounds settle, they make poor instruments."""
        found = np.zeros(self.size)
        order, noise = np.arange(1, self.harmonics + 1), self._noise(measured, vector, weights)
        for one, two in ((0, 1), (2, 3)):
            parts = [self.mesh + part * self.harmonics + order - 1 for part in (one, two)]
            size = np.mean([(order * vector[part])[:TOLD] ** 2 for part in parts])
            for part in parts:
                found[part] = np.where(order > FIRST, noise * order**2 / size, 0.0)
        return found

    def solve(
        self, measured: list[_Regressors], instruments: list[_Regressors], weights: Floats, prior: Floats
    ) -> tuple[Floats, Floats]:
        """Parameters with N = 1 at the lowest lines that make the instruments orthogonal to the equations' errors, as
        far as the `prior` (P,) on the diagonal lets them, and their covariance from these errors."""
        gram, own = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        for row, (one, two) in enumerate(zip(measured, instruments, strict=True)):
            for first in range(0, self.signals.top, CHUNK):
                part = slice(first, first + CHUNK)
                left, right = (self._rows(x, row, part) * weights[part, None] for x in (two, one))
                active = np.flatnonzero(np.abs(right).max(axis=0) > 0)
                left, right = (np.concatenate([x[:, active].real, x[:, active].imag]) for x in (left, right))
                gram[np.ix_(active, active)] += left.T @ right
                own[np.ix_(active, active)] += left.T @ left
        scale = np.sqrt(np.maximum(np.diagonal(own), 1e-14 * np.diagonal(own).max()))
        system = np.zeros((self.size + 1, self.size + 1))
        held = np.diag(np.minimum(prior / scale**2, HELD))
        system[:-1, :-1] = gram / scale / scale[:, None] + held + RIDGE * np.eye(self.size)
        system[-1, :-1] = system[:-1, -1] = self.gauge / scale
        inverse = np.linalg.inv(system)
        vector = inverse[:-1, -1] / scale
        spread = inverse[:-1, :-1] / scale[:, None]
        noise = self._noise(measured, vector, weights)
        return vector, noise * (spread @ (own / scale / scale[:, None] + held) @ spread.T)

    def _noise(self, measured: list[_Regressors], vector: Floats, weights: Floats) -> float:
        """Variance of the weighted real equations."""
        total = 0.0
        for row, found in enumerate(measured):
            for first in range(0, self.signals.top, CHUNK):
                part = slice(first, first + CHUNK)
                total += float(np.sum(np.abs(self._rows(found, row, part) @ vector * weights[part]) ** 2))
        return total / max(2 * np.count_nonzero(weights) * len(measured) - self.size, 1)

    def model(self, vector: Floats) -> Model:
        """D, N, k and c of all parameters."""
        k, kj, c, cj = np.split(vector[self.mesh :], 4)
        d, n = vector[: self.width], vector[self.width : 2 * self.width]
        return Model(self.basis, d, n, k + 1j * kj, c + 1j * cj)

    def response(self, vector: Floats, row: int) -> Floats:
        """The model's response (N,) to the measured force, its mean as measured."""
        signals, model = self.signals, self.model(vector)
        d, n = self.spline @ model.d, self.spline @ model.n
        first = 2 * self.width + row * self.of_ends.shape[1]
        source = n * self.input[row] + self.of_ends @ vector[first : first + self.of_ends.shape[1]]
        source = source + self.periodic[row] @ vector[self.static : self.mesh]
        power = self.turn[row][:, None] ** np.arange(1, self.harmonics + 1)
        stiffness, damping = 2 * (power @ model.k).real, 2 * (power @ model.c).real
        mean = float(signals.dte[row].mean())

        def applied(stacked: Floats) -> Floats:
            lines = np.asarray(stacked[: signals.top] + 1j * stacked[signals.top :], dtype=complex)
            fast = np.asarray(1j * signals.omega * lines, dtype=complex)
            force = stiffness * signals.along_time(lines) + damping * signals.along_time(fast)
            value = lines + signals.lines(force) / d
            return np.concatenate([value.real, value.imag])

        right = (source - mean * signals.lines(stiffness)) / d
        begin = signals.lines(signals.dte[row])
        size = 2 * signals.top
        found, _ = gmres(
            LinearOperator((size, size), matvec=applied, dtype=float),
            np.concatenate([right.real, right.imag]),
            x0=np.concatenate([begin.real, begin.imag]),
            rtol=SOLVED,
            restart=KRYLOV,
            maxiter=RESTARTS,
        )
        return signals.along_time(found[: signals.top] + 1j * found[signals.top :], mean)
