"""What the non-linear mesh reads at every half step: phase, excess material, gain, ripple.

Tooth numbers, mesh phase and shaft angles are those of the steady rotation; the tables hold one stretch of it. Filled
by a compiled loop, since diagnosis fills them again for every trial of an effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, floor, pi, sin

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import compiled
from gearbench.lumped.nonlinear.model import NonLinear

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns of the table.
POSITION, EXCESS, EXCESS_RATE, GAIN, RIPPLE, BACK = range(6)
COLUMNS = 6


@dataclass(frozen=True)
class Motion:
    """Steady rotation on the half-step grid: entry n has mesh phase first_phase + cycles n / entries [cycles].

    The table is made for entries + 1 instants; `step` [s] is the whole integration step, two entries.
    """

    cycles: float
    entries: int
    step: float
    first_phase: float = 0.0

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz]."""
        return self.cycles / (self.entries * 0.5 * self.step)


@dataclass(frozen=True)
class Teeth:
    """What differs from tooth to tooth: excess1 (z1,), excess2 (z2,) [m]; growth1, growth2: growth of the teeth's
    bending compliance."""

    excess1: Array
    excess2: Array
    growth1: Array
    growth2: Array


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


def tables(model: NonLinear, motion: Motion) -> Array:
    """Table (entries + 1, COLUMNS): row of the force table; excess a [m] and a' [m/s]; gain of the force; ripple [N];
    excess on the back flanks [m]."""
    rig, law = model.rig, model.law
    share, bending = law.closed
    series = _series(rig.mesh.stiffness_cos, rig.mesh.stiffness_sin)
    errors = _series(rig.mesh.error_cos, rig.mesh.error_sin)
    # Run-out moves whole gears, and the normals of working and back flanks are pi - 2 alpha_w apart: by so much of its
    # rotation the driver's back flanks are earlier, those of the driven gear, which turns the other way, later.
    turn = pi - 2 * model.working_pressure_angle
    gears = ((rig.driver, turn), (rig.driven, -turn))
    runout = np.array([[g.runout / 2, g.runout_phase, g.runout_phase - t] for g, t in gears])
    ripple = rig.drive.ripple
    waves = np.zeros((0, 3))
    if ripple is not None:
        size = np.array(ripple.amplitude) / model.base_radii[0]
        waves = np.column_stack([np.array(ripple.orders) / rig.driver.teeth, size, ripple.phase])
    # One entry before and one behind, for the rate of the excess.
    out = np.empty((motion.entries + 3, COLUMNS))
    step = motion.cycles / motion.entries
    base = np.array([rig.mesh.stiffness_scale, rig.mesh.error_mean])
    teeth = teeth_of(model)
    _fill(
        out, motion.first_phase, step, law.offsets, share, bending,
        teeth.excess1, teeth.excess2, teeth.growth1, teeth.growth2, base, series, errors, runout, waves,
    )  # fmt: skip
    rate = (out[2:, EXCESS] - out[:-2, EXCESS]) / motion.step
    out = out[1:-1]
    out[:, EXCESS_RATE] = rate
    return np.ascontiguousarray(out)


def _series(cosines: tuple[float, ...], sines: tuple[float, ...]) -> Array:
    """Amplitudes (orders, 2) of mesh orders 1, 2, ..."""
    return np.array([cosines, sines], dtype=float).reshape(2, -1).T.copy()


@compiled
def _wave(series: Array, phase: float) -> float:
    """Sum of a series in mesh orders at a phase [cycles]."""
    total = 0.0
    for n in range(series.shape[0]):
        angle = 2 * pi * (n + 1) * phase
        total += series[n, 0] * cos(angle) + series[n, 1] * sin(angle)
    return total


@compiled
def _fill(
    out: Array, first_phase: float, step: float, offsets: Integers, share: Array, bending: Array,
    excess1: Array, excess2: Array, growth1: Array, growth2: Array, base: Array, series: Array, errors: Array,
    runout: Array, waves: Array,
) -> None:  # fmt: skip
    """Fill the table; entry n belongs to the phase first_phase + (n - 1) step."""
    rows = share.shape[0] - 1
    z1, z2 = len(excess1), len(excess2)
    for n in range(out.shape[0]):
        phase = first_phase + (n - 1) * step
        whole = floor(phase)
        cycle = phase - whole
        position = min(cycle * rows, rows * (1.0 - 1e-16))
        row = int(position)
        weight = position - row
        excess, softness = 0.0, 0.0
        for o in range(len(offsets)):
            part = share[row, o] + weight * (share[row + 1, o] - share[row, o])
            if part == 0.0:
                continue
            tooth = int(whole) + offsets[o]
            one, two = tooth % z1, tooth % z2
            excess += part * (excess1[one] + excess2[two])
            if growth1[one] != 0.0 or growth2[two] != 0.0:
                b1 = bending[row, o, 0] + weight * (bending[row + 1, o, 0] - bending[row, o, 0])
                b2 = bending[row, o, 1] + weight * (bending[row + 1, o, 1] - bending[row, o, 1])
                grown = b1 * growth1[one] + b2 * growth2[two]
                softness += part * grown / (1.0 + grown)
        turned, turned_back = 0.0, 0.0
        for i in range(2):
            if runout[i, 0] != 0.0:
                angle = 2 * pi * phase / (z1 if i == 0 else z2)
                turned += runout[i, 0] * cos(angle - runout[i, 1])
                turned_back += runout[i, 0] * cos(angle - runout[i, 2])
        every = base[1] + _wave(errors, cycle) + turned
        ripple = 0.0
        for i in range(waves.shape[0]):
            ripple += waves[i, 1] * cos(2 * pi * waves[i, 0] * phase + waves[i, 2])
        out[n, POSITION] = position
        out[n, EXCESS] = excess + every
        out[n, GAIN] = base[0] * (1.0 + _wave(series, cycle)) * (1.0 - softness)
        out[n, RIPPLE] = ripple
        out[n, BACK] = turned_back
