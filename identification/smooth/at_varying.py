"""Smooth branches at a speed that varies: bandwidth and number of branches chosen, and the branches of all windows.

As at constant speed, with the delays of `turned.py`: the likeliest bandwidth on trial windows, then the number of
branches of least predicted error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from gearbench.identification.lpm.estimate import LpmResult, needed_rows, plan_centres, require_lines
from gearbench.identification.lpm.gathered import rows_around
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.moving import MovingRegression, prepare_moving
from gearbench.identification.lpm.rows import Lines
from gearbench.identification.lpm.selection import LADDER, Search, search_of
from gearbench.identification.smooth.choice import likeliest_step
from gearbench.identification.smooth.estimate import FIRST_ROUNDS, ROUNDS, Pass, SmoothModel
from gearbench.identification.smooth.turned import POWERS, Delays, Turned, delays_for, room_of, span_of, turned
from gearbench.identification.smooth.turned_posterior import TurnedPosterior, turned_equations, turned_posterior
from gearbench.identification.spectra.course import Course
from gearbench.identification.spectra.joint import Spectra

# Rows of a window over all realisations, and of a trial window; least half-width.
ROWS, TRIAL_ROWS, NARROWEST = 500, 240, 6
# Bytes that the turned spectra may take, and operations of the whole identification.
BYTES, WORK = 1.2e9, 3e12
# Trial windows; branches with which bandwidths are compared; what a longer ladder must bring.
TRIALS, ENOUGH, WORTH = 6, 16, 0.98
# Bandwidths that are tried: the half-width of the windows times these powers of a factor.
STEP, FEWEST_STEPS, MOST_STEPS = 1.6, -6, 2


def smooth_at_varying_speed(
    spectra: Spectra,
    course: Course,
    lines: Lines,
    *,
    harmonics: int | None,
    progress: Callable[[float, str], None],
) -> tuple[LpmResult, SmoothModel]:
    """Branches on the output `lines` at the mean speed, and the model that was chosen. Raises LpmError for what the
    record does not support."""
    width = min((ROWS // spectra.realisations - 1) // 2, int(lines[-1]) // 4)
    if width < NARROWEST:
        raise LpmError(
            f"{spectra.realisations} realisations leave windows of n = {width} lines, less than the {NARROWEST} that"
            " smooth branches need; polynomials do"
        )
    trials = _Trials(spectra, course, lines, width)
    model = trials.chosen(harmonics)
    require_lines(spectra, lines, model.window)
    own = _prepared(spectra, course, model, width)
    regression = _rows_of(spectra, course, model.harmonics, width)
    rows = needed_rows(lines, model.harmonics, spectra.mesh_lines)
    plan = plan_centres(rows, model.window, regression.last_row(model.harmonics))
    centres = [(max(centre, width), taken) for centre, taken in plan]

    def solve(centre: int, before: TurnedPosterior | None) -> TurnedPosterior | None:
        equations = turned_equations(spectra, own, centre, width)
        if equations.power == 0.0:
            return None
        return turned_posterior(equations, before, FIRST_ROUNDS if before is None else ROUNDS)

    found = Pass[TurnedPosterior](regression, lines, model, spectra.noise, solve)
    return found.run(centres, lambda part, message: progress(0.4 + 0.6 * part, message)), model


def _prepared(spectra: Spectra, course: Course, model: SmoothModel, half_width: int) -> Turned:
    return turned(spectra, course, model.harmonics, _delays(course, model, half_width), half_width)


def _delays(course: Course, model: SmoothModel, half_width: int) -> Delays:
    return delays_for(model.bandwidth, span_of(course, model.harmonics, half_width), course.force.shape[1])


def _rows_of(spectra: Spectra, course: Course, harmonics: int, half_width: int) -> MovingRegression:
    """Which rows are excited, and what their residuals are held against."""
    return prepare_moving(spectra, course, harmonics=harmonics, order=0, half_width=half_width, operating=False)


class _Trials:
    """Models on trial windows."""

    def __init__(self, spectra: Spectra, course: Course, lines: Lines, half_width: int) -> None:
        self.spectra, self.course, self.lines, self.half_width = spectra, course, lines, half_width
        self.narrow = max(NARROWEST, (TRIAL_ROWS // spectra.realisations - 1) // 2)

    def chosen(self, harmonics: int | None) -> SmoothModel:
        """The likeliest bandwidth, and the number of branches of least predicted error unless it is given."""
        begin = SmoothModel(0, self.half_width, float(self.half_width), True)
        ladder = [harmonics] if harmonics is not None else self._ladder(begin)
        first = max((value for value in ladder if value <= ENOUGH), default=ladder[0])
        model = replace(begin, harmonics=first)
        model = replace(model, bandwidth=self._bandwidth(model))
        best, least = model, self._error(model)
        for value in [value for value in ladder if value > first and self._affordable(replace(model, harmonics=value))]:
            trial = replace(model, harmonics=value)
            error = self._error(trial)
            if error > WORTH * least:
                return replace(best, enough=True)
            best, least = trial, error
        return best

    def _ladder(self, model: SmoothModel) -> list[int]:
        reach = max((self.spectra.highest - int(self.lines[-1])) // self.spectra.mesh_lines, 0)
        return [value for value in LADDER if value <= reach] or [0]

    def _affordable(self, model: SmoothModel) -> bool:
        delays = _delays(self.course, model, self.half_width).lags.size
        if room_of(self.spectra, model.harmonics, delays) > BYTES:
            return False
        rows = needed_rows(self.lines, model.harmonics, self.spectra.mesh_lines)
        windows = len(rows) / max((2 * self.half_width + 1) / 3, 1.0)
        count = self.spectra.realisations * (2 * self.half_width + 1)
        columns = POWERS * (2 * model.harmonics + 1) * delays
        return windows * 16.0 * count**2 * columns * (ROUNDS + 1) <= WORK

    def _bandwidth(self, model: SmoothModel) -> float:
        search = self._search(model)

        @cache
        def evidence(step: int) -> float:
            tried = replace(model, bandwidth=self.half_width * STEP**step)
            return sum(found.evidence for found in self._posteriors(search, tried).values())

        return float(self.half_width * STEP ** likeliest_step(evidence, FEWEST_STEPS, MOST_STEPS))

    def _search(self, model: SmoothModel) -> Search:
        regression = _rows_of(self.spectra, self.course, model.harmonics, self.narrow)
        return search_of(self.spectra, self.lines, True, model.harmonics, regression)

    def _posteriors(self, search: Search, model: SmoothModel) -> dict[int, TurnedPosterior]:
        own, found = _prepared(self.spectra, self.course, model, self.narrow), {}
        for row in search.spread_rows(TRIALS, self.narrow):
            equations = turned_equations(self.spectra, own, max(row, self.narrow), self.narrow)
            if equations.power > 0.0:
                found[row] = turned_posterior(equations, None, FIRST_ROUNDS)
        if not found:
            raise LpmError("no window holds equations: the excitation does not reach the output lines")
        return found

    def _error(self, model: SmoothModel) -> float:
        """Mean over the trial windows of what a row leaves unexplained and of what its branches may err by."""
        search, total, sampled = self._search(model), 0.0, 0.0
        window = replace(model, half_width=self.narrow).window
        for row, found in self._posteriors(search, model).items():
            read = search.read(rows_around(search.regression, np.array([row]), window))[0]
            spread = found.variance(float(min(row - self.narrow, 0)))[0]
            error = found.sizes.noise * search.relevance[row - 1] + search.input_power * float(spread @ read)
            total += error / search.density[row - 1]
            sampled += 1.0 / search.density[row - 1]
        return float(total / sampled)
