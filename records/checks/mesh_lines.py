"""The mesh that a record declares against the one that its dte shows: harmonics of the mesh stand out of the response.

Under a mean load the static transmission error repeats with the mesh and makes lines of its own, the response to the
excitation lies between them. Where none of the declared mesh frequency's harmonics stands out and those of another one
do, the record is of that other one: so a mesh period from a wrong number of teeth is told without angles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import Look

Array = NDArray[np.float64]

# Harmonics that are looked at, and fewest of them below half the sampling rate.
HARMONICS, FEWEST = 8, 4
# Lines on each side that a line is compared with, of those that the force excites or of the others; it excites those
# above this part of its strongest one's power.
NEIGHBOURS, EXCITED = 12, 1e-6
# Logarithm of a power over the median of its neighbours: mean and deviation for random lines (of an exponential
# distribution), and what it counts as at most, so that a single line makes no mesh.
MEAN, DEVIATION, MOST = -0.2107, 1.2825, 6.0
# Mean logarithm in deviations: harmonics that do not stand out, and those that certainly do.
HIDDEN, SURE = 2.5, 6.0
# Mesh frequencies that are tried: up to so many times the declared one either way, this far apart [lines], and not
# further away than so many lines.
FACTOR, STEP, FURTHEST = 3.0, 0.05, 2000.0
# Parts of the declared mesh frequency whose own harmonics may be the mesh's.
PARTS = (2, 3)


def mesh_lines_stand_out(look: Look) -> list[Finding]:
    """Harmonics of the declared mesh frequency stand out of the dte, if those of any frequency do; lines midway between
    them do not, unless something else repeats as slowly. For records without angles, which would tell the speed."""
    error, force, period = look.stored_or_own_dte, look.force, look.mesh_period
    if error is None or force is None or period is None or not look.steady or "angle_driver" in look.record:
        return []
    if not np.ptp(error) > 0:
        return []
    spacing = look.rate / look.samples
    declared = 1.0 / (period * spacing)
    harmonics = np.arange(1, HARMONICS + 1)
    heights = _heights(error, force)
    harmonics = harmonics[harmonics * declared < heights.size - 1]
    if harmonics.size < FEWEST or declared < 1.0:
        return []
    own = float(_standing_out(heights, np.array([declared]), harmonics)[0])
    if own < HIDDEN:
        tried = np.arange(
            max(1.0, declared / FACTOR, declared - FURTHEST), min(declared * FACTOR, declared + FURTHEST), STEP
        )
        tried = tried[tried * harmonics[-1] < heights.size - 1]
        found = _standing_out(heights, tried, harmonics)
        if not found.size or found.max() < SURE:
            return []
        best = float(tried[_first_run(found == found.max())].mean()) * spacing
        return [
            Finding(
                f"the dte repeats with a mesh frequency of about {best:.3g} Hz, whose harmonics stand out of the"
                f" response, while those of the declared {1 / period:.6g} Hz do not: wrong number of teeth, mesh_period"
                " or sampling_rate"
            )
        ]
    return _between(heights, declared, period)


def _between(heights: Array, declared: float, period: float) -> list[Finding]:
    """The warning where harmonics of half or a third of the declared frequency stand out that are none of its own."""
    for part in PARTS:
        own = np.arange(1, part * FEWEST)
        own = own[own % part > 0][:FEWEST]
        if _standing_out(heights, np.array([declared / part]), own)[0] > SURE:
            return [
                Finding(
                    f"the dte repeats with {1 / (part * period):.6g} Hz as well, {['half', 'a third'][part - 2]} of the"
                    f" declared mesh frequency of {1 / period:.6g} Hz: do teeth differ, or is mesh_period {part} times"
                    " too short?",
                    refused=False,
                )
            ]
    return []


def _first_run(chosen: NDArray[np.bool_]) -> slice:
    """The first run of what is chosen: multiples of a mesh frequency may stand out as well as itself."""
    first = int(np.argmax(chosen))
    last = first + int(np.argmin(np.append(chosen[first:], False)))
    return slice(first, last)


def _heights(error: Array, force: Array) -> Array:
    """Logarithm (lines,) of the dte's power over that of its neighbours; NaN where it has too few of its kind."""
    power, driving = (np.abs(np.fft.rfft(x - x.mean())) ** 2 for x in (error, force))
    excited = driving > EXCITED * driving.max()
    heights = np.full(power.size, np.nan)
    for kind in (excited, ~excited):
        lines = np.flatnonzero(kind)
        lines = lines[lines > 0]
        if lines.size <= 2 * NEIGHBOURS:
            continue
        level = median_filter(power[lines], 2 * NEIGHBOURS + 1, mode="nearest")
        floor = np.finfo(float).eps ** 2 * power.max()  # rounding
        heights[lines] = np.log(np.maximum(power[lines], floor) / np.maximum(level, floor))
    return np.clip(heights, -MOST, MOST)


def _standing_out(heights: Array, lines: Array, harmonics: NDArray[np.int64]) -> Array:
    """By how many deviations (C,) of chance the harmonics of mesh frequencies `lines` (C,) stand out on the mean."""
    at = np.round(lines[:, None] * harmonics).astype(np.int64)
    known = np.isfinite(heights[at])
    count = known.sum(axis=1)
    total = np.where(known, heights[at], 0.0).sum(axis=1)
    enough = count >= FEWEST
    mean = total / np.maximum(count, 1) - MEAN
    return np.where(enough, mean * np.sqrt(count) / DEVIATION, 0.0)
