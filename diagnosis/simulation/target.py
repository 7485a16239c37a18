"""What a simulation is held against: the lines of all channels, in blocks whose misfit has a size of its own.

A block is one record, channel, kind of line (operating, excited, distorted, sideband of either shaft, other) and band.
What the excitation makes with itself where the mesh bends is told from what errors of teeth do: it is far larger.
With s^2 the noise of measured minus simulated (`passed_noise`) and the square of a hundredth of the level, below which
no model is right, and C the mean square of measured minus simulated, the block costs n log((s^2 + C) / s^2) nats: what
the discrepancy between rig and model is there is not known and has been maximised out. Neighbouring lines err alike: n
is at most 8, and of a shaft with many teeth half of these.

The mean of the transmission error is a block of its own where its channels' zeros are those of unloaded contact: a
late angle is behind all the time, which lines hardly show of the driven one. It is no part of a gap, which fluctuates.
A zero may be off in all records alike, which at one speed is a lag: the means count as one line for every speed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.covariance import KINDS, SHAFTS, kinds_of
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import bands, frequencies, has_both_y, measured_channels, noise_of_mean
from gearbench.diagnosis.simulation.sampled import sampled

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

FITTED = ("dte", "y_driver", "y_driven", "torque_driven")
INDEPENDENT = 8  # lines that a block counts as, at most
# Over the number of teeth: those that a block of a shaft's lines counts as, where that is more. Errors of teeth have as
# many numbers as there are teeth, and show in lines that are as independent as these.
BY_TEETH = 0.5
# Orders of the excitation whose products are lines of their own, as long as they are no more than this part of all.
PRODUCTS, FEW = (2, 3, 4, 5), 0.25
OTHER, DISTORTED, MEAN = "other", "distorted", "mean"
# Of the mean deflection under the load, what a rig's stiffness leaves unknown of it: fits to lines alone leave 0.03.
UNKNOWN = 0.05
# Of two speeds that a lag tells from a zero which is off, at least.
APART = 1.05
LEVEL = 1e-2  # part of the measured level below which no model is right
REACH = 1e-4  # part of the channel's whole fluctuation that leaks into any line
TINY = 1e-60


@dataclass(frozen=True)
class Block:
    """Where a block lies: record, channel, kind of line, band [Hz]."""

    record: str
    channel: str
    kind: str
    band: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Target:
    """Measured lines (K,) of all blocks in a row; `plan` says which: record, channel, line numbers. `of_line` (K,)
    their blocks; floors s^2, the noise in them, independent counts n and sizes (blocks,), the number of lines. Those of
    a large block are a sample (`sampled`): one that stands for several, a simulated one too, is the larger by its
    `gains` (K,), the root of how many."""

    measurements: tuple[Measurement, ...]
    plan: tuple[tuple[int, str, Integers], ...]
    lines: Complex
    of_line: Integers
    blocks: tuple[Block, ...]
    floors: Array
    noise: Array
    counts: Array
    sizes: Array
    gains: Array

    @cached_property
    def order(self) -> Integers:
        """Numbers (K,) of the lines, block after block."""
        return np.argsort(self.of_line, kind="stable")

    @cached_property
    def runs(self) -> tuple[slice, ...]:
        """Where the lines of each block lie in that order."""
        told = np.bincount(self.of_line, minlength=len(self.blocks))
        return tuple(slice(end - one, end) for end, one in zip(np.cumsum(told), told, strict=True))

    def gathered(self, channels: Sequence[Mapping[str, Array]]) -> Complex:
        """The same lines (K,) or (..., K) of simulated signals (..., N): by record, channel -> signal."""
        spectra = [_spectrum(channels[number][channel])[..., bins] for number, channel, bins in self.plan]
        return np.concatenate(spectra, axis=-1) * self.gains

    def of_record(self, number: int) -> Target:
        """What is measured in one record alone."""
        return self.of_records((number,))

    def of_records(self, numbers: Sequence[int]) -> Target:
        """What is measured in some records alone."""
        alone, place = self.of_lines(self.in_records(numbers)), {number: at for at, number in enumerate(numbers)}
        plan = tuple((place[number], channel, bins) for number, channel, bins in alone.plan)
        return replace(alone, measurements=tuple(self.measurements[number] for number in numbers), plan=plan)

    def in_records(self, numbers: Sequence[int]) -> Flags:
        """Which lines (K,) are in some records."""
        return np.concatenate([np.full(len(bins), number in numbers) for number, _, bins in self.plan])

    def of_lines(self, inside: Flags) -> Target:
        """Those of the lines (K,) that are `inside`."""
        flags = np.split(inside, np.cumsum([len(bins) for _, _, bins in self.plan])[:-1])
        chosen = ((*one[:2], one[2][mine]) for one, mine in zip(self.plan, flags, strict=True))
        blocks, of_line = np.unique(self.of_line[inside], return_inverse=True)
        return Target(
            self.measurements,
            tuple(one for one in chosen if len(one[2])),
            self.lines[inside],
            of_line,
            tuple(self.blocks[block] for block in blocks),
            self.floors[blocks],
            self.noise[blocks],
            self.counts[blocks],
            self.sizes[blocks],
            self.gains[inside],
        )

    def has(self, record: Measurement) -> bool:
        """Whether the lines are, among others, that record's."""
        return any(one is record for one in self.measurements)

    def energies(self, residual: Complex) -> Array:
        """C (blocks,) of a residual (K,)."""
        found = np.bincount(self.of_line, np.abs(residual) ** 2, len(self.floors))
        return np.asarray(found / self.sizes)

    @cached_property
    def fluctuating(self) -> Flags:
        """Which blocks (blocks,) are no means."""
        return np.array([block.kind != MEAN for block in self.blocks])

    def of_channels(self, values: Array) -> Array:
        """Sums of values (blocks,) over all blocks of each one's channel (blocks,) that fluctuate."""
        channels = np.array([block.channel for block in self.blocks])
        return np.array([values[self.fluctuating & (channels == one)].sum() for one in channels])

    def shares(self, residual: Complex) -> tuple[Array, Array]:
        """Of a residual (K,) by blocks (blocks,), for each one's channel: parts of its fluctuation that are left beyond
        noise, and that are noise."""
        parts = (self.energies(residual) - self.noise, self.noise, self.energies(self.lines))
        left, noise, whole = (self.of_channels(part * self.sizes) for part in parts)
        return np.sqrt(np.maximum(left, 0.0) / whole), np.sqrt(noise / whole)

    def nats(self, energies: Array) -> Array:
        """What mean squares (blocks,) cost a line [nats] (blocks,)."""
        return np.asarray(np.log1p(energies / self.floors))

    def cost(self, residual: Complex) -> float:
        """Nats that a residual costs."""
        return float(np.sum(self.counts * self.nats(self.energies(residual))))

    @cached_property
    def excited(self) -> Flags:
        """Which blocks (blocks,) answer the excitation."""
        return np.array([block.kind == "excited" for block in self.blocks])

    @cached_property
    def meant(self) -> tuple[Measurement, ...]:
        """The records whose mean transmission error is among the lines."""
        names = {block.record for block in self.blocks if block.kind == MEAN}
        return tuple(one for one in self.measurements if one.name in names)

    @property
    def excited_counts(self) -> Array:
        """Independent lines (blocks,) that answer the excitation; all but means where nothing is excited."""
        return np.where(self.excited if self.excited.any() else self.fluctuating, self.counts, 0.0)

    @property
    def most_excited(self) -> int:
        """Number of the record with the most excited lines."""
        names = list(dict.fromkeys(block.record for block in self.blocks))
        lines = np.zeros(len(names))
        for block, size, excited in zip(self.blocks, self.sizes, self.excited, strict=True):
            lines[names.index(block.record)] += size if excited else 0.0
        return int(np.argmax(lines))

    def excited_cost(self, residual: Complex) -> float:
        """Nats that a residual costs on the excited lines, or on all where nothing is excited."""
        return float(np.sum(self.excited_counts * self.nats(self.energies(residual))))


