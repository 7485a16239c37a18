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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.covariance import diagonal_variance
from gearbench.identification.local_solve import LpmError, solve_window
from gearbench.identification.lpm import needed_rows, plan_centres
from gearbench.identification.regression import Regression, Window, gram_of, prepare
from gearbench.identification.spectra import Spectra

LADDER = (0, 1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 90, 128, 150, 181, 256)
ORDERS = (1, 2, 3)
# Windows: the smallest that leaves this margin of equations over unknowns, and wider ones.
MARGIN = 1.4
WIDENING = (1.0, 1.6, 2.6)
# Widest half-window as part of the band.
WIDEST = 0.05
# Work of the whole identification [floating-point operations] that a candidate may cost.
WORK = 3.0e11
# Trial windows: at least so many, and as many as bring the degrees of freedom to FREEDOM, up to a limit.
TRIALS = 6
FREEDOM = 800
TRIALS_MAX = 60
# How many rungs of the ladder may fail to improve before the climb ends.
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
    regression = prepare(spectra, transient=transient, reach=max(ladder, default=0) * spectra.mesh_lines)
    best: Choice | None = None
    for polynomial in ORDERS if order is None else (order,):
        failures = 0
        best_here = np.inf
        for branches in ladder:
            trials = [
                Choice(window, _predicted_error(spectra, regression, lines, window))
                for window in _windows(spectra, regression, lines, branches, polynomial, transient, half_width)
            ]
            least = min(trials, key=lambda choice: choice.error, default=None)
            if least is None:
                break
            if best is None or least.error < best.error:
                best = least
            failures = 0 if least.error < best_here else failures + 1
            best_here = min(best_here, least.error)
            if failures >= PATIENCE:
                break
    if best is None or not np.isfinite(best.error):
        raise LpmError(_refusal(spectra, lines, harmonics, order, half_width))
    return best.window


def trial_centres(spectra: Spectra, lines: NDArray[np.int64], count: int) -> list[int]:
    """Lines inside the output band, at most `count`, that share its response power evenly."""
    band = np.arange(lines[0], lines[-1] + 1)
    band = band[band % spectra.mesh_lines != 0] if spectra.mesh_lines > 1 else band
    power = np.cumsum(np.mean(np.abs(spectra.dte[:, band]) ** 2, axis=0))
    targets = (np.arange(count) + 0.5) / count * power[-1]
    return sorted({int(line) for line in band[np.searchsorted(power, targets)]})


def _windows(
    spectra: Spectra,
    regression: Regression,
    lines: NDArray[np.int64],
    harmonics: int,
    order: int,
    transient: bool,
    half_width: int | None,
) -> Iterator[Window]:
    """Admissible windows of L branches and order R, narrow to wide."""
    rows = needed_rows(lines, harmonics, spectra.mesh_lines)
    widest = max(int(WIDEST * (lines[-1] - lines[0])), order + 1)
    if half_width is None:
        least = _least_half_width(regression, lines, Window(harmonics, order, 1, transient), widest)
        if least is None:
            return
        widths = sorted({round(least * factor) for factor in WIDENING})
        widths = [width for width in widths if width <= max(widest, least)]
    else:
        widths = [half_width]
    for width in widths:
        window = Window(harmonics, order, width, transient)
        centres = plan_centres(rows, window, regression.last_row(harmonics))
        if not all(_has_equations(regression, centre, window) for centre, _ in centres):
            continue
        work = len(centres) * 4 / 3 * window.unknowns**3
        if work <= WORK and harmonics * spectra.mesh_lines + max(width, lines[-1]) <= spectra.highest:
            yield window


def _least_half_width(regression: Regression, lines: NDArray[np.int64], window: Window, widest: int) -> int | None:
    """Smallest n that gives MARGIN times more equations than unknowns in the middle of the band, or None."""
    centre = int(lines[lines.size // 2])
    low, high = window.order + 1, widest
    if not _supports(regression, centre, window, high):
        return None
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if _supports(regression, centre, window, middle) else (middle + 1, high)
    return low


def _supports(regression: Regression, centre: int, window: Window, half_width: int) -> bool:
    wide = Window(window.harmonics, window.order, half_width, window.transient)
    if centre + half_width > regression.highest:
        return False
    unknowns = int(regression.columns(centre, wide).sum())
    return regression.equations(centre, wide) >= MARGIN * unknowns + 1


def _has_equations(regression: Regression, centre: int, window: Window) -> bool:
    """Whether the window around a centre has an equation to spare."""
    return regression.equations(centre, window) > int(regression.columns(centre, window).sum())


def _predicted_error(spectra: Spectra, regression: Regression, lines: NDArray[np.int64], window: Window) -> float:
    """Criterion of a candidate, mean over its trial windows plus one standard error of the residual.

    Infinite if one of the windows cannot be solved. The standard error keeps small windows, whose residuals scatter,
    from winning by luck.
    """
    middle = int(lines[lines.size // 2])
    spare = regression.equations(middle, window) - int(regression.columns(middle, window).sum())
    count = int(np.clip(FREEDOM / max(spare, 1), TRIALS, TRIALS_MAX))
    centres = trial_centres(spectra, lines, count)
    total, freedom = 0.0, 0
    power = regression.input_power()
    at_centre = window.basis()[window.half_width]
    for wanted in centres:
        centre = min(wanted, regression.highest - window.half_width)
        if regression.equations(centre, window) <= int(regression.columns(centre, window).sum()):
            return np.inf
        gram = gram_of(regression.gram_table(centre, centre, window), 0, window)
        try:
            fit = solve_window(regression, centre, window, gram, want_factor=True)
        except LpmError:
            return np.inf
        spread = np.einsum("p,psj,s->", at_centre, diagonal_variance(fit, window), at_centre)
        total += fit.residual / fit.freedom * (1.0 + power * spread)
        freedom += fit.freedom
    return total / len(centres) * (1.0 + 1.0 / np.sqrt(freedom))


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
