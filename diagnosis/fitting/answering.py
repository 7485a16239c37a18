"""How a rig answers whatever force acts in its mesh, and what of a record no such force explains.

At one frequency the force F in the mesh and the torque T of the drive move a linear rig by

    q = Z^-1 (-d F + e T / rb1),    Z = K + j w C - w^2 M    without the mesh,

d being what each coordinate contributes to the transmission error. F is one number a line: what it explains of driver,
displacements and reaction together is taken out. Of the derivatives, dq = -Z^-1 dZ q and what sensors do follow by
hand; how K, C and M follow from unknowns is the difference between two rigs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.sensor_delay import KEYS as DELAYS
from gearbench.diagnosis.forces.condition import Condition, force_at_load
from gearbench.diagnosis.forces.covariance import KINDS, kinds_of
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.structure.layout import Layout, around_mesh
from gearbench.diagnosis.structure.structure import GAIN
from gearbench.lumped.nonlinear.coordinates import COORDINATES

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

# Channels that a coordinate each, or a few, make; the reaction is the force itself.
MOVED = ("angle_driver", "y_driver", "y_driven")
REACTION = "torque_driven"
SMOOTHED = 12  # parts of the band over which the level is taken
APART = 1e-5  # of its standard deviation, by which an unknown is moved for a derivative


@dataclass(frozen=True)
class Lines:
    """Lines of records: omega (K,), channels (K, C) with variances of noise (K, C) and levels (K, C), torque (K,)."""

    names: tuple[str, ...]
    omega: Array
    channels: Complex
    torque: Complex
    noise: Array
    level: Array


class System(NamedTuple):
    """A rig without its mesh: numbers of its free coordinates, springs, dampers and masses between them, what forces of
    the mesh and of the drive do (n, 2), what each contributes to a channel (n,) by its name, the gain of the reaction's
    sensor, and delays of the others by channel [s]."""

    free: Integers
    springs: Array
    dampers: Array
    mass: Array
    forces: Array
    shown: Mapping[str, Array]
    gain: float
    late: Mapping[str, float]


class Slope(NamedTuple):
    """Derivatives of a `System` by one unknown, but for coordinates and forces, which stay."""

    springs: Array
    dampers: Array
    mass: Array
    shown: Mapping[str, Array]
    gain: float
    late: Mapping[str, float]


class _Seen(NamedTuple):
    """Lines at one level: weight of each (K, C), direction of the mesh's force (K, C), of length one, its `size`
    (K, 1), what no drive explains (K, C), and the part of that along the direction (K, 1)."""

    weight: Array
    along: Complex
    size: Array
    seen: Complex
    part: Complex

    @property
    def left(self) -> Complex:
        """What no force in the mesh explains (K * C,)."""
        return (self.seen - self.along * self.part).ravel()


def left_over(layout: Layout, system: System, lines: Lines, levels: Sequence[float]) -> list[Complex]:
    """What no force in the mesh explains of the channels (K * C,), over their noise and each of these parts of their
    level."""
    answer = _answers(layout, system, lines, _moved(system, lines))
    return [_seen(layout, lines, answer, level).left for level in levels]


def left_over_moved(
    layout: Layout, system: System, slopes: Sequence[Slope], lines: Lines, level: float
) -> tuple[Complex, Complex]:
    """`left_over` at one level and its derivatives (slopes, K * C)."""
    moved = _moved(system, lines)
    answer = _answers(layout, system, lines, moved)
    here = _seen(layout, lines, answer, level)
    weight, along, size, seen, part = here
    change = _changes(layout, system, slopes, lines, moved, answer)
    d_along = change[..., 0] * weight
    d_seen = -change[..., 1] * _driven(layout, lines) * weight
    d_along -= along * (along.conj() * d_along).real.sum(axis=2, keepdims=True)
    d_along /= size
    d_part = (d_along.conj() * seen + along.conj() * d_seen).sum(axis=2, keepdims=True)
    return here.left, (d_seen - d_along * part - along * d_part).reshape(len(slopes), -1)


def _driven(layout: Layout, lines: Lines) -> Complex:
    """Force (K, 1) [N] of the drive at the base circle."""
    return (lines.torque / layout.model.base_radius[0])[:, None]


def _seen(layout: Layout, lines: Lines, answer: Complex, level: float) -> _Seen:
    """The lines beside the channels `answer` (K, C, 2)."""
    weight = 1.0 / np.sqrt(lines.noise + level**2 * lines.level)
    along, seen = answer[:, :, 0] * weight, (lines.channels - answer[:, :, 1] * _driven(layout, lines)) * weight
    size = np.linalg.norm(along, axis=1, keepdims=True)
    along /= size
    return _Seen(weight, along, size, seen, (along.conj() * seen).sum(axis=1, keepdims=True))


def system_of(layout: Layout, p: Array) -> System:
    """The rig of unknowns (size,) without its mesh. Raises ValueError for values that no rig may have."""
    # The model's time loop is compiled on import, which not every user of this module wants.
    from gearbench.lumped.nonlinear.model import nonlinear_model
    from gearbench.lumped.nonlinear.rest import inverse_masses, mesh_direction, springs_and_dampers

    model = nonlinear_model(around_mesh(layout, p), layout.meshing, layout.model.law)
    c, s = model.constants(), model.structure
    springs, dampers = springs_and_dampers(c, s, (c.stiffness1, c.stiffness2))
    inverse, mesh = inverse_masses(c, s), mesh_direction(c, s)
    free = np.flatnonzero(inverse > 0.0)
    inside = np.ix_(free, free)
    forces = np.zeros((len(free), 2))
    forces[:, 0] = -mesh[free]
    forces[np.flatnonzero(free == (0 if c.rigid else COORDINATES - 1)), 1] = 1.0
    rows = dict(zip(MOVED, (np.eye(len(inverse))[0], *model.displacements), strict=True))
    gain, late = _sensors(layout, p)
    return System(free, springs[inside], dampers[inside], np.diag(1.0 / inverse[free]), forces,
                  {name: row[free] for name, row in rows.items()}, gain, late)  # fmt: skip


def slopes_of(layout: Layout, p: Array, here: System, at: Integers, sd: Array) -> list[Slope]:
    """Derivatives of the rig `here` of unknowns `p` (size,) by those at `at` (n,), whose standard deviations are `sd`
    (n,)."""
    low, high = layout.unknowns.bounds()
    sensors = [layout.unknowns[key].start for key in (GAIN, *DELAYS.values())]
    out = []
    for index, width in zip(at, sd, strict=True):
        trial, step = p.copy(), APART * float(width)
        if p[index] + step > high[index]:
            step = -step
        trial[index] = np.clip(p[index] + step, low[index], high[index])
        gain, late = _sensors(layout, trial)
        there = here if index in sensors else system_of(layout, trial)
        if len(there.free) != len(here.free):  # what has no effect at all as yet
            there = here
        out.append(
            Slope(
                (there.springs - here.springs) / step,
                (there.dampers - here.dampers) / step,
                (there.mass - here.mass) / step,
                {name: (row - here.shown[name]) / step for name, row in there.shown.items()},
                (gain - here.gain) / step,
                {name: (value - here.late[name]) / step for name, value in late.items()},
            )
        )
    return out


def _sensors(layout: Layout, p: Array) -> tuple[float, dict[str, float]]:
    """Gain of the reaction's sensor and delays of the others by channel [s]."""
    gain = exp(float(p[layout.unknowns[GAIN]][0]))
    return gain, {channel: float(p[layout.unknowns[key]][0]) for channel, key in DELAYS.items()}


