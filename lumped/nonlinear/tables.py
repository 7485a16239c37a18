"""What the non-linear mesh reads at every half step: phase, excess material, gain, ripple.

Tooth numbers, mesh phase and shaft angles are those of the nominal rotation; the tables hold one stretch of it. Filled
by a compiled loop, since diagnosis fills them again for every trial of an effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, floor, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import compiled
from gearbench.lumped.nonlinear.ends import Ends, ends_of
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.pressing import Instants, alike
from gearbench.lumped.nonlinear.reading import over_pairs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


ANEW = 64  # entries between which a wave is turned on: 1e-14 of it
NEXT = 0.02  # angle [rad] up to which the series of sine and cosine are exact to rounding


class Table(NamedTuple):
    """What the mesh is at each half step; arrays (entries + 1,), pace and pull empty where the speed is constant, and
    levers where no gear runs out.

    excess, its rate and gain are common to all pairs. Pair o of an entry has row first_pair + o of `own` besides, which
    is empty where all teeth are alike; else it holds a pair more at either end, for a mesh that is turned into the
    cycle before or behind an entry's.
    """

    position: Array  # in rows of the force table, which are phases
    excess: Array  # a [m]
    excess_rate: Array  # a' [m/s]
    gain: Array  # of the force
    ripple: Array  # [N]
    back: Array  # excess on the back flanks [m]
    first_pair: Array  # whole numbers
    own: Array  # (pairs, 3): excess [m], growths of the bending compliance of both teeth
    pace: Array = np.empty(0)  # speed of the nominal rotation over the one that friction is told of
    pull: Array = np.empty(0)  # acceleration of the nominal rotation along the line of action [m/s^2]
    # (entries + 1, 3): by what part both gears' levers about their axes are longer than their base radii, and by what
    # angle [rad] the line of action has turned against the driven gear.
    levers: Array = np.empty((0, 3))
    led: Array = np.empty(0)  # velocity [m/s] that the driver is nudged towards; empty where it is not

    def part(self, first: int | None, end: int | None = None) -> Table:
        """The entries from `first` to before `end`."""
        return Table(*(column if name == "own" else column[first:end] for name, column in self._asdict().items()))


class Series(NamedTuple):
    """Amplitudes (orders,) of a series in mesh orders 1, 2, ..."""

    cosine: Array
    sine: Array


class Runout(NamedTuple):
    """Of driver and driven gear (2,): what working and back flanks stand proud by [m], as factors of cosine and sine of
    the gear's nominal rotation, and base radii [m]; the line of action's length [m]."""

    cosine: Array
    sine: Array
    cosine_back: Array
    sine_back: Array
    radius: Array
    line: float


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


def instants(model: NonLinear, table: Table, end: int | None = None) -> Instants:
    """The mesh at the table's entries to before `end`."""
    at = table.position[:end] / model.law.phases
    if not table.own.size:
        return alike(at, table.excess[:end], table.gain[:end], table.back[:end])
    columns = len(model.law.offsets)
    own = table.own[table.first_pair[:end].astype(np.int64)[:, None] + np.arange(columns)]
    softer = over_pairs(model.law.bending_of(at) * own[..., 1:])
    return Instants(
        at, table.excess[:end], table.gain[:end], table.back[:end], own[..., 0], 1.0 / (1.0 + softer)
    )


def tables(model: NonLinear, motion: Motion) -> Table:
    """The table of a model in a motion."""
    rig, law = model.rig, model.law
    mesh = rig.mesh
    correction = Correction(
        mesh.stiffness_scale,
        _series(mesh.stiffness_cos, mesh.stiffness_sin),
        mesh.error_mean + law.lead,
        _series(mesh.error_cos, mesh.error_sin),
    )
    varied = motion.varied
    if varied is None:
        phase = motion.first_phase + np.arange(-1.0, motion.entries + 2) * (motion.cycles / motion.entries)
    else:
        phase = varied.phase
    # One entry before and one behind, for the rate of the excess.
    position, excess, rate, gain, ripple, back, first = np.empty((7, motion.entries + 3))
    runs_out = any(gear.runout for gear in (rig.driver, rig.driven))
    levers = np.empty((len(phase) if runs_out else 0, 3))
    table = Table(position, excess, rate, gain, ripple, back, first, _own(model, phase), levers=levers)
    teeth = rig.driver.teeth, rig.driven.teeth
    fixed = correction, _runout(model), ends_of(model), _waves(model)
    _fill(table, phase, floor(phase[0]), law.phases, teeth, *fixed)
    rate[1:-1] = (excess[2:] - excess[:-2]) / motion.step
    pace, pull = (np.empty(0), np.empty(0)) if varied is None else varied[1:]
    return table.part(1, -1)._replace(pace=pace, pull=pull)


def _own(model: NonLinear, phase: Array) -> Array:
    """What pairs have of their own (pairs, 3), from the one before the first that is near contact at the first phase
    [cycles] on."""
    teeth, offsets = teeth_of(model), model.law.offsets
    if not teeth.differ:
        return np.empty((0, 3))
    number = np.arange(floor(phase[0]) + offsets[0] - 1, floor(phase[-1]) + offsets[-1] + 2)
    one, two = number % len(teeth.excess1), number % len(teeth.excess2)
    return np.stack([teeth.excess1[one] + teeth.excess2[two], teeth.growth1[one], teeth.growth2[two]], axis=1)