def target_of(
    measurements: Sequence[Measurement],
    conditions: Sequence[Condition],
    residual: Sequence[Mapping[str, Array]] | None = None,
) -> Target:
    """The lines of measurements, which have those conditions, up to the end of the excitation; `residual`: for each the
    parts (parts, N) of the noise that the channels' residuals have, that of their repetitions where not given."""
    pairs = list(zip(measurements, conditions, strict=True))
    meant = [one.zero_known and condition.rest_known for one, condition in pairs]
    different = _different([condition.pitch_speed for (_, condition), known in zip(pairs, meant, strict=True) if known])
    made, plan, before = list[_Channel](), list[tuple[int, str, Integers]](), 0
    for number, (one, condition) in enumerate(pairs):
        noises = residual[number] if residual is not None else {}
        kinds, frequency = with_products(condition), frequencies(one)[: condition.bins]
        parts = list(_parts(kinds, frequency, one))
        of_mean = different / sum(meant) if meant[number] else 0.0
        for name, repetitions in measured_channels(one).items():
            if name not in FITTED:
                continue
            channel = _channel(one, condition, parts, name, repetitions, noises.get(name), of_mean)
            made.append(replace(channel, of_line=channel.of_line + before))
            plan.append((number, name, channel.bins))
            before += len(channel.rows)
    rows = [row for channel in made for row in channel.rows]
    numbers = [(row.floor, row.noise, row.independent, row.size) for row in rows]
    floors, noise, counts, sizes = np.array(numbers, dtype=float).T
    return Target(
        tuple(measurements),
        tuple(plan),
        np.concatenate([channel.lines for channel in made]),
        np.concatenate([channel.of_line for channel in made]),
        tuple(row.block for row in rows),
        floors,
        noise,
        counts,
        sizes,
        np.concatenate([channel.gains for channel in made]),
    )


