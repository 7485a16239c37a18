"""Choice of branches L, polynomial order R and window n: least predicted error of the ITF.

A few windows, placed where the response is, are fitted with each candidate. The least of

    mean over windows of s^2 (1 + P_u sum_l g_l),   s^2: residual per degree of freedom, g_l: Var G_l for s = 1,

wins: the residual is what the branches miss (plus noise, the same for all), the second term what their
estimation adds, in the same unit (P_u: power of an input line). This is Akaike's final prediction error
(1969) with the true instead of the average leverage. MDL, which pays more for unknowns, chose models with
1.2 to 1.5 times the error on the reference system. Candidates stay within what the record supports: more
equations than unknowns by a margin, sidebands inside the spectra, a bounded amount of work.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.covariance import diagonal_variance
from gearbench.identification.lpm.estimate import needed_rows, plan_centres
from gearbench.identification.lpm.gram import grams
from gearbench.identification.lpm.local_solve import LpmError, solve_window
from gearbench.identification.lpm.regression import Regression, Window, prepare
from gearbench.identification.spectra.joint import Floats, Spectra

LADDER = (0, 1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 90, 128, 150, 181, 256)
ORDERS = (1, 2, 3)
# Windows: the smallest that leaves this margin of equations over unknowns, and wider ones by this factor.
MARGIN = 1.4
WIDENING = 1.7
# Widest half-window as part of the band.
WIDEST = 0.05
# Work of the whole identification [floating-point operations] that a candidate may cost.
WORK = 3.0e11
# Unknowns of a window beyond which no candidate is tried unasked.
UNKNOWNS = 910
# Trial windows: at least so many, and as many as bring the degrees of freedom to FREEDOM, up to a limit.
TRIALS = 6
FREEDOM = 800
TRIALS_MAX = 60
# How many rungs of a ladder may fail to improve before the climb ends.
PATIENCE = 2


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
    search = _search(spectra, lines, transient, max(ladder, default=0))

    def best_width(branches: int, polynomial: int) -> Choice | None:
        widths = [half_width] if half_width is not None else search.widths(branches, polynomial)
        windows = (Window(branches, polynomial, width, transient) for width in widths)
        return _climb(search.judge(window) for window in windows if search.admits(window))

    climbs = [
        _climb(best_width(branches, polynomial) for branches in ladder)
        for polynomial in (ORDERS if order is None else (order,))
    ]
    best = min((choice for choice in climbs if choice), key=lambda choice: choice.error, default=None)
    if best is None or not np.isfinite(best.error):
        raise LpmError(_refusal(spectra, lines, harmonics, order, half_width))
    return best.window


def _climb(rungs: Iterable[Choice | None]) -> Choice | None:
    """Best of the rungs, tried in order until PATIENCE in a row have not improved; None if there is none."""
    best: Choice | None = None
    failures = 0
    for choice in rungs:
        if choice is not None and (best is None or choice.error < best.error):
            best, failures = choice, 0
        else:
            failures += 1
        if best is not None and failures >= PATIENCE:
            break
    return best


@dataclass(frozen=True)
class _Search:
    """What all candidates share: the regression, the output lines, and the response power up to each band line."""

    regression: Regression
    lines: NDArray[np.int64]
    transient: bool
    band: NDArray[np.int64]
    power: Floats
    input_power: float

    def widths(self, harmonics: int, order: int) -> list[int]:
        """Half-widths to try, rising from the smallest that leaves MARGIN; empty if none within WIDEST does."""
        widest = max(int(WIDEST * (self.lines[-1] - self.lines[0])), order + 1)

        def supports(width: int) -> bool:
            window = Window(harmonics, order, width, self.transient)
            middle = int(self.lines[self.lines.size // 2])
            if middle + width > self.regression.highest:
                return False
            unknowns, equations = _count(self.regression, middle, window)
            return equations >= MARGIN * unknowns + 1

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
        total, freedom = 0.0, 0
        at_centre = window.basis()[window.half_width]
        centres = self.trial_centres(window)
        for index, gram in grams(self.regression, centres, window):
            centre = centres[index]
            unknowns, equations = _count(self.regression, centre, window)
            if equations <= unknowns:
                return Choice(window, np.inf)
            try:
                fit = solve_window(self.regression, centre, window, gram, want_factor=True)
            except LpmError:
                return Choice(window, np.inf)
            spread = np.einsum("p,psj,s->", at_centre, diagonal_variance(fit, window), at_centre)
            total += fit.residual / fit.freedom * (1.0 + self.input_power * spread)
            freedom += fit.freedom
        return Choice(window, total / len(centres) * (1.0 + 1.0 / np.sqrt(freedom)))

    def trial_centres(self, window: Window) -> list[int]:
        """Lines inside the output band that share its response power evenly, as many as the window needs."""
        unknowns, equations = _count(self.regression, int(self.lines[self.lines.size // 2]), window)
        count = int(np.clip(FREEDOM / max(equations - unknowns, 1), TRIALS, TRIALS_MAX))
        targets = (np.arange(count) + 0.5) / count * self.power[-1]
        centres = self.band[np.searchsorted(self.power, targets)]
        return sorted({min(int(line), self.regression.highest - window.half_width) for line in centres})


def _search(spectra: Spectra, lines: NDArray[np.int64], transient: bool, harmonics: int) -> _Search:
    regression = prepare(spectra, transient=transient, reach=harmonics * spectra.mesh_lines)
    band = np.arange(lines[0], lines[-1] + 1)
    band = band[band % spectra.mesh_lines != 0] if spectra.mesh_lines > 1 else band
    power = np.cumsum(np.mean(np.abs(spectra.dte[:, band]) ** 2, axis=0))
    return _Search(regression, lines, transient, band, power, regression.input_power())


def _count(regression: Regression, centre: int, window: Window) -> tuple[int, int]:
    """Unknowns and equations of a window."""
    return int(regression.columns(centre, window).sum()), regression.equations(centre, window)


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