def _runout(model: NonLinear) -> Runout:
    """Run-out moves whole gears, and the normals of working and back flanks are pi - 2 alpha_w apart: by so much of its
    rotation the driver's back flanks are earlier, those of the driven gear, which turns the other way, later."""
    gears, turn = (model.rig.driver, model.rig.driven), pi - 2 * model.working_pressure_angle
    size = np.array([gear.runout / 2 for gear in gears])
    phase = np.array([gear.runout_phase for gear in gears])
    back = phase - np.array([turn, -turn])
    parts = size * np.cos(phase), size * np.sin(phase), size * np.cos(back), size * np.sin(back)
    return Runout(*parts, np.array(model.base_radii), model.length_of_action)


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
def _towards_end(cycle: float, ends: Ends) -> float:
    """How near [0 to 1] the phase in the cycle is to the end of contact, 0 being its beginning."""
    since = cycle - ends.begin
    if since < 0.0:
        since += 1.0
    return since / ends.span if since < ends.span else (1.0 - since) / (1.0 - ends.span)


@compiled(inline="always")
def _rotated(cosine: float, sine: float, angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle that is larger by at most NEXT."""
    square = angle * angle
    onward = 1.0 - square * (1 / 2 - square * (1 / 24 - square / 720))
    aslant = angle * (1.0 - square * (1 / 6 - square * (1 / 120 - square / 5040)))
    return cosine * onward - sine * aslant, sine * onward + cosine * aslant


@compiled(inline="always")
def _rippled(waves: Waves, phase: float, cosine: float, sine: float) -> float:
    """Force [N] of the torque's ripple at a phase [cycles] where the first wave has that cosine and sine."""
    total, real, imaginary = 0.0, cosine, sine
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
    out: Table, phases: Array, begin: int, rows: int, teeth: tuple[int, int],
    correction: Correction, runout: Runout, ends: Ends, waves: Waves,
) -> None:  # fmt: skip
    """Fill the table but for `excess_rate`, own, pace and pull; entry n belongs to the n-th of `phases` [cycles], whose
    whole part begins with `begin`; rows: of the force table. A lever about a gear's axis is the base radius and how far
    its centre stands aside of the normal through that axis."""
    runs_out = runout.cosine**2 + runout.sine**2 > 0.0
    # Mesh, driver, driven gear and the ripple's first wave: whether they turn, how often in a mesh cycle, and how far.
    turns = np.array([
        len(correction.error.cosine) > 0 or len(correction.stiffness.cosine) > 0, runs_out[0], runs_out[1],
        len(waves.order) > 0,
    ])  # fmt: skip
    speeds = 2 * pi * np.array([1.0, 1.0 / teeth[0], 1.0 / teeth[1], waves.order[0] if turns[3] else 0.0])
    real, imaginary = np.ones(4), np.zeros(4)
    for n in range(len(out.position)):
        phase = phases[n]
        whole = floor(phase)
        cycle = phase - whole
        for k in range(4):
            if not turns[k]:
                continue
            step = speeds[k] * (phase - phases[n - 1]) if n % ANEW else 1.0
            if abs(step) > NEXT:
                angle = speeds[k] * (phase if k > 0 else cycle)
                real[k], imaginary[k] = cos(angle), sin(angle)
            else:
                real[k], imaginary[k] = _rotated(real[k], imaginary[k], step)
        turned, turned_back, leant = 0.0, 0.0, 0.0
        for i in range(2):
            if runs_out[i]:
                along, across = real[i + 1], imaginary[i + 1]
                turned += runout.cosine[i] * along + runout.sine[i] * across
                turned_back += runout.cosine_back[i] * along + runout.sine_back[i] * across
                aside = (2 * i - 1) * (runout.cosine[i] * across - runout.sine[i] * along)
                leant += aside
                out.levers[n, i] = aside / runout.radius[i]
            elif len(out.levers) > 0:
                out.levers[n, i] = 0.0
        if len(out.levers) > 0:
            out.levers[n, 2] = leant / runout.line
        every = correction.mean_error + _wave(correction.error, real[0], imaginary[0]) + turned
        place = cycle
        if turned != 0.0 or leant != 0.0:
            near = _towards_end(cycle, ends)
            place += near * ends.proud * turned
            place += (ends.leant_begin + near * (ends.leant_end - ends.leant_begin)) * leant
            ahead = floor(place)
            place, whole = place - ahead, whole + ahead
        out.position[n] = min(place * rows, rows * (1.0 - 1e-16))
        out.first_pair[n] = whole - begin + 1
        out.excess[n] = every
        out.gain[n] = correction.scale * (1.0 + _wave(correction.stiffness, real[0], imaginary[0]))
        out.ripple[n] = _rippled(waves, phase, real[3], imaginary[3])
        out.back[n] = turned_back
