"""Power of what a local model leaves out: residual above the noise, shared among the branches that can have caused it.

Per degree of freedom the residual of a window holds s^2 = noise + sum_j |dGs_j U_j|^2 over everything that the model
does not have: branches beyond L, and what polynomials of order R do not follow. With inputs of power P_u on each line

    sum_j |dGs_j(m)|^2 = (s^2(m) - noise) / P_u,

whatever the branches are like. Rows that no window serves hold nothing but missing response.

Noise: from repeated periods where there are some; else the residual of the quietest part of the excited band, less what
would be missing there if the whole residual elsewhere were missing response. Noise that is larger elsewhere, or a
record without a quiet part, then counts as missing response: the error is overstated, not understated.

A row's missing power comes from sources inside and outside of the output lines. A varying stiffness turns the response
at the source into force in the row, so that branch j is taken to weigh the response at its source times
VARIATION / j^2, the power of the harmonics of a stiffness that jumps, over the quasi-static response that branch 0
weighs. Rows without a window lie further from the output lines than those with one, and less reaches them.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import nnls

from gearbench.identification.lpm.regression import Regression
from gearbench.identification.spectra.joint import Complexes, Floats

Lines = NDArray[np.int64]

# Parts of the excited band whose quietest one tells the noise, and how far the least of so many normal numbers lies
# below their mean [standard deviations].
PARTS = 12
LEAST_OF_PARTS = 1.63
# Parts of all rows whose residuals are compared, and how much noise may differ between them.
EVERYWHERE, EVEN = 32, 2.0
# Rows in which sources are counted, at most, and part of all lines over which the response of sources is averaged.
COUNTED = 300
AVERAGED = 0.004
# (dk / (pi k))^2 of a stiffness that jumps by half of its mean.
VARIATION = 0.03
# Groups of rows with windows that rows without are held against.
NEAR = 8
# Largest part of an octave of orders that the next one holds: powers like 1/l^2.
SLOWEST = 0.5
# Sources that are looked at together, over all rows.
TOGETHER = 500_000


def power_beyond(htf: Complexes, variance: Floats) -> float:
    """Sum over the lines of |G_l|^2 of the branches beyond an HTF (2L+1, F) of that variance, by its last two octaves.

    Each octave of orders holds as much less than the one before as the last but one octave foretells, and at most the
    half, as where powers fall like 1/l^2. Infinite below L = 2.
    """
    known = htf.shape[0] // 2
    if known < 2:
        return float("inf")
    power = np.sum(np.abs(htf) ** 2 - variance, axis=1)
    order = np.abs(np.arange(-known, known + 1))
    inner, outer = (float(power[(order > known / (2 * n)) & (order <= known / n)].sum()) for n in (2, 1))
    if outer <= 0.0:
        return 0.0
    fall = min(outer / inner, SLOWEST) if inner > 0.0 else SLOWEST
    return outer * fall / (1.0 - fall)


class MissingPower:
    """Sum over output lines k and branches l of |error of G_l(k)|^2 that no variance tells, window by window."""

    def __init__(self, regression: Regression, lines: Lines, harmonics: int) -> None:
        self.regression, self.lines, self.harmonics = regression, lines, harmonics
        d, origin = regression.mesh_lines, regression.origin
        self.rows = np.arange(1, regression.highest + 1)
        residue, position = self.rows % d, self.rows // d + origin
        self.excited = np.concatenate([[False], regression.excited[residue, position]])
        data = np.mean(np.abs(regression.dte[residue, :, position]) ** 2, axis=1)
        self.operating = residue == 0 if d > 1 else np.zeros(self.rows.size, dtype=bool)
        self.operating = self.operating | np.isin(self.rows, regression.folded)
        width = max(3, round(AVERAGED * self.rows.size))
        self.power: Floats = np.concatenate([[0.0], data])
        self.response = np.concatenate([[0.0], uniform_filter1d(np.where(self.operating, 0.0, data), width)])
        self.response *= self.excited
        rising = self.response[: int(np.argmax(self.response)) + 1]
        rising = rising[rising > 0]
        self.static = float(np.median(rising)) if rising.size else 0.0
        # Rows without a window: all response is missing.
        self.level: Floats = np.concatenate([[0.0], data])
        self.covered = np.zeros(self.rows.size + 1, dtype=bool)
        self.freedom = np.zeros(self.rows.size + 1)
        self.step = int(np.min(np.diff(lines))) if lines.size > 1 else 1

    def add(self, level: Floats, freedom: Floats, rows: list[Lines]) -> None:
        """Take in the residual variances `level` [m^2] of windows and their degrees of `freedom` for each line, for the
        `rows` that are read from each."""
        for index, own in enumerate(rows):
            served = slice(int(own[0]), int(own[-1]) + self.step)
            self.level[served] = level[index]
            self.covered[served] = True
            self.freedom[served] = freedom[index]

    def quietest(self) -> float:
        """Noise [m^2] of a line and experiment from the quietest part of the excited band."""
        means, freedom, response = self._parts()
        if not freedom.size:
            return 0.0
        least = int(np.argmin(means))
        found = means[least] * (1.0 + LEAST_OF_PARTS / np.sqrt(freedom[least]))
        return float(max(found - means.mean() / response.mean() * response[least], 0.0))

    def apart(self) -> float:
        """Noise [m^2] as the most that a part of the excited band holds beyond its share of what would be missing if
        all residuals were, and no more than the quietest part's: of models that lack little, whose residuals are flat.
        """
        means, freedom, response = self._parts()
        if not freedom.size:
            return 0.0
        least = int(np.argmin(means))
        beyond = float(np.max(means - means.mean() / response.mean() * response))
        return max(min(beyond, float(means[least] * (1.0 + LEAST_OF_PARTS / np.sqrt(freedom[least])))), 0.0)

    def flat(self) -> float:
        """Noise [m^2] as what the residuals of the parts of the excited band hold alike, beside what goes with their
        response, by least squares and less one standard deviation; at least what `apart` tells."""
        means, freedom, response = self._parts()
        if not freedom.size:
            return 0.0
        weight = np.sqrt(freedom) / means
        columns = np.stack([np.ones(means.size), response / response.mean()], axis=1) * weight[:, None]
        found, _ = nnls(columns, means * weight)
        # Missing response is no more even than chance is: its scatter tells how well the two are told apart.
        kept = columns[:, found > 0]
        scatter = float(np.sum((means * weight - columns @ found) ** 2)) / (means.size - kept.shape[1])
        spread = np.linalg.pinv(kept.T @ kept)[0, 0] * max(scatter, 1.0) if found[0] > 0 else 0.0
        return max(float(found[0] - np.sqrt(spread)), self.apart())

    @property
    def even(self) -> bool:
        """Whether the residuals are as even as white noise over all rows, beyond the excited band too, where missing
        branches lead just as well."""
        rows = self.rows[~self.operating]
        levels = np.array([self.level[part].mean() for part in np.array_split(rows, EVERYWHERE) if part.size])
        return bool(levels.max() <= EVEN * levels.min())

    def _parts(self) -> tuple[Floats, Floats, Floats]:
        """Residual level, degrees of freedom and mean response of each part of the excited band; none if small."""
        driven = np.flatnonzero(self.covered & (np.arange(self.covered.size) <= np.flatnonzero(self.excited)[-1]))
        driven = driven[driven > 0]
        driven = driven[~self.operating[driven - 1]]
        nothing: Floats = np.zeros(0)
        if driven.size < PARTS:
            return nothing, nothing, nothing
        parts = np.array_split(driven, PARTS)
        freedom = np.array([self.freedom[part].sum() for part in parts])
        sums = np.array([np.sum(self.level[part] * self.freedom[part]) for part in parts])
        response = np.array([self.power[part].mean() for part in parts])
        if not freedom.min() > 0:
            return nothing, nothing, nothing
        return sums / freedom, freedom, response

    def total(self, noise: Floats | float) -> float:
        """The sum with the noise [m^2] of every row (lines 0, 1, ..) or of all."""
        above = self.level - noise
        above[0] = 0.0
        above[1:][self.operating & ~self.covered[1:]] = 0.0
        groups, share = self._shares
        first, size = np.array([rows[0] for rows in groups]), np.array([rows.size for rows in groups])
        mean = np.array([above[rows].mean() for rows in groups]) * share
        served = self.covered[first]
        if served.any() and not served.all():
            distance = np.abs(first[~served, None] - first[served])
            near = np.argsort(distance, axis=1, kind="stable")[:, :NEAR]
            mean[~served] = np.minimum(mean[~served], mean[served][near].mean(axis=1))
        density = self.lines.size / (self.lines[-1] - self.lines[0] + self.step)
        return max(float(size @ mean), 0.0) * density / self.regression.input_power()

    @cached_property
    def _shares(self) -> tuple[list[Lines], Floats]:
        """Groups of rows, those with a window apart from the others, and the shares of output lines in them."""
        parts = np.array_split(self.rows, min(COUNTED, self.rows.size))
        groups = [
            own for part in parts for own in (part[self.covered[part]], part[~self.covered[part]]) if own.size
        ]
        middle = np.array([own[own.size // 2] for own in groups])
        fewest = np.where(self.covered[[own[0] for own in groups]], self.harmonics + 1, 0)
        count = max(1, TOGETHER * self.regression.mesh_lines // (2 * self.excited.size))
        cuts = range(count, middle.size, count)
        found = [self._share(*both) for both in zip(np.split(middle, cuts), np.split(fewest, cuts), strict=True)]
        return groups, np.concatenate(found)

    def _share(self, row: Lines, fewest: Lines) -> Floats:
        """Part (rows,) of the missing response in each row whose sources lie between the output lines; branches from
        `fewest` (rows,)."""
        d, count = self.regression.mesh_lines, self.excited.size
        reach = (int(row.max()) + count) // d + 1
        branch = np.arange(-reach, reach + 1)
        source = np.abs(row[:, None] + branch * d)
        known = source < count
        source = np.where(known, source, 0)
        response = VARIATION * self.response[source] / np.maximum(np.abs(branch), 1) ** 2 * known
        response[:, reach] = self.static * self.excited[row]
        inside = known & (source >= self.lines[0]) & (source <= self.lines[-1])
        # What is missing may be the branches from `fewest` on, or what the polynomials of the others do not follow:
        # without knowledge of which, half of each.
        later = response * (np.abs(branch) >= fewest[:, None])
        sums = np.array([response.sum(axis=1), later.sum(axis=1)])
        parts = np.array([(response * inside).sum(axis=1), (later * inside).sum(axis=1)])
        some = np.array([response.any(axis=1), later.any(axis=1)])
        shares = np.where(some, parts / np.where(some, sums, 1.0), 0.0)
        return np.asarray(shares.sum(axis=0) / np.maximum(some.sum(axis=0), 1))
