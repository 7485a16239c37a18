"""Choice of branches L, polynomial order R and window n: least predicted error of the ITF.

Trial windows, spread over all lines that hold response, are fitted with each candidate. The least of

    mean over rows of s^2 (1 + P_u sum_l g_l),   s^2: residual per degree of freedom, g_l: Var G_l for s = 1,

wins: the residual is what the branches miss (plus noise, the same for all), the second term what their
estimation adds, in the same unit (P_u: power of an input line); l runs over the branches that are read there. This is
Akaike's final prediction error (1969) with the true instead of the average leverage. MDL, which pays more for unknowns,
chose models with 1.2 to 1.5 times the error on the reference system. Candidates stay within what the record supports:
more equations than unknowns by a margin, sidebands inside the spectra, a bounded amount of work.

The error does not fall steadily with L: where the mesh frequency is not small against the natural frequencies, branches
that lead from one resonance to the mirror image of another (l f_mesh = sum of two natural frequencies) count again
after many that do not, and what they leave out lies in rows far outside the resonance that rules the response.
Hence the whole ladder is climbed as long as the criterion stays within reach of the best, and rows count by
themselves, not by their response.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.covariance import diagonal_variance
from gearbench.identification.lpm.estimate import needed_rows, plan_centres
from gearbench.identification.lpm.gathered import rows_around
from gearbench.identification.lpm.gram import grams
from gearbench.identification.lpm.local_solve import LpmError, solve_windows
from gearbench.identification.lpm.regression import EXCITATION_FLOOR, Regression, Window, prepare
from gearbench.identification.lpm.rows import WindowRows
from gearbench.identification.spectra.joint import Floats, Spectra

LADDER = (0, 1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 18, 22, 27, 33, 41, 50, 62, 77, 96, 120, 150, 187, 234)
# The ladder is climbed with the first; the others are tried around the best rung, while they improve.
ORDERS = (2, 3, 4, 5, 1)
# Windows: the smallest that leaves this margin of equations over unknowns, and wider ones by this factor.
MARGIN = 1.25
WIDENING = 1.4
# Widest half-window as part of the band.
WIDEST = 0.1
# Work of the whole identification [floating-point operations] that a candidate may cost.
WORK = 3.0e11
# Unknowns of a window beyond which no candidate is tried unasked.
UNKNOWNS = 910
# Trial windows: at least so many, and as many as bring the degrees of freedom to FREEDOM, up to a limit.
TRIALS = 16
FREEDOM = 1200
TRIALS_MAX = 48
# Part of the trial windows that lie evenly over all rows; the others share the response power.
EVEN = 0.5
# A climb ends after so many rungs in a row that are worse than the best by the factor HOPELESS.
PATIENCE = 3
HOPELESS = 3.0
# Step in L around the best rung, as part of it.
FINER = 0.08
# A neighbour must bring the criterion down to this part of the best one's.
WORTH = 0.98


@dataclass(frozen=True)
class Choice:
    """A candidate and its predicted error [m^2, squared modulus of a line]."""

    window: Window
    error: float


def choose_window(
    spectra: Spectra,
    lines: NDArray[np.int64],
    *,
    transient: bool,
    harmonics: int | None = None,
    order: int | None = None,
    half_width: int | None = None,
) -> Window:
    """The candidate of least predicted error; given values are kept. Raises LpmError if the record supports none."""
    if harmonics is not None and order is not None and half_width is not None:
        return Window(harmonics, order, half_width, transient)
    reach = (spectra.highest - int(lines[-1])) // spectra.mesh_lines
    ladder = [harmonics] if harmonics is not None else [value for value in LADDER if value <= reach]
    regression = prepare(spectra, transient=transient, reach=max(ladder, default=0) * spectra.mesh_lines)
    return choose_among(spectra, lines, regression, ladder, transient, order, half_width, ORDERS).window


def choose_among(
    spectra: Spectra,
    lines: NDArray[np.int64],
    regression: Regression,
    ladder: Sequence[int],
    transient: bool,
    order: int | None,
    half_width: int | None,
    tried: Sequence[int],
) -> Choice:
    """The candidate of least predicted error with branches of the `ladder`, the `order` or those that are `tried`, and
    the `half_width`, if given, of a `regression` that holds so many branches. Raises LpmError if there is none."""
    harmonics = ladder[0] if len(ladder) == 1 else None
    search = search_of(spectra, lines, transient, max(ladder, default=0), regression)

    @cache
    def best_width(branches: int, polynomial: int) -> Choice | None:
        widths = [half_width] if half_width is not None else search.widths(branches, polynomial)
        windows = (Window(branches, polynomial, width, transient) for width in widths)
        return _climb((search.judge(window) for window in windows if search.admits(window)), patience=1, hopeless=1.0)

    orders = tried if order is None else (order,)
    best: Choice | None = None
    for polynomial in orders:
        best = _climb(best_width(branches, polynomial) for branches in ladder)
        if best is not None:
            break
    if best is None or not np.isfinite(best.error):
        raise LpmError(_refusal(spectra, lines, harmonics, order, half_width))
    # From the best rung to its neighbours in L, finer and finer, and to the other orders.
    while better := _better(best, orders, ladder, best_width):
        best = better
    return best


def _better(
    best: Choice,
    orders: Sequence[int],
    ladder: Sequence[int],
    judge: Callable[[int, int], Choice | None],
) -> Choice | None:
    """The best of the neighbours in order and number of branches that improves on `best`, or None."""
    branches, polynomial = best.window.harmonics, best.window.order
    others = [(branches, p) for p in (polynomial - 1, polynomial + 1) if p in orders]
    if len(ladder) > 1:
        step = max(1, round(FINER * branches))
        others += [(b, polynomial) for b in (branches - step, branches + step) if 0 <= b <= ladder[-1]]
    found = [choice for choice in (judge(b, p) for b, p in others) if choice is not None]
    leading = min(found, key=lambda choice: choice.error, default=best)
    return leading if leading.error < WORTH * best.error else None


def _climb(
    rungs: Iterable[Choice | None], patience: int = PATIENCE, hopeless: float = HOPELESS
) -> Choice | None:
    """Best of the rungs, tried in order until `patience` in a row are worse than the best by the factor `hopeless`."""
    best: Choice | None = None
    failures = 0
    for choice in rungs:
        if choice is not None and (best is None or choice.error < best.error):
            best, failures = choice, 0
        elif best is not None:
            failures = failures + 1 if choice is None or choice.error > hopeless * best.error else 0
        if failures >= patience:
            break
    return best


@dataclass(frozen=True)
class Search:
    """What all candidates share: the regression, the output lines, and of each row (1, 2, ..) that output lines reach
    its `relevance`, the part of its sources that are output lines, and the `density` of trial windows."""

    regression: Regression
    lines: NDArray[np.int64]
    transient: bool
    relevance: Floats
    density: Floats
    input_power: float

    def widths(self, harmonics: int, order: int) -> list[int]:
        """Half-widths to try, rising from the smallest that leaves MARGIN; empty if none within WIDEST does."""
        widest = max(int(WIDEST * (self.lines[-1] - self.lines[0])), order + 1)

        def supports(width: int) -> bool:
            window = Window(harmonics, order, width, self.transient)
            middle = int(self.lines[self.lines.size // 2])
            if middle + width > self.regression.highest:
                return False
            rows = rows_around(self.regression, np.array([middle]), window)
            return bool(rows.equations[0] >= MARGIN * rows.unknowns[0] + 1)

        width = _least(supports, order + 1, widest)
        found = []
        while width is not None and width <= widest:
            found.append(width)
            width = max(width + 1, round(WIDENING * width))
        return found

    def admits(self, window: Window) -> bool:
        """Whether a candidate's sidebands stay inside the spectra and its size within UNKNOWNS and WORK."""
        d, highest = self.regression.mesh_lines, self.regression.highest
        if window.harmonics * d + max(window.half_width, int(self.lines[-1])) > highest:
            return False
        if window.unknowns > UNKNOWNS:
            return False
        rows = needed_rows(self.lines, window.harmonics, d)
        return len(plan_centres(rows, window, highest)) * 4 / 3 * window.unknowns**3 <= WORK

    def judge(self, window: Window) -> Choice:
        """The candidate's criterion: mean over its trial windows plus one standard error of the residual.

        Infinite if one of the windows cannot be solved. The standard error keeps small windows, whose residuals
        scatter, from winning by luck.
        """
        total, freedom, sampled = 0.0, 0, 0.0
        at_centre = window.basis()[window.half_width]
        centres = self.trial_centres(window)
        for _, rows, gram in grams(self.regression, centres, window):
            known, row = rows.unknowns > 0, rows.centres - 1
            if (known & (rows.equations <= rows.unknowns)).any():
                return Choice(window, np.inf)
            try:
                fits = solve_windows(rows, gram, want_roots=range(row.size))
            except LpmError:
                return Choice(window, np.inf)
            units = diagonal_variance(fits.roots, window)
            spread = np.einsum("p,bpsj,bj,s->b", at_centre, units, self.read(rows), at_centre, optimize=True)
            error = fits.residual / np.maximum(fits.freedom, 1) * (self.relevance[row] + self.input_power * spread)
            # Where no branch reaches, all is missing.
            error = np.where(known, error, self.relevance[row] * rows.power)
            total += float(np.sum(error / self.density[row]))
            sampled += float(np.sum(1.0 / self.density[row]))
            freedom += int(fits.freedom[known].sum())
        return Choice(window, total / sampled * (1.0 + 1.0 / np.sqrt(max(freedom, 1))))

    def read(self, rows: WindowRows) -> NDArray[np.bool_]:
        """Which branches (B, 2L+1) of the windows' middle rows belong to an output line: the others are never read."""
        branch = np.arange(-rows.window.harmonics, rows.window.harmonics + 1)
        source = np.abs(rows.centres[:, None] + branch * self.regression.mesh_lines)
        return np.asarray((source >= self.lines[0]) & (source <= self.lines[-1]), dtype=bool)

    def trial_centres(self, window: Window) -> list[int]:
        """Rows drawn evenly from their density, as many as the window needs."""
        middle = rows_around(self.regression, self.lines[self.lines.size // 2][None], window)
        free = int(middle.equations[0] - middle.unknowns[0])
        return self.spread_rows(int(np.clip(FREEDOM / max(free, 1), TRIALS, TRIALS_MAX)), window.half_width)

    def spread_rows(self, count: int, half_width: int) -> list[int]:
        """At most `count` rows drawn evenly from their density, around which windows stay inside the spectra."""
        sums = np.cumsum(self.density)
        centres = 1 + np.searchsorted(sums, (np.arange(count) + 0.5) / count * sums[-1])
        return sorted({min(int(row), self.regression.highest - half_width) for row in centres})


def search_of(
    spectra: Spectra, lines: NDArray[np.int64], transient: bool, harmonics: int, regression: Regression
) -> Search:
    """What candidates of up to so many `harmonics` of a `regression` share."""
    d = spectra.mesh_lines
    rows = np.arange(1, min(spectra.highest, int(lines[-1]) + harmonics * d) + 1)
    read, excited = np.zeros((2, rows.size))
    strength = np.abs(spectra.force).max(axis=0)
    driven = strength > EXCITATION_FLOOR * strength[1:].max()
    for branch in range(-harmonics, harmonics + 1):
        source = np.abs(rows + branch * d)
        known = (source > 0) & (source <= spectra.highest)
        hit = known & driven[np.where(known, source, 0)]
        excited += hit
        read += hit & (source >= lines[0]) & (source <= lines[-1])
    relevance = read / np.maximum(excited, 1.0)
    power = relevance * np.mean(np.abs(spectra.dte[:, rows]) ** 2, axis=0) * (rows % d != 0 if d > 1 else 1.0)
    even = relevance > 0
    density = EVEN * even / even.sum() + (1.0 - EVEN) * power / power.sum()
    return Search(regression, lines, transient, relevance, density, regression.input_power())


def _least(holds: Callable[[int], bool], low: int, high: int) -> int | None:
    """Smallest integer from low to high for which a monotonic condition holds, or None."""
    if low > high or not holds(high):
        return None
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle + 1, high)
    return low


def _refusal(
    spectra: Spectra,
    lines: NDArray[np.int64],
    harmonics: int | None,
    order: int | None,
    half_width: int | None,
) -> str:
    wanted = {"harmonics": harmonics, "order": order, "window": half_width}
    given = ", ".join(f"{name} = {value}" for name, value in wanted.items() if value is not None)
    least = (2 * (harmonics or 0) + 1) * ((order if order is not None else 1) + 1)
    return (
        f"under-determined: no local model{' with ' + given if given else ''} fits the record:"
        f" {spectra.realisations} realisation(s) of {spectra.duration:g} s give"
        f" {spectra.realisations * (lines[-1] - lines[0] + 1)} equations in the band, and at least {least} unknowns"
        f" need {MARGIN:g} times as many inside {2 * WIDEST:.0%} of it; lower harmonics or order, or record"
        " more realisations or longer periods"
    )