def _stiffness(system: System, lines: Lines) -> Complex:
    omega = lines.omega[:, None, None]
    out = np.empty((len(omega), *system.springs.shape), dtype=complex)
    out.real = system.springs - omega**2 * system.mass
    out.imag = omega * system.dampers
    return out


def _moved(system: System, lines: Lines) -> Complex:
    """Coordinates (K, n, 2) per unit of force in the mesh, and of force of the drive at its base circle."""
    stiffness = _stiffness(system, lines)
    forces = np.broadcast_to(system.forces + 0j, (len(stiffness), *system.forces.shape))
    return np.asarray(np.linalg.solve(stiffness, forces))


def _late(system: System, lines: Lines, name: str) -> Complex:
    return np.asarray(np.exp(-1j * lines.omega * system.late[name]))[:, None]


def _answers(layout: Layout, system: System, lines: Lines, moved: Complex) -> Complex:
    """Channels (K, C, 2) where the coordinates are `moved` (K, n, 2)."""
    answer = np.zeros((len(lines.omega), len(lines.names), 2), dtype=complex)
    for column, name in enumerate(lines.names):
        if name == REACTION:
            answer[:, column, 0] = layout.model.base_radius[1] * system.gain
        else:
            answer[:, column] = (system.shown[name] @ moved) * _late(system, lines, name)
    return answer