class _Part(NamedTuple):
    """A kind of lines of a record in a band [Hz], and which lines (K,) that are."""

    kind: str
    band: tuple[float, float]
    inside: Flags


class _Row(NamedTuple):
    """A block: where it lies, s^2, the noise in it, independent lines n and size."""

    block: Block
    floor: float
    noise: float
    independent: float
    size: int


@dataclass(frozen=True, eq=False)
class _Channel:
    """Of one channel of a record the numbers of the lines (K,), these lines, their blocks by number and gains."""

    bins: Integers
    lines: Complex
    of_line: Integers
    gains: Array
    rows: tuple[_Row, ...]


def _channel(
    one: Measurement, condition: Condition, parts: Sequence[_Part], name: str, repetitions: Array,
    residual: Array | None, of_mean: float,
) -> _Channel:  # fmt: skip
    """The lines of a channel with those repetitions (P, N) in the parts of its record, and noise that its `residual`
    (parts, N) has, if given; the mean of the transmission error among them if it counts, as `of_mean` lines."""
    spectrum = _spectrum(repetitions.mean(axis=0))[: condition.bins]
    noise = np.zeros(spectrum.size)
    if len(repetitions) > 1:
        rows_of_noise = residual if residual is not None else noise_of_mean(repetitions)
        noise = (np.abs(_spectrum(rows_of_noise)) ** 2).sum(axis=0)[: condition.bins]
    leak = REACH**2 * float(np.abs(spectrum[1:]).max() ** 2)
    of_line, gains, rows = np.full(spectrum.size, -1), np.ones(spectrum.size), list[_Row]()
    for kind, band, inside in parts:
        energies, at = np.abs(spectrum[inside]) ** 2, np.flatnonzero(inside)
        if kind == OTHER:
            told, gain = sampled(energies)
            of_line[at[told]], gains[at[told]] = len(rows), gain
        else:
            of_line[at] = len(rows)
        here = float(noise[inside].mean())
        floor = here + LEVEL**2 * float(np.mean(energies)) + leak + TINY
        count = min(_independent(kind, condition.teeth), at.size)
        rows.append(_Row(Block(one.name, name, kind, band), floor, here, count, at.size))
    if name == "dte" and of_mean > 0.0:
        of_line[0], here = len(rows), float(noise[0])
        floor = here + (UNKNOWN * _deflection(one, condition, spectrum)) ** 2 + TINY
        rows.append(_Row(Block(one.name, name, MEAN, (0.0, 0.0)), floor, here, of_mean, 1))
    kept = np.flatnonzero(of_line >= 0)
    return _Channel(kept, spectrum[kept] * gains[kept], of_line[kept], gains[kept], tuple(rows))


