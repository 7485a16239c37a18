"""Local polynomial method (LPM) for linear periodically time-varying systems.

    Y(k) = sum_l Gs_l(k) U(k - l d) + T(k) + V(k),   G_l(k) = Gs_l(k + l d),

with Gs_l and T polynomials of order R in windows of 2n+1 lines (Pintelon and Schoukens, System
Identification, 2nd ed., 7.2; Lataire and Louarroudi for the periodic case). One window serves the few rows
in its middle third. Only rows m >= 0 are solved: G is real in time, Gs_l(-m) = conj Gs_{-l}(m).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gearbench.identification.lpm.covariance import CrossCovariance, diagonal_variance
from gearbench.identification.lpm.gathered import rows_around
from gearbench.identification.lpm.gram import batches, grams
from gearbench.identification.lpm.local_solve import LocalFits, LpmError, solve_windows
from gearbench.identification.lpm.missing import MissingPower
from gearbench.identification.lpm.output import OutputLines
from gearbench.identification.lpm.regression import Regression, Window, prepare
from gearbench.identification.lpm.rows import Lines, WindowRows
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra

# One window in so many tells its condition number.
CONDITION_EVERY = 32
# Work [floating-point operations] spent on variances before they are sampled, and before cross terms are left out.
VARIANCE_WORK = 2e10
CROSS_WORK = 1e11


@dataclass(frozen=True)
class LpmResult:
    """Identified branches on the output lines.

    `lines` (F,); `coherence` (F,): 1 - residual over response, powers of a line in the window around each;
    `htf`, `htf_variance` (2L+1, F), l = -L..L [m/N]; `itf_covariance` (Q+1, F): sums over l
    of E[dG_l conj(dG_{l+q})], q = 0 first, which give the ITF's variance at any phase; `missing`: estimated sum over
    output lines and branches of |error of G_l|^2 that the variance does not hold, `missing_bound` the same with all
    of the residual taken for it unless repeated periods tell the noise, `residual_missing` in any
    case; `residual`: rms of
    the residual over that of the response in the windows (degrees of freedom accounted for); `condition`:
    largest estimated condition number; `unknowns`, `equations`, `freedom`: of an inner window, transients
    included; `windows`: how many; `variance_sampled`: windows per computed variance; `cross_terms`:
    "exact", "none" (no windows overlap), "omitted"; `open_share`: part of the variance that is no noise but what a
    prior leaves open; None: there is no prior.
    """

    lines: Lines
    htf: Complexes
    htf_variance: Floats
    itf_covariance: Complexes
    missing: float
    missing_bound: float
    residual_missing: float
    residual: float
    condition: float
    unknowns: int
    equations: int
    windows: int
    variance_sampled: int
    cross_terms: str
    coherence: Floats
    open_share: float | None = None

    @property
    def harmonics(self) -> int:
        """Branches on each side, L."""
        return self.htf.shape[0] // 2

    def itf_variance(self, phases: int) -> Floats:
        """E|error|^2 of the ITF (F, phases) on uniform phases, from the residuals."""
        shifts = np.arange(1, self.itf_covariance.shape[0])
        turn = np.exp(-2j * np.pi * np.outer(shifts, np.arange(phases) / phases))
        total = self.itf_covariance[0].real[:, None] + 2 * (self.itf_covariance[1:].T @ turn).real
        return np.maximum(total, 0.0)


def local_polynomial(
    spectra: Spectra,
    lines: Lines,
    window: Window,
    *,
    regression: Regression | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> LpmResult:
    """Identify the branches -L..L on the output `lines` (rising, multiples of their common step); `regression`: of
    the spectra, where it is not that of a constant speed.

    Raises LpmError, with the numbers, if a window has fewer equations than unknowns, if sidebands leave the
    lines that the spectra hold, or if the inputs are numerically dependent.
    """
    require_lines(spectra, lines, window)
    if regression is None:
        regression = prepare(spectra, transient=window.transient, reach=window.harmonics * spectra.mesh_lines)
    rows = needed_rows(lines, window.harmonics, spectra.mesh_lines)
    centres = plan_centres(rows, window, regression.last_row(window.harmonics))
    require_equations(regression, [centre for centre, _ in centres], window)
    return _Pass(regression, window, lines, centres, spectra.noise).run(progress)


def require_lines(spectra: Spectra, lines: Lines, window: Window) -> None:
    """Raise LpmError if output lines plus sidebands and half a window leave the spectra."""
    reach = window.harmonics * spectra.mesh_lines
    room = spectra.highest - max(window.half_width, int(lines[-1]))
    if reach > room:
        raise LpmError(
            f"harmonics = {window.harmonics} puts sidebands of {lines[-1] * spectra.spacing:g} Hz at"
            f" {(lines[-1] + reach) * spectra.spacing:g} Hz, beyond the highest usable frequency"
            f" {spectra.highest * spectra.spacing:g} Hz; at most {max(room, 0) // spectra.mesh_lines} fit"
        )


def require_equations(regression: Regression, centres: list[int], window: Window) -> None:
    """Raise LpmError with the numbers if a window has no equation to spare over its unknowns."""
    for indices in batches(regression, window, list(range(len(centres))), written=False):
        rows = rows_around(regression, np.array([centres[index] for index in indices]), window)
        short = np.flatnonzero(rows.equations <= rows.unknowns)
        if short.size:
            first = int(short[0])
            raise LpmError(
                _too_few(regression, window, centres[indices[first]], rows.unknowns[first], rows.equations[first])
            )


def _too_few(regression: Regression, window: Window, centre: int, unknowns: int, equations: int) -> str:
    """The sentence for a window with too few equations."""
    experiments = regression.experiments
    factor = (unknowns + 1) / max(equations, 1)
    transient = f" and {experiments * (window.order + 1)} of transients" if window.transient else ""
    return (
        f"under-determined: L = {window.harmonics} branches a side of order R = {window.order} are"
        f" {unknowns} unknowns{transient}, but windows of n = {window.half_width} with {experiments}"
        f" realisation(s) leave {equations} equations (around line {centre}); sufficient would be about"
        f" window n = {int(np.ceil(window.half_width * factor)) + 1}, or"
        f" {int(np.ceil(experiments * factor))} realisations, or L ="
        f" {max(0, int((window.harmonics + 0.5) / factor - 1))}"
    )


def needed_rows(lines: Lines, harmonics: int, mesh_lines: int) -> Lines:
    """Rows |k + l d|, rising, that the branches on the output lines k are read from."""
    sidebands = np.arange(-harmonics, harmonics + 1) * mesh_lines
    return np.unique(np.abs(lines[:, None] + sidebands[None, :]))


def plan_centres(rows: Lines, window: Window, highest: int) -> list[tuple[int, Lines]]:
    """Window centres and the rows each one serves: those in its middle third, more at the top edge.

    `highest`: last row that says anything; a window beyond it would be short of equations.
    """
    inner = window.half_width // 3
    highest = max(highest, int(rows[-1]))
    plan = []
    start = 0
    while start < rows.size:
        stop = int(np.searchsorted(rows, rows[start] + 2 * inner, side="right"))
        centre = (int(rows[start]) + int(rows[stop - 1])) // 2
        plan.append((min(centre, highest - window.half_width), rows[start:stop]))
        start = stop
    return plan


class _Pass:
    """One pass over all windows; collects branches and variances on the output lines."""

    def __init__(
        self,
        regression: Regression,
        window: Window,
        lines: Lines,
        centres: list[tuple[int, Lines]],
        noise: Floats | None,
    ) -> None:
        self.regression, self.window, self.lines, self.centres = regression, window, lines, centres
        self.noise = noise
        last = int(max(r[-1] for _, r in centres))
        self.output = OutputLines(lines, window.harmonics, regression.mesh_lines, last)
        unknowns, rows = window.unknowns, sum(r.size for _, r in centres)
        work = len(centres) * 4 / 3 * unknowns**3
        self.sampled = max(1, int(np.ceil(work / VARIANCE_WORK)))
        overlap = 2 * window.half_width + 2 * (window.half_width // 3)
        shifts = min(overlap // regression.mesh_lines, 2 * window.harmonics)
        cross_work = rows * 8.0 * regression.experiments * window.width * unknowns * window.branches
        self.cross: CrossCovariance | None = None
        self.cross_terms = "none" if not shifts else "omitted"
        if shifts and self.sampled == 1 and cross_work <= CROSS_WORK:
            self.cross_terms = "exact"
            self.cross = CrossCovariance(regression, window, self.output.place, shifts)
        self.residual = self.power = 0.0
        self.missing = MissingPower(regression, lines, window.harmonics)
        self.condition = 0.0

    def run(self, progress: Callable[[float, str], None] | None) -> LpmResult:
        """Solve every window."""
        last: Floats | None = None
        lines = [centre for centre, _ in self.centres]
        edges = {0, len(lines) - 1}
        done = 0
        for indices, source, gram in grams(self.regression, lines, self.window):
            count = len(indices)
            want = [i for i in range(count) if (done + i) % self.sampled == 0]
            # Condition numbers: of the edges, where branches fade out, and of some windows in between.
            judged = [i for i in range(count) if indices[i] in edges or (done + i) % CONDITION_EVERY == 0]
            fits = solve_windows(source, gram, want_roots=want, want_condition=judged)
            self.condition = float(max(self.condition, *fits.condition[judged], 0.0))
            variance = diagonal_variance(fits.roots, self.window)
            if last is not None:
                variance = np.concatenate([last[None], variance])
            # Of windows whose own variance is not computed the one of the last window before them counts.
            latest = np.searchsorted(want, np.arange(count), side="right") - (last is None)
            last = variance[-1]
            rows = [self.centres[index][1] for index in indices]
            noise = self._account(fits, source, rows)
            self._read(fits.coefficients, source.centres, rows, noise[:, None, None, None] * variance[latest])
            self.missing.add(fits.residual / fits.freedom, fits.freedom / self.window.width, rows)
            if self.cross is not None:
                for i, own in enumerate(rows):
                    self.cross.add(fits.roots[i], source.part(i), own, float(noise[i]))
            done += count
            if progress is not None:
                progress(done / len(lines), f"window {done} of {len(lines)}")
        return self._result()

    def _account(self, fits: LocalFits, source: WindowRows, rows: list[Lines]) -> Floats:
        """Residual variance of each window; adds to the overall ratio of residual to response, and to `coherence`."""
        noise: Floats = fits.residual / fits.freedom
        data = source.data
        power = np.sum(data.real**2 + data.imag**2, axis=(1, 2)) / np.maximum(np.count_nonzero(data, axis=(1, 2)), 1)
        self.residual += float(noise.sum())
        self.power += float(power.sum())
        explained = np.maximum(1.0 - noise / np.where(power > 0, power, 1.0), 0.0) * (power > 0)
        self.output.explain(np.concatenate(rows), np.repeat(explained, [own.size for own in rows]))
        return noise

    def _read(self, coefficients: Complexes, centres: Lines, rows: list[Lines], variance: Floats) -> None:
        """Put the windows' polynomials, at their rows, where they belong."""
        window, basis = self.window, self.window.basis()
        values, spreads = [], []
        for own, centre, found, unit in zip(rows, centres, coefficients, variance, strict=True):
            weight = basis[own - centre + window.half_width]
            values.append(weight @ found)
            pairs = (weight[:, :, None] * weight[:, None, :]).reshape(own.size, -1)
            spreads.append(pairs @ unit.reshape(-1, window.branches))
        self.output.put(np.concatenate(rows), np.concatenate(values), np.concatenate(spreads))

    def _result(self) -> LpmResult:
        diagonal = self.output.variance.sum(axis=0)[None, :].astype(complex)
        cross = self.cross.sums if self.cross is not None else diagonal[:0]
        middle = rows_around(self.regression, np.array([self.centres[len(self.centres) // 2][0]]), self.window)
        transient = self.regression.experiments * (self.window.order + 1) if self.window.transient else 0
        return LpmResult(
            self.lines,
            self.output.htf,
            self.output.variance,
            np.concatenate([diagonal, cross]),
            self.missing.total(self.missing.quietest() if self.noise is None else self.noise),
            self.missing.total(0.0 if self.noise is None else self.noise),
            self.missing.total(0.0),
            float(np.sqrt(self.residual / self.power)) if self.power else 0.0,
            self.condition,
            int(middle.unknowns[0]) + transient,
            int(middle.equations[0]) + transient,
            len(self.centres),
            self.sampled,
            self.cross_terms,
            self.output.coherence,
        )
