"""The smooth branches of all windows, on the output lines.

    Y(k) = sum_l Gs_l(k) U(k - l d) + T(k) + V(k),   G_l(k) = Gs_l(k + l d),

with Gs_l and T smooth random functions (`posterior.py`) in windows of 2n+1 lines, of which the middle third is read.
Each window begins with the sizes of the one before it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from gearbench.identification.lpm.estimate import LpmResult, needed_rows, plan_centres, require_lines
from gearbench.identification.lpm.gathered import rows_around
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.missing import MissingPower, power_beyond
from gearbench.identification.lpm.output import OutputLines
from gearbench.identification.lpm.regression import Regression, Window, prepare
from gearbench.identification.lpm.rows import Lines
from gearbench.identification.smooth.posterior import (
    Equations,
    Posterior,
    Sizes,
    continued,
    first_sizes,
    refined,
)
from gearbench.identification.smooth.turned_posterior import TurnedPosterior
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra

# Rounds for the sizes: of a first window, and of one beside a window whose sizes are known.
FIRST_ROUNDS, ROUNDS = 5, 2
# Equations of a window below which nothing is made of it.
FEWEST = 8

Found = TypeVar("Found", Posterior, TurnedPosterior)


@dataclass(frozen=True)
class SmoothModel:
    """Branches -L..L, half-width n of a window [lines], bandwidth [lines] of the branches, estimated transient;
    `enough`: more branches were tried, and promised nothing."""

    harmonics: int
    half_width: int
    bandwidth: float
    transient: bool
    enough: bool = False

    @property
    def window(self) -> Window:
        """The window's rows and columns; polynomials of order 0 stand for the functions."""
        return Window(self.harmonics, 0, self.half_width, False)


def window_equations(regression: Regression, centre: int, model: SmoothModel) -> Equations | None:
    """The equations of the window around the line `centre`; None where there are too few to make anything of."""
    rows = rows_around(regression, np.array([centre]), model.window)
    offset = np.arange(-model.half_width, model.half_width + 1)
    count = regression.experiments
    kept = np.ones((offset.size, count), dtype=bool)
    kept[(centre + offset) % regression.mesh_lines == 0, : regression.operating_rows_lost] = False
    kept[np.isin(centre + offset, regression.folded)] = False
    if not model.transient:
        kept &= rows.excited[0].any(axis=1)[:, None]
    if np.count_nonzero(kept) < FEWEST or not rows.excited.any():
        return None
    columns: Complexes = rows.inputs[0]
    if model.transient:
        turn = np.exp(-2j * np.pi * np.outer(offset, regression.start_phase) / regression.mesh_lines)
        own = np.eye(count) * turn[:, :, None]
        columns = np.concatenate([columns, own], axis=2)
    lines = np.broadcast_to(offset[:, None], kept.shape)
    data = rows.observed[0].T
    return Equations(data[kept], columns[kept], lines[kept].astype(float), model.harmonics)


def smooth_branches(
    spectra: Spectra,
    lines: Lines,
    model: SmoothModel,
    *,
    progress: Callable[[float, str], None] | None = None,
) -> LpmResult:
    """Identify the branches -L..L on the output `lines` (rising, multiples of their common step).

    Raises LpmError, with the numbers, where sidebands leave the lines that the spectra hold, or where no window has
    equations.
    """
    require_lines(spectra, lines, model.window)
    regression = prepare(spectra, transient=model.transient, reach=model.harmonics * spectra.mesh_lines)
    rows = needed_rows(lines, model.harmonics, spectra.mesh_lines)
    plan = plan_centres(rows, model.window, regression.last_row(model.harmonics))
    # Rows below 0 mirror those above and say nothing new.
    centres = [(max(centre, model.half_width), own) for centre, own in plan]

    def solve(centre: int, before: Posterior | None) -> Posterior | None:
        equations = window_equations(regression, centre, model)
        if equations is None or equations.power == 0.0:
            return None
        return posterior_beside(equations, before.sizes if before else None, model.bandwidth)

    return Pass[Posterior](regression, lines, model, spectra.noise, solve).run(centres, progress)