def _different(speeds: Sequence[float]) -> int:
    """How many of the speeds differ."""
    ordered = sorted(speeds)
    return len(ordered[:1]) + sum(after > APART * before for before, after in pairwise(ordered))


def _deflection(one: Measurement, condition: Condition, error: Complex) -> float:
    """Deflection [m] under the mean load: that of the mesh or, where the supports' displacement is left in it, the mean
    of the transmission `error` (K,), if that is more."""
    mesh = condition.force_level / condition.stiffness_level
    return mesh if has_both_y(one) else max(abs(float(error[0].real)), mesh)


def joined(first: Target, second: Target) -> Target:
    """The lines of both, those of the second behind."""
    before = len(first.measurements)
    plan = tuple((number + before, channel, bins) for number, channel, bins in second.plan)
    return Target(
        (*first.measurements, *second.measurements),
        (*first.plan, *plan),
        np.concatenate([first.lines, second.lines]),
        np.concatenate([first.of_line, second.of_line + len(first.blocks)]),
        (*first.blocks, *second.blocks),
        np.concatenate([first.floors, second.floors]),
        np.concatenate([first.noise, second.noise]),
        np.concatenate([first.counts, second.counts]),
        np.concatenate([first.sizes, second.sizes]),
        np.concatenate([first.gains, second.gains]),
    )


def with_products(condition: Condition) -> Integers:
    """Kind of every bin (K,), by its number among the `covariance.KINDS`, one past them for DISTORTED.

    A mesh that bends makes sums and differences of excited lines, and of these and its own orders: all are alike modulo
    the cycles of a repetition.
    """
    kinds, cycles = kinds_of(condition), condition.cycles
    excited = np.unique(np.flatnonzero(kinds == KINDS.index("excited")) % cycles)
    signed = np.unique(np.concatenate([excited, -excited]) % cycles)
    found, order = np.zeros(cycles, dtype=bool), signed
    for _ in PRODUCTS:
        order = np.unique((order[:, None] + signed) % cycles)
        wider = found.copy()
        wider[order] = True
        if wider.sum() > FEW * cycles:
            break
        found = wider
    strong = np.isin(kinds, [KINDS.index("operating"), KINDS.index("excited")])
    return np.where(found[np.arange(len(kinds)) % cycles] & ~strong, len(KINDS), kinds)


def _independent(kind: str, teeth: Sequence[int]) -> int:
    """How many lines of a kind a block counts as at most."""
    if kind not in SHAFTS:
        return INDEPENDENT
    return max(INDEPENDENT, round(BY_TEETH * teeth[SHAFTS.index(kind)]))


def _parts(
    kinds: Integers, frequency: Array, one: Measurement
) -> Iterator[_Part]:
    """Kind, band and flags of every block of a record; the mean is in none of these."""
    for number, kind in enumerate((*KINDS, DISTORTED)):
        for low, high in bands(one):
            inside = (kinds == number) & (frequency > low * (1 + 1e-12)) & (frequency <= high * (1 + 1e-12))
            if inside.any():
                yield _Part(kind, (low, high), inside)


def _spectrum(values: Array) -> Complex:
    spectrum: Complex = np.fft.rfft(values, axis=-1) / values.shape[-1]
    return spectrum
