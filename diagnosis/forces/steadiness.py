"""What differs from one repetition to the next: content that no periodic rig has, and the equation that it enters by.

The force residuals of single repetitions are taken with the unknowns of a fit; what all repetitions have in common
cancels in their scatter. Of a periodic rig noise is left, whose size is known; a drifting spring or a torque that is
not locked to the rotation leaves more, in the equation of its own place, while the others go on agreeing about the mesh
force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import gammaincinv

from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.forces.covariance import ALIASED, BLOCK, KINDS, expected_squares, kinds_of, noise_of_equations
from gearbench.diagnosis.forces.equations import MESH, PLACES
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.residuals import residuals
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.rig.contract import Place

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

ROUNDS = 60
# Lines that scatter beyond white noise by this factor do not scatter by chance: one in 160 000.
COLOURED = 12.0
# Part of a channel's fluctuation that a sound rig's slow changes leave between repetitions.
SLOW = 3e-3
# Lines of all repetitions that an excess is told for: the more there are, the larger is the sum.
PER_LINES = 20_000
ROUNDED = 1e-6  # part of a line of the torque by which it may change for nothing
NEIGHBOURS = 41  # quiet lines that tell the noise of a line between them


class Unsteady(NamedTuple):
    """What scatters between repetitions beyond noise, by equation, the mesh last: `excess` (equations + 1,), the sum
    over blocks of bins of count log lambda, for PER_LINES of them, and `force` (equations + 1,), its rms [N]; `acts`:
    where the rig that was found tells it, the place at which something changes, whatever its equation shows."""

    excess: Array
    force: Array
    acts: Place | None = None

    @classmethod
    def nothing(cls) -> Unsteady:
        """Of what repeats."""
        return cls(np.zeros(len(PLACES)), np.zeros(len(PLACES)))

    def worst(self, limits: Mapping[str, float]) -> tuple[Place, float]:
        """The place that something changes at, and the largest excess of any over its limit, infinite where a place is
        told otherwise. Else it is, of the places beyond it, that of most force: what changes at one place makes an
        equation wrong at another by as much as its numbers are, and a displacement tells little of that from noise."""
        over = self.excess / np.array([limits[place] for place in PLACES])
        beyond = over > 1.0
        at = np.argmax(np.where(beyond, self.force, -1.0) if beyond.any() else over)
        return (self.acts, inf) if self.acts else (PLACES[int(at)], float(over.max()))


class Scatter(NamedTuple):
    """Variance `apart` (K,) of lines between repetitions, and that of the `white` noise which most of them have."""

    apart: Array
    white: float

    @property
    def changing(self) -> Flags:
        """Which lines (K,) do not scatter by chance."""
        return np.asarray(self.apart > COLOURED * self.white)


def unsteadiness(
    model: NominalModel, measurements: Sequence[Measurement], unknowns: Unknowns, p: Array, band: float
) -> Unsteady:
    """What the measurements scatter by between their repetitions.

    Zero where there is one repetition only, and where no channel changes by more than a sound rig's slow changes make.
    What noise puts into an equation is read off its quiet lines, those that nothing excites, so that no stiffness or
    filter needs to be known for it.
    """
    total, lines = Unsteady.nothing(), 0
    if max(changing_parts(measurements, band).values(), default=0.0) < SLOW:
        return total
    for measured in measurements:
        if measured.repetitions < 2:
            continue
        single = []
        for number in range(measured.repetitions):
            alone = replace(measured, periods={k: v[number : number + 1] for k, v in measured.periods.items()})
            condition = prepare(alone, model, band)
            last = residuals(model, condition, unknowns.departures(p, condition))
            single.append(last.left)
        whole = prepare(measured, model, band)
        scatter = np.stack(single) - np.mean(single, axis=0)
        scatter = scatter / np.sqrt(1 - 1 / measured.repetitions)
        variance = noise_of_equations(model, whole) * measured.repetitions + (ALIASED * whole.force_level) ** 2
        quiet = kinds_of(whole) == KINDS.index("other")
        variance[:MESH] = np.maximum(variance[:MESH], quiet_level(scatter, quiet))
        found = excess_of(scatter, last.mesh_factor, variance)
        total = Unsteady(total.excess + found.excess, np.hypot(total.force, found.force))
        lines += measured.repetitions * whole.bins
    return total._replace(excess=total.excess * (PER_LINES / max(lines, 1)))


def least_unsteadiness(
    model: NominalModel,
    measurements: Sequence[Measurement],
    unknowns: Unknowns,
    rigs: Sequence[Array],
    band: float,
) -> Unsteady:
    """The same for that of several `rigs` (size,) in which least changes in all: what changes is a force at one place,
    and unknowns by which it is one at several are wrong."""
    every = (unsteadiness(model, measurements, unknowns, p, band) for p in rigs)
    return min(every, key=lambda one: float(one.excess.sum()))


def quiet_level(scatter: Complex, quiet: Flags) -> Array:
    """Variance (equations, K) of the scatter (P, equations, K) as neighbouring quiet lines (K,) have it; zero without
    enough of them."""
    rows, lines = scatter.shape[1], scatter.shape[2]
    out = np.zeros((rows, lines))
    at = np.flatnonzero(quiet)
    if at.size < 2 * NEIGHBOURS:
        return out
    # Energies of P departures from their mean are like a gamma distribution of shape P - 1: its median.
    free = len(scatter) - 1
    middle = float(gammaincinv(free, 0.5)) / free
    for row in range(rows):
        energy = (np.abs(scatter[:, row, at]) ** 2).mean(axis=0)
        if np.isfinite(energy).all():
            level = median_filter(energy, NEIGHBOURS, mode="nearest") / middle
            out[row] = np.interp(np.arange(lines), at, level)
    return out


def changing_parts(measurements: Sequence[Measurement], band: float) -> dict[str, float]:
    """By channel the largest rms, of any record, of what scatters between repetitions beyond white noise up to `band`
    [Hz], over that of the channel's fluctuation; empty where there is one repetition only."""
    largest: dict[str, float] = {}
    for measured in measurements:
        if measured.repetitions < 2:
            continue
        for name, repetitions in measured_channels(measured).items():
            last = int(band * repetitions.shape[-1] / measured.sampling_rate)
            lines = np.fft.rfft(repetitions, axis=-1)[:, 1 : max(last, 2)]
            scatter = scatter_of(lines)
            coloured = float(scatter.apart[scatter.changing].sum())
            level = float((np.abs(lines.mean(axis=0)) ** 2).sum())
            if level > 0.0:
                largest[name] = max(largest.get(name, 0.0), float(np.sqrt(coloured / level)))
    return largest


