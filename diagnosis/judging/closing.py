"""What an effect closes of the gap in a record: nats, and by how much some part of the gap grows without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.simulation.target import Target

Array = NDArray[np.float64]
Part = tuple[str, str]  # of a gap: channel, and kind of line or band in words

# By how much the gap must grow without an effect for it to be named.
DUE = 1.1
# Nats by which the judged record must be more likely with it: odds of 20.
GAIN = 3.0
# Energy of what an effect changes over that of what is left, below which a record does not feel it.
FELT = 0.1
# Part of a channel's whole gap below which a part of it counts for nothing.
SEEN = 0.05
# By how much a part must grow where no channel's whole gap is smaller with the effect: what it makes worse elsewhere is
# as large as a part of less.
PLAIN = 2.0


@dataclass(frozen=True)
class Closing:
    """What an effect closes of the judged record: nats gained, the largest factor by which the gap of some part grows
    without it, that part in words (channel, kind of line or band), the signals (channel -> (N,)) without it, and the
    nats that the search lacked up to its limit, which are to be gained here besides, the optimum without it, and the
    `record` that tells where the judged one does not feel the effect. Where the rig is kept on the record's way, which
    is not its own, `own` are the signals without the effect as that rig goes (None elsewhere)."""

    gain: float
    growth: float
    part: Part
    without: Mapping[str, Array]
    lacking: float = 0.0
    optimum: Optimum | None = None
    record: str = ""
    own: Mapping[str, Array] | None = None

    @property
    def due(self) -> bool:
        """Whether the effect closes a part of the gap that the record can see."""
        return self.gain > GAIN + self.lacking and self.growth > DUE

    @property
    def open(self) -> bool:
        """Whether the record speaks neither for the effect nor against it; where it is likelier with it and yet worse
        on the whole, it speaks against it."""
        return not self.due and self.gain > -GAIN and (self.growth > 1.0 or self.gain < GAIN)


def free_closing(target: Target, without: Mapping[str, Array], with_all: Mapping[str, Array]) -> Closing:
    """What an effect closes by simulations that go their own way: some part of the gap, and of the whole as much. Where
    flanks part, one part or another is closer by chance."""
    closing = closing_of(target, without, with_all)
    lost, kept = (left_by(target, one) for one in (without, with_all))
    size = target.fluctuating * target.sizes / target.of_channels(target.energies(target.lines) * target.sizes)
    whole = float(np.sqrt((lost * size).sum() / max((np.maximum(kept, target.noise) * size).sum(), 1e-300)))
    return replace(closing, growth=min(closing.growth, whole))


def both(nudged: Closing, *free: Closing, steady: tuple[Part, float] | None = None) -> Closing:
    """What an effect closes by simulations that are `nudged`, if it does so too where nothing holds them on the
    record's way: by each, or by all that lie close, which are `steady` in one part and by how much they are at least;
    the signals are those of the `free` ones."""
    worst = min(free, key=lambda one: (one.due, one.gain))
    if worst.due:
        return replace(nudged, without=worst.without)
    if steady is not None and nudged.due:
        return replace(nudged, part=steady[0], growth=steady[1], without=worst.without)
    return replace(worst, gain=min(nudged.gain, worst.gain))


def feels(target: Target, without: Mapping[str, Array], with_all: Mapping[str, Array]) -> bool:
    """Whether a record can speak for or against an effect: some block's gap could grow by 5 % without it."""
    one, other = (target.gathered([signals]) for signals in (without, with_all))
    left = target.energies(target.lines - other) + target.noise
    return bool((target.energies(one - other) > FELT * left)[target.fluctuating].any())


def closing_of(target: Target, without: Mapping[str, Array], with_all: Mapping[str, Array]) -> Closing:
    """What an effect closes of a record, from the signals (channel -> (N,)) of the rigs without and with it."""
    rest, final = (target.lines - target.gathered([signals]) for signals in (without, with_all))
    lost, kept = target.energies(rest), target.energies(final)
    growth, part = growth_of(target, lost, kept)
    if growth < PLAIN:
        before, after = (target.of_channels(one * target.sizes) for one in (lost, kept))
        whole = float(np.sqrt((before / np.maximum(after, 1e-300)).max()))
        growth = growth if whole > 1.0 else min(growth, whole)
    return Closing(target.cost(rest) - target.cost(final), growth, part, without)


def left_by(target: Target, signals: Mapping[str, Array]) -> Array:
    """Energies (blocks,) that signals (channel -> (N,)) leave of a record."""
    return target.energies(target.lines - target.gathered([signals]))


def closed_parts(target: Target, without: Mapping[str, Array], with_all: Mapping[str, Array]) -> tuple[Part, ...]:
    """The parts of a gap that are larger in signals (channel -> (N,)) without an effect, as far as makes it due."""
    lost, kept = (left_by(target, one) for one in (without, with_all))
    return tuple(part for part, growth in growths_of(target, lost, kept).items() if growth > DUE)


def growth_of(target: Target, without: Array, with_all: Array) -> tuple[float, Part]:
    """The largest factor between the rms gaps without and with an effect (blocks,), over the parts of each channel that
    hold a visible part of the gap without it, and which part that is."""
    found = growths_of(target, without, with_all)
    part = max(found, key=found.__getitem__, default=("", ""))
    return found.get(part, 0.0), part


def growths_of(target: Target, without: Array, with_all: Array) -> dict[Part, float]:
    """That factor of each such part: a channel in one kind of line or band."""
    lost, kept = without * target.sizes, with_all * target.sizes
    noise = target.noise * target.sizes
    whole = target.of_channels(lost)
    out = {}
    for part, mine in parts_of(target).items():
        if float(lost[mine].sum()) < SEEN**2 * float(whole[mine][0]):
            continue
        least = max(float(kept[mine].sum()), float(noise[mine].sum()), 1e-300)
        out[part] = float(np.sqrt(lost[mine].sum() / least))
    return out


def parts_of(target: Target) -> dict[Part, NDArray[np.bool_]]:
    """Which blocks (blocks,), no means, belong to each part that a gap is told by: a channel in one kind of line, or in
    one band."""
    out: dict[Part, NDArray[np.bool_]] = {}
    for number in np.flatnonzero(target.fluctuating):
        block = target.blocks[number]
        for label in (block.kind, f"{block.band[0]:g}–{block.band[1]:g}"):
            out.setdefault((block.channel, label), np.zeros(len(target.blocks), dtype=bool))[number] = True
    return dict(sorted(out.items()))


def rms_closed(
    measured: Measurement, channel: str, without: Array, with_all: Array, top: int | None = None
) -> tuple[float, float, float]:
    """Rms (value, low, high) by which a channel's gap grows without an effect, with its 90 % interval: the lines of the
    difference of energies up to the line `top` (None: all), each counted as one draw."""
    real = measured_channels(measured)[channel].mean(axis=0)
    energy = (energy_of(real - without) - energy_of(real - with_all))[:top]
    total, spread = float(energy.sum()), 1.6449 * float(np.sqrt(0.5 * (energy**2).sum()))
    value, low, high = (float(np.sqrt(max(one, 0.0))) for one in (total, total - spread, total + spread))
    return value, low, high


def energy_of(values: Array) -> Array:
    """Energies of the lines of a signal (N,), without its mean."""
    energy = np.asarray(np.abs(np.fft.rfft(values) / values.size) ** 2, dtype=np.float64)
    energy[1 : (values.size + 1) // 2] *= 2
    return energy[1:]
