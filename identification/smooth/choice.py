"""Choice of window, bandwidth and branches of the smooth model, and its predicted error.

Windows are as wide as their rows can be afforded. Of the bandwidths, each a part of the one before, the likeliest wins
(evidence of trial windows, Rasmussen and Williams 2006, 5.4): branches are what varies least that still explains the
data. More branches cost no equations, so that the ladder of branches is climbed while the predicted error of the ITF,

    mean over rows of  n + P_u sum_l Var G_l,

falls: `lpm/selection.py` predicts the same of polynomials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.estimate import needed_rows, plan_centres
from gearbench.identification.lpm.gathered import rows_around
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.regression import Regression, prepare
from gearbench.identification.lpm.selection import LADDER, Search, search_of
from gearbench.identification.smooth.estimate import FIRST_ROUNDS, ROUNDS, SmoothModel, window_equations
from gearbench.identification.smooth.posterior import Posterior, first_sizes, refined
from gearbench.identification.spectra.joint import Spectra

# Rows of a window, over all realisations, and lines beyond which it need not reach, in bandwidths.
ROWS = 800
# Widest half-window as part of the lines that the spectra hold.
WIDEST = 0.25
# Least half-width.
NARROWEST = 6
# Trial windows, and part of a window's width that suffices to compare bandwidths and numbers of branches.
TRIALS, PART = 8, 0.5
# Bandwidths that are tried: the half-width times these powers of a factor.
STEP, FEWEST_STEPS, MOST_STEPS = 1.5, -9, 4
# Branches with which bandwidths are compared, and what a longer ladder must bring.
ENOUGH, WORTH = 33, 0.98
# Rungs of the ladder that may bring nothing.
PATIENCE = 2
# Work of the whole identification [floating-point operations]: windows are narrowed to it, by this factor a time.
WORK, NARROWER = 1.5e12, 0.8


def choose_smooth(
    spectra: Spectra, lines: NDArray[np.int64], *, transient: bool, harmonics: int | None = None
) -> SmoothModel:
    """The model of least predicted error; a number of branches is kept if given. Raises LpmError, with the numbers, if
    the record supports none."""
    reach = max((spectra.highest - int(lines[-1])) // spectra.mesh_lines, 0)
    ladder = [harmonics] if harmonics is not None else [value for value in LADDER if value <= reach]
    width = _half_width(spectra, lines)
    regression = prepare(spectra, transient=transient, reach=max(ladder) * spectra.mesh_lines)
    search = search_of(spectra, lines, transient, max(ladder), regression)
    begin = max((value for value in ladder if value <= ENOUGH), default=ladder[0])
    narrow = SmoothModel(begin, max(NARROWEST // 2, round(PART * width)), float(width), transient)
    narrow = replace(narrow, bandwidth=_bandwidth(regression, search, narrow, width))
    narrow = replace(narrow, harmonics=_branches(regression, search, narrow, ladder))
    model = replace(narrow, half_width=width, enough=narrow.harmonics < max(ladder))
    while _work(regression, lines, model) > WORK:
        model = replace(model, half_width=int(NARROWER * model.half_width))
        if model.half_width < NARROWEST:
            raise LpmError(
                f"smooth branches on {lines.size} lines of {spectra.realisations} realisations take more than"
                f" {WORK:g} operations; polynomials do not"
            )
    return model


def _half_width(spectra: Spectra, lines: NDArray[np.int64]) -> int:
    """Half-width [lines] of the windows. Raises LpmError where realisations or lines leave none."""
    width = min((ROWS // spectra.realisations - 1) // 2, int(WIDEST * int(lines[-1])))
    if width < NARROWEST:
        raise LpmError(
            f"{spectra.realisations} realisations of {spectra.duration:g} s leave windows of n = {width} lines, less"
            f" than the {NARROWEST} that smooth branches need; polynomials do"
        )
    return width


def _posteriors(regression: Regression, search: Search, model: SmoothModel) -> dict[int, Posterior]:
    """Trial windows by the row that is judged, their middle one but near frequency 0."""
    found = {}
    for row in search.spread_rows(TRIALS, model.half_width):
        equations = window_equations(regression, max(row, model.half_width), model)
        if equations is not None and equations.power > 0.0:
            found[row] = refined(equations, first_sizes(equations), model.bandwidth, FIRST_ROUNDS)
    if not found:
        raise LpmError("no window holds equations: the excitation does not reach the output lines")
    return found


def _bandwidth(regression: Regression, search: Search, model: SmoothModel, width: int) -> float:
    """The likeliest bandwidth [lines] on the ladder around the half-width `width` of the final windows."""

    @cache
    def evidence(step: int) -> float:
        tried = replace(model, bandwidth=width * STEP**step)
        return sum(found.evidence for found in _posteriors(regression, search, tried).values())

    return width * STEP ** likeliest_step(evidence, FEWEST_STEPS, MOST_STEPS)


def likeliest_step(evidence: Callable[[int], float], fewest: int, most: int) -> int:
    """The step of a ladder from `fewest` to `most` at which the log `evidence` of a step is largest, climbed from 0."""
    best = 0
    for direction in (-1, 1):
        while fewest <= best + direction <= most and evidence(best + direction) > evidence(best):
            best += direction
        if best:
            break
    return best


def _branches(regression: Regression, search: Search, model: SmoothModel, ladder: list[int]) -> int:
    """The number of branches of least predicted error."""
    best, least, failures = model.harmonics, _error(regression, search, model), 0
    for value in ladder:
        if value <= model.harmonics:
            continue
        error = _error(regression, search, replace(model, harmonics=value))
        if error < WORTH * least:
            best, least, failures = value, error, 0
        else:
            failures += 1
        if failures >= PATIENCE:
            break
    return best


def _error(regression: Regression, search: Search, model: SmoothModel) -> float:
    """Mean over the trial windows of what a row leaves unexplained and of what its branches may err by."""
    total = sampled = 0.0
    for row, found in _posteriors(regression, search, model).items():
        read = search.read(rows_around(regression, np.array([row]), model.window))[0]
        spread = found.variance(float(min(row - model.half_width, 0)))[0][: read.size]
        error = found.sizes.noise * search.relevance[row - 1] + search.input_power * float(spread @ read)
        total += error / search.density[row - 1]
        sampled += 1.0 / search.density[row - 1]
    return float(total / sampled)


def _work(regression: Regression, lines: NDArray[np.int64], model: SmoothModel) -> float:
    """Floating-point operations of the identification: three products with the columns, factor and inverse, a round."""
    rows = needed_rows(lines, model.harmonics, regression.mesh_lines)
    windows = len(plan_centres(rows, model.window, regression.last_row(model.harmonics)))
    count = regression.experiments * model.window.width
    columns = model.window.branches + (regression.experiments if model.transient else 0)
    each = 24.0 * count**2 * columns + 4.0 * count**3
    return windows * each * (ROUNDS + 2)