class Pass(Generic[Found]):
    """One pass over all windows; `solve(centre, before)` makes the posterior of one from that of the window before it,
    or None where there is nothing to solve."""

    def __init__(
        self,
        regression: Regression,
        lines: Lines,
        model: SmoothModel,
        noise: Floats | None,
        solve: Callable[[int, Found | None], Found | None],
    ) -> None:
        self.regression, self.model, self.noise = regression, model, noise
        self.solve: Callable[[int, Found | None], Found | None] = solve
        self.missing = MissingPower(regression, lines, model.harmonics)
        self.determined: list[tuple[float, int]] = []
        self.residual = self.power = 0.0
        self.spread = self.noisy = 0.0

    def run(
        self, centres: list[tuple[int, Lines]], progress: Callable[[float, str], None] | None
    ) -> LpmResult:
        """Condition every window on its data."""
        model = self.model
        before: Found | None = None
        last = int(centres[-1][1][-1])
        output = OutputLines(self.missing.lines, model.harmonics, self.regression.mesh_lines, last)
        for done, (centre, own) in enumerate(centres, start=1):
            found = self.solve(centre, before)
            if found is None:
                continue
            before = found
            self._read(found, output, centre, own)
            if progress is not None:
                progress(done / len(centres), f"window {done} of {len(centres)}")
        if before is None:
            raise LpmError("no window holds equations: the excitation does not reach the output lines")
        return self._result(output, len(centres))

    def _read(self, found: Found, output: OutputLines, centre: int, own: Lines) -> None:
        offset = (own - centre).astype(float)
        branches = 2 * self.model.harmonics + 1
        # The variance is least in the middle and rises to both ends: three rows tell it.
        told = np.unique(offset[[0, own.size // 2, -1]])
        both = np.array([found.variance(float(at)) for at in told])[:, :, :branches]
        place = np.clip(np.searchsorted(told, offset), 1, max(told.size - 1, 1))
        if told.size > 1:
            share = ((offset - told[place - 1]) / (told[place] - told[place - 1]))[:, None, None]
            values = both[place - 1] * (1 - share) + both[place] * share
        else:
            values = np.repeat(both, own.size, axis=0)
        output.put(own, found.mean(offset)[:, :branches], values[:, 0])
        self.spread += float(values[:, 0].sum())
        self.noisy += float(values[:, 1].sum())
        power, noise = found.equations.power, found.sizes.noise
        output.explain(own, np.full(own.size, max(1.0 - noise / power, 0.0)))
        count = found.equations.data.size
        freedom = max(count - found.determined, 1.0)
        self.missing.add(np.array([noise]), np.array([freedom / self.model.window.width]), [own])
        self.determined.append((found.determined, count))
        self.residual += noise
        self.power += power

    def _missing(self, output: OutputLines) -> float:
        """Missing response: the residual above the noise.

        Of a single period, whose residual may be either, where nobody has tried more branches: half of that, and half
        of what the known branches foretell of those beyond and the residual can hold, unless it is even like noise.
        """
        missing = self.missing
        if self.noise is not None:
            return missing.total(self.noise)
        seen = missing.total(missing.flat())
        if self.model.enough or missing.even:
            return seen
        foretold = min(power_beyond(output.htf, output.variance), missing.total(0.0))
        return max(seen, 0.5 * (seen + foretold))

    def _result(self, output: OutputLines, windows: int) -> LpmResult:
        missing = self.missing
        determined, count = self.determined[len(self.determined) // 2]
        return LpmResult(
            missing.lines,
            output.htf,
            output.variance,
            output.variance.sum(axis=0)[None, :].astype(complex),
            self._missing(output),
            missing.total(0.0 if self.noise is None else self.noise),
            missing.total(0.0),
            float(np.sqrt(self.residual / self.power)),
            float("nan"),
            round(determined),
            count,
            windows,
            1,
            "omitted",
            output.coherence,
            open_share=max(1.0 - self.noisy / self.spread, 0.0) if self.spread else 0.0,
        )


def posterior_beside(equations: Equations, before: Sizes | None, bandwidth: float) -> Posterior:
    """The posterior of a window, beginning with the sizes of the one `before` it if there is one."""
    if before is None:
        return refined(equations, first_sizes(equations), bandwidth, FIRST_ROUNDS)
    return refined(equations, continued(equations, before), bandwidth, ROUNDS)
