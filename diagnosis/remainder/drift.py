"""A stiffness that drifts over a record, read off what differs between its repetitions.

Repetition r of P is the rig at the mean stiffness of its time: about the mean of all, its lines move by
tau_r delta dY/d(ln k), tau_r = (r + 1/2)/P - 1/2, where delta is the change of ln k from the first sample to the last,
so that k itself changes by exp(delta) - 1. The derivative is that of the rig found. One number explains all lines of
all channels and records, or none.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import exp, expm1, sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import SIDES, SUPPORT_PLACES
from gearbench.diagnosis.forces.steadiness import driven_otherwise, scatter_of
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import LIMIT
from gearbench.diagnosis.simulation.target import INDEPENDENT
from gearbench.diagnosis.verdict import NINE_OF_TEN
from gearbench.rig.contract import Place

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Part of what changes, by energy, from which a drift is its cause: a torque that is not locked to the rotation or a
# coupling that slips leave less than 0.2 to it, a support that softens by 7 % less than 0.01 to anything else.
EXPLAINS = 0.5
# Of the energy that the next best place leaves, the part that the best one may leave for the place to be told.
TOLD = 0.5
# Part from which the place that the forces tell is it, though another explains a little more: at a resonance of both
# all stiffnesses change alike, and a rig that is a few percent off there tells them apart no better.
AS_WELL = 0.9
# Change of a stiffness over a record that sound rigs stay below, which settle by 0.4 % or so.
SOUND = 0.01
LEAST_SHARE = 0.01  # part of what changes below which nothing is told of a size
# Change of the logarithm of a stiffness up to which lines change in proportion to it; more is something else.
LARGEST = 0.5


@dataclass(frozen=True)
class Drift:
    """Relative change of the stiffness at `place` from the first sample of a record to the last, with its standard
    deviation, the part of all that changes between repetitions that it explains, by energy, nats of evidence, and
    whether less is left with it `everywhere`: in each channel of each record in which anything changes."""

    place: Place
    value: float
    std: float
    share: float
    nats: float
    everywhere: bool = False

    @property
    def beyond_sound(self) -> bool:
        """Whether it is, within two deviations, more than sound rigs have."""
        return abs(self.value) - 2.0 * self.std > SOUND

    @property
    def shown(self) -> bool:
        """Whether it is that and records call for it as they do for an effect: whatever the force residuals see, whose
        equations may have more noise than a displacement."""
        return self.beyond_sound and self.nats > LIMIT

    @property
    def grows(self) -> float:
        """Factor by which what changes and is not explained grows without it, rms over rms."""
        return 1.0 / sqrt(max(1.0 - self.share, 1e-12))


@dataclass(frozen=True)
class _Part:
    """What changes of a channel of a record: repetitions' departures (P, n) from their mean in units of the noise, at
    the lines that change, and tau_r (P, 1); derivatives of the same lines (n,) by place."""

    departures: Complex
    time: Array
    derivatives: dict[Place, Complex]

    @property
    def energy(self) -> float:
        """All that changes."""
        return float((np.abs(self.departures) ** 2).sum())

    def slope(self, place: Place) -> tuple[float, float]:
        """Of the energy that is left with a drift there, half the slope and half the curvature."""
        column = self.time * self.derivatives[place]
        return float(np.vdot(column, self.departures).real), float(np.vdot(column, column).real)

    def left(self, place: Place, value: float) -> float:
        """Energy that is left with that drift there."""
        return float((np.abs(self.departures - value * self.time * self.derivatives[place]) ** 2).sum())


def drift_of(
    found: Simulated, steady: Collection[Measurement], place: Place | None = None, *, told: bool = False
) -> Drift | None:
    """The drift that explains most of what changes between repetitions of the `steady` records, among those of the
    search, or nearly all of it at the `place` where what changes acts; where the rig found has `told` that place none
    at another one explains it. None where it explains less than half, where another place would explain nearly as much,
    or nothing changes beyond noise. At a place that is told records may call for one beyond sound rigs', too, that all
    are closer with it: next to a resonance that the rig has a few percent off most of what a stiffness moves is in
    lines beside its own; a damper that changes looks like a drift of a percent there.
    """
    parts = _parts(found, {one.name for one in steady})
    if not parts:
        return None
    every = (_drift_at(parts, one) for one in parts[0].derivatives if not told or one == place)
    drifts = sorted(every, key=lambda one: -one.share)
    if not drifts:
        return None
    there = next((one for one in drifts if one.place == place and one.share > AS_WELL), None)
    if there is not None:
        return there
    best, *others = drifts
    alone = all(1.0 - best.share < TOLD * (1.0 - one.share) for one in others)
    explains = best.share > EXPLAINS or (told and best.everywhere and best.shown)
    return best if explains and alone else None


def _drift_at(parts: list[_Part], place: Place) -> Drift:
    """The drift at one place, from all parts; how well it is known is the largest of its scatter over them, of what all
    lines leave and of what the derivatives may be off by."""
    slopes = np.array([one.slope(place) for one in parts])
    total, weight = slopes.sum(axis=0)
    if weight == 0.0 or abs(total) > LARGEST * weight:
        return Drift(place, 0.0, 0.0, 0.0, 0.0)
    value, seen = total / weight, slopes[:, 1] > 0.0
    apart = slopes[seen, 0] / slopes[seen, 1] - value
    energies = np.array([one.energy for one in parts])
    left = np.array([one.left(place, value) for one in parts])
    lines = np.array([one.departures.shape[1] for one in parts])
    free = sum((len(one.departures) - 1) * one.departures.shape[1] for one in parts)
    scatter = (slopes[seen, 1] * apart**2).sum() / max(seen.sum() - 1, 1), left.sum() / free
    share = float(1.0 - left.sum() / energies.sum())
    # As large as what changes, derivatives that explain this part of it make the size so much too small.
    short = abs(value) * (1.0 / sqrt(max(share, LEAST_SHARE)) - 1.0) / NINE_OF_TEN
    std = max(sqrt(max(scatter) / weight), short)
    nats = np.minimum(INDEPENDENT, lines) * np.log(energies / np.maximum(left, lines))
    everywhere = bool((left < energies).all())
    return Drift(place, expm1(value), exp(value) * std, share, float(nats.sum()), everywhere)


def _parts(found: Simulated, steady: Collection[str]) -> list[_Part]:
    """The channels of the `steady` records in which lines change between repetitions, but for those at which the torque
    on the driver does."""
    target, rows, out, start = found.simulator.target, _rows(found.layout.unknowns), list[_Part](), 0
    asked = {number: target.measurements[number] for number in found.simulator.smooth}
    asked = {number: one for number, one in asked.items() if one.name in steady and one.repetitions > 1}
    if not asked:
        return out
    jacobian = _jacobian(found, list(rows.values()))
    channels = {number: measured_channels(one) for number, one in asked.items()}
    last = max(int(bins[-1]) for _, _, bins in target.plan)
    driven = {number: driven_otherwise(one, last) for number, one in asked.items()}
    for number, channel, bins in target.plan:
        stop = start + len(bins)
        if number in asked:
            repetitions = channels[number][channel]
            count = len(repetitions)
            lines = np.fft.rfft(repetitions, axis=-1)[:, bins] / repetitions.shape[-1]
            scatter = scatter_of(lines)
            changing = scatter.changing & ~driven[number][bins] & (bins > 0)
            unit = np.sqrt(scatter.white) if scatter.white > 0.0 else 1.0
            gains = unit * target.gains[start:stop]
            columns = {place: (jacobian[row, start:stop] / gains)[changing] for place, row in rows.items()}
            time = ((np.arange(count) + 0.5) / count - 0.5)[:, None]
            departures = (lines - lines.mean(axis=0))[:, changing] / unit
            if changing.any():
                out.append(_Part(departures, time, columns))
        start = stop
    return out


def _jacobian(found: Simulated, rows: list[int]) -> Complex:
    """Derivatives (size, K) by these unknowns at least, of simulations that are not nudged: what the driver is nudged
    towards does not drift."""
    best = found.selection.best
    if not found.simulator.nudges:
        return best.sensitivity.jacobian
    chosen = np.isin(np.arange(best.p.size), rows)
    free = found.simulator.free.jacobian(best.p, best.sd, chosen)
    return best.sensitivity.jacobian if free is None else free


def _rows(unknowns: Unknowns) -> dict[Place, int]:
    """The unknown that is the logarithm of the stiffness, by place."""
    supports = {SUPPORT_PLACES[side]: unknowns["stiffness"].start + n for n, side in enumerate(SIDES)}
    return {"mesh": unknowns["scale"].start, **supports}