def driven_otherwise(measured: Measurement, last: int) -> Flags:
    """Lines (0 to `last`) at which the torque that is measured on the driver changes between repetitions: what answers
    it is no force that is missing."""
    lines = np.fft.rfft(measured.periods["torque_driver"], axis=-1)[:, 1 : last + 1]
    scatter = scatter_of(lines)
    # A torque without noise is rounded, most where it is largest.
    return np.append(False, scatter.changing & (scatter.apart > (ROUNDED * np.abs(lines.mean(axis=0))) ** 2))


def scatter_of(lines: Complex) -> Scatter:
    """That of lines (P, K) between repetitions."""
    apart = (np.abs(lines - lines.mean(axis=0)) ** 2).sum(axis=0) / (len(lines) - 1)
    return Scatter(apart, float(np.median(apart)) / float(np.log(2.0)))


def excess_of(scatter: Complex, mesh_factor: Complex, variance: Array) -> Unsteady:
    """What scatter (P, equations, K) holds beyond known variance (equations + 1, K), of all its bins; `mesh_factor`
    (equations, K) is that by which an error of the mesh force enters each equation."""
    present = np.flatnonzero(np.isfinite(scatter).all(axis=(0, 2)))
    g = mesh_factor[present]
    r, floor = scatter[:, present], variance[[*present, MESH]]
    of_bin = np.arange(r.shape[2]) // BLOCK
    number = of_bin[-1] + 1
    count = np.bincount(of_bin) * float(len(r))
    factor = np.ones((len(floor), number))
    for _ in range(ROUNDS):
        squares = expected_squares(r, g, floor * factor[:, of_bin]).sum(axis=0)
        total = np.stack([np.bincount(of_bin, square, number) for square in squares / floor])
        factor = np.maximum(total / count, 1.0)
    # A few degrees of freedom always scatter above their variance: only what is clearly more counts.
    clear = np.where(factor > 3.0, factor, 1.0)
    out = Unsteady.nothing()
    out.excess[[*present, MESH]] = (count * np.log(clear)).sum(axis=1)
    out.force[[*present, MESH]] = np.sqrt(2.0 * (floor * (clear[:, of_bin] - 1.0)).sum(axis=1))
    return out