def _changes(
    layout: Layout, system: System, slopes: Sequence[Slope], lines: Lines, moved: Complex, answer: Complex
) -> Complex:
    """Derivatives (slopes, K, C, 2) of the channels `answer` (K, C, 2)."""
    omega = lines.omega[:, None]
    out = np.zeros((len(slopes), *answer.shape), dtype=complex)
    # One solution of the transposed equations for each channel serves all unknowns.
    shown = np.stack([system.shown.get(name, np.zeros(len(system.free))) for name in lines.names], axis=1)
    stiffness = np.swapaxes(_stiffness(system, lines), 1, 2)
    adjoint = np.linalg.solve(stiffness, np.broadcast_to(shown + 0j, (len(omega), *shown.shape)))
    adjoint, moved_first = np.moveaxis(adjoint, 1, 0), np.ascontiguousarray(np.moveaxis(moved, 1, 0))
    for number, slope in enumerate(slopes):
        # A slope is a few springs, a damper or a mass: few coordinates are pulled.
        parts = (slope.springs, slope.dampers, slope.mass)
        pulling = np.flatnonzero(np.any([part != 0.0 for part in parts], axis=(0, 2)))
        for row in pulling:
            pulled = np.tensordot(slope.springs[row], moved_first, 1)
            pulled += 1j * omega * np.tensordot(slope.dampers[row], moved_first, 1)
            pulled -= omega**2 * np.tensordot(slope.mass[row], moved_first, 1)
            out[number] -= adjoint[row][:, :, None] * pulled[:, None, :]
        for column, name in enumerate(lines.names):
            if name != REACTION and slope.shown[name].any():
                out[number, :, column] += np.tensordot(slope.shown[name], moved_first, 1)
    for column, name in enumerate(lines.names):
        if name == REACTION:
            gains = np.array([slope.gain for slope in slopes])
            out[:, :, column, 0] = layout.model.base_radius[1] * gains[:, None]
            continue
        late = np.array([slope.late[name] for slope in slopes])
        out[:, :, column] *= _late(system, lines, name)
        out[late != 0.0, :, column] -= 1j * late[late != 0.0, None, None] * omega * answer[:, column]
    return out


def joined(lines: Sequence[Lines]) -> list[Lines]:
    """Lines of all records that have the same channels as one."""
    alike: dict[tuple[str, ...], list[Lines]] = {}
    for one in lines:
        alike.setdefault(one.names, []).append(one)
    parts = ("omega", "channels", "torque", "noise", "level")
    return [
        Lines(names, *(np.concatenate([getattr(one, part) for one in group]) for part in parts))
        for names, group in alike.items()
    ]


def lines_of(model: NominalModel, condition: Condition, wanted: tuple[str, ...], most: int) -> Lines | None:
    """At most so many lines of a condition; None where it has too few, or not the channels."""
    kinds = kinds_of(condition)
    strong = (KINDS.index("operating"), KINDS.index("excited"))
    bins = np.flatnonzero(np.isin(kinds, strong) & (np.arange(condition.bins) > 0))
    names = tuple(name for name in wanted if name in condition.spectra)
    if len(names) < 3 or not any(name.startswith("y_") for name in names) or len(bins) < SMOOTHED:
        return None
    if len(bins) > most:
        bins = bins[np.linspace(0, len(bins) - 1, most).astype(int)]
    spectra, omega = {name: values[bins] for name, values in condition.spectra.items()}, condition.omega[bins]
    if REACTION in names:
        spectra[REACTION] = model.base_radius[1] * force_at_load(model, spectra, omega)
    channels = np.stack([spectra[name] for name in names], axis=1)
    width = max(len(bins) // SMOOTHED, 3)
    padded = np.pad(np.abs(channels) ** 2, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
    level = np.lib.stride_tricks.sliding_window_view(padded, width, axis=0).mean(axis=-1)
    noise = np.array([condition.noise.get(name, 0.0) for name in names])
    still = level.mean(axis=0) + noise == 0.0
    if still.any():  # a channel that shows nothing tells nothing
        return None
    return Lines(names, omega, channels, spectra["torque_driver"], np.tile(noise, (len(omega), 1)), level)
