"""Whether a record's mesh is better told by zones of phase than by harmonics, and the fit in them if it is.

Switches, their width and the cubics across them are searched for by their evidence; a remainder of harmonics beside the
zones holds what cubics do not follow, with a size of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.evidence import Marginal, averaged, evident, lengthened, marginal
from gearbench.identification.feedback.functions import Fractions
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.refine import Refined, output_error, refined
from gearbench.identification.feedback.shapes import Mesh, of_harmonics, of_zones, only_zones
from gearbench.identification.feedback.zones import Zones

# Cubics across a switch that are tried, widths [cycles] to begin with, and the least and first step of the search.
PIECES = (1, 2, 3, 4, 6)
WIDTHS = (0.01, 0.02, 0.04, 0.08)
LEAST_STEP, FIRST_STEP = 2e-4, 4e-3
# Harmonics by which steepest phases are found: their Gaussian window.
STEEPNESS = 20.0
# Rounds for noise and sizes of an evidence: of zones alone, of all.
ROUNDS, ALL_ROUNDS = 4, 12
# Twice the logarithm of the evidence that zones must gain over harmonics: the search has chosen among many.
GAIN = 20.0
# Harmonics that the search looks at; those of the fit over the inverse of the width, and at most: beyond three a cubic
# across a switch of 2 % holds 3e-4 of the change of stiffness.
SEARCHED, RESOLVED, MOST = 200, 3.0, 400
# First standard deviation of the remainder relative to that of the zones.
REMAINS = 1e-3


@dataclass(frozen=True)
class InZones:
    """A fit in zones of phase, these, and their `gain` in twice the log evidence over harmonics."""

    fit: Refined
    zones: Zones
    gain: float


def in_zones(fit: Refined, data: ClassData, settled: float) -> InZones | None:
    """The fit in zones of phase from one in harmonics; None where they gain too little. Rounds end as in `refined`.

    Of angles alone, whose mesh has a factor that is hardly known, and of splines there are none.
    """
    model = fit.model
    if model.harmonics < 2 or model.torsional or not isinstance(model.basis, Fractions):
        return None
    lines = int(data.modelled.sum(axis=1).max()) - 1
    most = max(model.harmonics, min(SEARCHED, lines))
    error = marginal(fit, data, most)
    zones = best_zones(error, steepest(model), most)
    if zones is None:
        return None
    beside = of_harmonics(model.harmonics, most)
    gain = evident(error.within(beside), beside, model.vector()[model.free :], ALL_ROUNDS).value
    mesh, promised, value = _told(error, zones, most, model.harmonics)
    gain -= value
    if gain < GAIN:
        return None
    enough = max(model.harmonics, min(int(np.ceil(RESOLVED / zones.width)), MOST, lines))
    mesh = mesh.of_length(zones, enough)
    wide = lengthened(model, enough)
    start = wide.moved(np.concatenate([wide.vector()[: wide.free], mesh.harmonics]))
    if not np.isfinite(output_error(start, data)):
        return None
    found = refined(start, data, settled, mesh)
    # What the fit leaves beyond what was promised of it speaks against the zones.
    gain -= error.count * float(np.log(found.noise / (2 * promised)))
    return InZones(found, zones, gain) if gain > GAIN else None


def _told(error: Marginal, zones: Zones, most: int, remainder: int) -> tuple[Mesh, float, float]:
    """Zones and their remainder of harmonics as the evidence has them, its noise of a real equation and value."""
    alone = only_zones(zones, most)
    first = error.within(alone).least()
    shapes = of_zones(zones, alone.of(first), remainder)
    moves = shapes.functions.shape[1] - first.size
    small = [REMAINS * np.sqrt(np.mean(part**2)) for part in np.split(first, 2)]
    small_ones = np.repeat(small, 2 * remainder) / np.sqrt(shapes.weight[-4 * remainder :])
    own = error.within(shapes)
    found = evident(own, shapes, np.concatenate([first, np.zeros(moves), small_ones]), ALL_ROUNDS)
    value = found.value
    for group in (0, 1):
        found = averaged(own, shapes, found, group + 2, group)
    mesh = Mesh(shapes, found.amplitudes, found.precision, float(found.determined.sum()), held=True)
    return mesh, found.noise, value


def steepest(model: Model) -> tuple[float, float]:
    """Phases [cycles] at which the smoothed stiffness rises and falls most."""
    order = np.arange(1, model.harmonics + 1)
    smoothed = model.k * 1j * order * np.exp(-((order / STEEPNESS) ** 2))
    phases = np.arange(1000) / 1000
    slope = 2 * (np.exp(2j * np.pi * np.outer(phases, order)) @ smoothed).real
    return float(phases[np.argmax(slope)]), float(phases[np.argmin(slope)])


def best_zones(error: Marginal, begin: tuple[float, float], harmonics: int) -> Zones | None:
    """The zones of most evidence, without a remainder, that a search from these switches finds; None if none fit."""
    chosen, least = None, np.inf
    for pieces in PIECES:
        starts = [Zones(begin, width, pieces) for width in WIDTHS]
        if chosen is not None:
            starts.append(replace(chosen, pieces=pieces))
        found, number = min((_alone(error, one, harmonics), number) for number, one in enumerate(starts))
        if not np.isfinite(found):
            continue
        zones, step = starts[number], FIRST_STEP
        while step > LEAST_STEP:
            values = [(_alone(error, one, harmonics), one) for one in _around(zones, step)]
            value, better = min(values, key=lambda pair: pair[0])
            if value < found:
                found, zones = value, better
            else:
                step /= 2
        if found < least:
            chosen, least = zones, found
    return chosen


def _around(zones: Zones, step: float) -> Iterator[Zones]:
    """Zones with one switch moved by a step, or with another width."""
    rise, fall = zones.switches
    for part in (-step, step):
        yield replace(zones, switches=((rise + part) % 1.0, fall))
        yield replace(zones, switches=(rise, (fall + part) % 1.0))
        yield replace(zones, width=zones.width + part)


def _alone(error: Marginal, zones: Zones, harmonics: int) -> float:
    """-2 log evidence of zones without a remainder."""
    if not zones.fits:
        return np.inf
    shapes = only_zones(zones, harmonics)
    own = error.within(shapes)
    return evident(own, shapes, own.least(), ROUNDS).value
