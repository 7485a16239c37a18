"""What the non-linear mesh reads at every half step: phase, excess material, gain, ripple.

Tooth numbers, mesh phase and shaft angles are those of the nominal rotation; the tables hold one stretch of it. Filled
by a compiled loop, since diagnosis fills them again for every trial of an effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, floor, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.kernels.compiled import compiled
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.pressing import Instants

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Table(NamedTuple):
    """What the mesh is at each half step; arrays (entries + 1,), pace and pull empty where the speed is constant.

    What pairs have of their own lies in pair_excess and pair_gain (entries + 1, n_o), without columns where all teeth
    are alike; excess, its rate and gain are common to all pairs.
    """

    position: Array  # in rows of the force table, which are phases
    excess: Array  # a [m]
    excess_rate: Array  # a' [m/s]
    gain: Array  # of the force
    ripple: Array  # [N]
    back: Array  # excess on the back flanks [m]
    pair_excess: Array
    pair_gain: Array
    pace: Array = np.empty(0)  # speed of the nominal rotation over the one that friction is told of
    pull: Array = np.empty(0)  # acceleration of the nominal rotation along the line of action [m/s^2]


class Series(NamedTuple):
    """Amplitudes (orders,) of a series in mesh orders 1, 2, ..."""

    cosine: Array
    sine: Array


class Runout(NamedTuple):
    """Of driver and driven gear (2,): what working and back flanks stand proud by [m], as factors of cosine and sine of
    the gear's nominal rotation."""

    cosine: Array
    sine: Array
    cosine_back: Array
    sine_back: Array


class Waves(NamedTuple):
    """Torque ripple (waves,): orders in mesh cycles, force on the driver's base circle [N] as factors of cosine and
    sine; `in_turn`: whether the orders are 1, 2, 3, ... times the first."""

    order: Array
    cosine: Array
    sine: Array
    in_turn: bool


class Correction(NamedTuple):
    """What is common to all pairs: scale and series of the stiffness, mean [m] and series [m] of the error."""

    scale: float
    stiffness: Series
    mean_error: float
    error: Series


class Varied(NamedTuple):
    """A rotation whose speed changes: mesh phase [cycles] at the entries, one before and one behind them included
    (entries + 3,); pace and pull (entries + 1,) as in `Table`."""

    phase: Array
    pace: Array
    pull: Array


@dataclass(frozen=True)
class Motion:
    """Steady rotation on the half-step grid: entry n has mesh phase first_phase + cycles n / entries [cycles].

    The table is made for entries + 1 instants; `step` [s] is the whole integration step, two entries. `varied`: the
    rotation where its speed changes, in place of that phase.
    """

    cycles: float
    entries: int
    step: float
    first_phase: float = 0.0
    varied: Varied | None = None

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz]."""
        return self.cycles / (self.entries * 0.5 * self.step)


class Teeth(NamedTuple):
    """What differs from tooth to tooth: excess1 (z1,), excess2 (z2,) [m]; growth1, growth2: growth of the teeth's
    bending compliance."""

    excess1: Array
    excess2: Array
    growth1: Array
    growth2: Array

    @property
    def differ(self) -> bool:
        """Whether there is anything that not all teeth of a gear have."""
        return any(bool(values.any()) for values in self)


def teeth_of(model: NonLinear) -> Teeth:
    """Errors and cracks of all teeth."""
    excess, growth = [], []
    for gear in (model.rig.driver, model.rig.driven):
        errors = np.array(gear.pitch_error, dtype=float)
        excess.append(errors if errors.size else np.zeros(gear.teeth))
        grows = np.zeros(gear.teeth)
        if gear.crack is not None:
            grows[gear.crack.tooth] = 1.0 / (1.0 - gear.crack.stiffness_loss) - 1.0
        growth.append(grows)
    return Teeth(excess[0], excess[1], growth[0], growth[1])


def instants(table: Table, phase: ArrayLike, first: int = 0, end: int | None = None) -> Instants:
    """The mesh at the table's entries from `first` to before `end`; phase [cycles] of each."""
    columns = (table.excess, table.gain, table.pair_excess, table.pair_gain)
    return Instants(np.atleast_1d(np.asarray(phase, dtype=float)), *(column[first:end] for column in columns))


def tables(model: NonLinear, motion: Motion) -> Table:
    """The table of a model in a motion."""
    rig, law = model.rig, model.law
    bending, teeth, mesh = law.closed[1], teeth_of(model), rig.mesh
    correction = Correction(
        mesh.stiffness_scale,
        _series(mesh.stiffness_cos, mesh.stiffness_sin),
        mesh.error_mean,
        _series(mesh.error_cos, mesh.error_sin),
    )
    # One entry before and one behind, for the rate of the excess.
    entries, columns = motion.entries + 3, len(law.offsets) if teeth.differ else 0
    common, own = np.empty((6, entries)), np.empty((2, entries, columns))
    table = Table(*common, *own)
    varied = motion.varied
    if varied is None:
        phase = motion.first_phase + np.arange(-1.0, motion.entries + 2) * (motion.cycles / motion.entries)
    else:
        phase = varied.phase
    _fill(table, phase, law.offsets, bending, teeth, correction, _runout(model), _waves(model))
    rate = (table.excess[2:] - table.excess[:-2]) / motion.step
    pace, pull = (np.empty(0), np.empty(0)) if varied is None else varied[1:]
    inner = Table(*(column[1:-1] for column in table))
    return inner._replace(excess_rate=rate, pace=pace, pull=pull)


def _runout(model: NonLinear) -> Runout:
    """Run-out moves whole gears, and the normals of working and back flanks are pi - 2 alpha_w apart: by so much of its
    rotation the driver's back flanks are earlier, those of the driven gear, which turns the other way, later."""
    gears, turn = (model.rig.driver, model.rig.driven), pi - 2 * model.working_pressure_angle
    size = np.array([gear.runout / 2 for gear in gears])
    phase = np.array([gear.runout_phase for gear in gears])
    back = phase - np.array([turn, -turn])
    return Runout(size * np.cos(phase), size * np.sin(phase), size * np.cos(back), size * np.sin(back))


def _waves(model: NonLinear) -> Waves:
    ripple = model.rig.drive.ripple
    if ripple is None:
        return Waves(np.zeros(0), np.zeros(0), np.zeros(0), True)
    in_turn = all(order == (n + 1) * ripple.orders[0] for n, order in enumerate(ripple.orders))
    force, phase = np.array(ripple.amplitude) / model.base_radii[0], np.array(ripple.phase, dtype=float)
    order = np.array(ripple.orders) / model.rig.driver.teeth
    return Waves(order, force * np.cos(phase), -force * np.sin(phase), in_turn)


def _series(cosines: tuple[float, ...], sines: tuple[float, ...]) -> Series:
    return Series(np.array(cosines, dtype=float), np.array(sines, dtype=float))


@compiled(inline="always")  # a call would count references to the arrays
def _wave(series: Series, cosine: float, sine: float) -> float:
    """Sum of a series in mesh orders where the first has that cosine and sine; the next ones follow by turning on."""
    total, real, imaginary = 0.0, 1.0, 0.0
    for n in range(len(series.cosine)):
        real, imaginary = real * cosine - imaginary * sine, real * sine + imaginary * cosine
        total += series.cosine[n] * real + series.sine[n] * imaginary
    return total


@compiled(inline="always")
def _rippled(waves: Waves, phase: float) -> float:
    """Force [N] of the torque's ripple at a phase [cycles]."""
    total = 0.0
    if len(waves.order) == 0:
        return total
    angle = 2 * pi * waves.order[0] * phase
    cosine, sine = cos(angle), sin(angle)
    real, imaginary = cosine, sine
    for i in range(len(waves.order)):
        if i > 0 and waves.in_turn:
            real, imaginary = real * cosine - imaginary * sine, real * sine + imaginary * cosine
        elif i > 0:
            angle = 2 * pi * waves.order[i] * phase
            real, imaginary = cos(angle), sin(angle)
        total += waves.cosine[i] * real + waves.sine[i] * imaginary
    return total


@compiled
def _fill(
    out: Table, phases: Array, offsets: Integers, bending: Array, teeth: Teeth, correction: Correction,
    runout: Runout, waves: Waves,
) -> None:  # fmt: skip
    """Fill the table but for `excess_rate`, pace and pull; entry n belongs to the n-th of `phases` [cycles]."""
    rows = bending.shape[0] - 1
    z1, z2 = len(teeth.excess1), len(teeth.excess2)
    for n in range(len(out.position)):
        phase = phases[n]
        whole = floor(phase)
        cycle = phase - whole
        position = min(cycle * rows, rows * (1.0 - 1e-16))
        row = int(position)
        weight = position - row
        for o in range(out.pair_excess.shape[1]):
            tooth = int(whole) + offsets[o]
            one, two = tooth % z1, tooth % z2
            out.pair_excess[n, o] = teeth.excess1[one] + teeth.excess2[two]
            out.pair_gain[n, o] = 1.0
            if teeth.growth1[one] != 0.0 or teeth.growth2[two] != 0.0:
                b1 = bending[row, o, 0] + weight * (bending[row + 1, o, 0] - bending[row, o, 0])
                b2 = bending[row, o, 1] + weight * (bending[row + 1, o, 1] - bending[row, o, 1])
                out.pair_gain[n, o] = 1.0 / (1.0 + b1 * teeth.growth1[one] + b2 * teeth.growth2[two])
        turned, turned_back = 0.0, 0.0
        for i in range(2):
            if runout.cosine[i] != 0.0 or runout.sine[i] != 0.0:
                angle = 2 * pi * phase / (z1 if i == 0 else z2)
                along, across = cos(angle), sin(angle)
                turned += runout.cosine[i] * along + runout.sine[i] * across
                turned_back += runout.cosine_back[i] * along + runout.sine_back[i] * across
        first, second = 1.0, 0.0
        if len(correction.error.cosine) or len(correction.stiffness.cosine):
            first, second = cos(2 * pi * cycle), sin(2 * pi * cycle)
        every = correction.mean_error + _wave(correction.error, first, second) + turned
        out.position[n] = position
        out.excess[n] = every
        out.gain[n] = correction.scale * (1.0 + _wave(correction.stiffness, first, second))
        out.ripple[n] = _rippled(waves, phase)
        out.back[n] = turned_back
