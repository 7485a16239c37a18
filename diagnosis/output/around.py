"""The rig around its mesh, from how it answers whatever force acts there.

At one frequency the force F in the mesh and the torque T of the drive move a linear rig by

    q = Z^-1 (-d F + e T / rb1),    Z = K + j w C - w^2 M    without the mesh,

d being what each coordinate contributes to the transmission error. F is one number a line: what it explains of driver,
displacements and reaction together is taken out, and what is left depends on supports, masses and housing alone. So
they are found without a simulation, from anywhere; only what acts through the deflection of the mesh (supports across)
is not seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from gearbench.diagnosis.effects.effect import SIDES
from gearbench.diagnosis.effects.sensor_delay import KEYS as DELAYS
from gearbench.diagnosis.forces.condition import Condition, force_at_load
from gearbench.diagnosis.forces.covariance import KINDS, kinds_of
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.output.fit import prior_cost
from gearbench.diagnosis.output.layout import Layout, around_mesh
from gearbench.diagnosis.output.structure import (
    ACROSS,
    CROSS,
    DAMPED,
    GAIN,
    HOUSED,
    HOUSING,
    MOTIONS,
    SEAT,
    seated,
    with_motion,
)
from gearbench.lumped.nonlinear.coordinates import COORDINATES

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

# What is found, beside whatever else is held.
KEYS = ("stiffness", "damping", "mass", "inertia", ACROSS, CROSS, DAMPED, GAIN, *DELAYS.values())
# Channels that a coordinate each, or a few, make; the reaction is the force itself.
MOVED = ("angle_driver", "y_driver", "y_driven")
REACTION = "torque_driven"
LINES, FEWEST = 200, 80  # of all records and of each, excited and operating, that are enough
# Parts of the local level below which no model is right: wide first, so that distant resonances pull.
LEVELS = (0.1, 0.01)
SMOOTHED = 12  # parts of the band over which the level is taken
EVALUATIONS = 25
# Where a motion of the housing is looked for: compliances over the supports', logarithms of its frequency over theirs.
HOUSING_FROM = (0.004, 0.012, 0.04)
HOUSING_AT = tuple(np.linspace(-2.0, 0.8, 29))
# Where a gear's resonance across its support is looked for, which its cross-coupling shows.
ACROSS_AT = tuple(np.geomspace(0.08, 0.6, 19))
CROSS_AT = (-0.15, -0.06, 0.06, 0.15)
FAINT_AT, FAINT_EVALUATIONS = (-1.0, -0.7, -0.4, 0.0), 10
ROUNDS = 2  # looks for each beside the others
WORTH = 3.0  # nats by which a resonance must explain more


@dataclass(frozen=True)
class _Lines:
    """Lines of a record: omega (K,), channels (K, C) with variances of noise (C,) and levels (K, C), torque (K,)."""

    names: tuple[str, ...]
    omega: Array
    channels: Complex
    torque: Complex
    noise: Array
    level: Array


class _System(NamedTuple):
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


def around(layout: Layout, conditions: Sequence[Condition], held: Array) -> Array | None:
    """Unknowns (size,): `held` with those of supports, masses and housing that the records show; None where records
    have no displacement of the gears or no line, or no rig answers. Displacement sensors that are not held to stand on
    a housing are tried there too."""
    load = layout.nominal.rig.load
    # Held behind itself the driven gear hands on what its inertia leaves of the mesh's force.
    reaction = (REACTION,) if load.boundary == "speed" and not load.twists else ()
    wanted, most = (*MOVED, *reaction), max(LINES // len(conditions), FEWEST)
    found = (_lines_of(layout.model, one, wanted, most) for one in conditions)
    lines = [one for one in found if one is not None]
    if not lines:
        return None
    unknowns = layout.unknowns
    plain = held.copy()
    for key in (CROSS, HOUSING):
        if key in unknowns.slices:
            plain[unknowns[key]] = 0.0
    try:
        cost, best = _fitted(layout, lines, plain, KEYS, LEVELS[:1])
        begun = [best]
        if HOUSING in unknowns.slices and not held[unknowns[SEAT]].any():
            begun.append(seated(unknowns, best))
        rigs = [_found(layout, lines, cost, one) for one in begun]
    except ValueError:  # no rig there
        return None
    return min(rigs, key=lambda p: _misfit(layout, lines, p) + prior_cost(p, unknowns.prior()))


def _found(layout: Layout, lines: Sequence[_Lines], cost: float, best: Array) -> Array:
    """The rig `best` (size,), which has no housing and costs so many nats, with each motion of a housing that is seen
    best beside the other."""
    unknowns = layout.unknowns
    motions = range(len(MOTIONS)) if HOUSING in unknowns.slices else ()
    for _ in range(ROUNDS):
        begin = best
        for side in range(len(SIDES)):
            begin = _looked(layout, lines, begin, _crossing(unknowns, begin, side))
        for motion in motions:
            begin = _looked(layout, lines, begin, _moving(unknowns, begin, motion))
        value, p = _fitted(layout, lines, begin, (*KEYS, *HOUSED), LEVELS)
        if value >= cost:
            break
        cost, best = value, p
    if not motions:
        return best
    # The mesh pushes both gears apart: a housing that moves along answers faintly, and is imitated from afar.
    trials = [with_motion(unknowns, best, 0, at, HOUSING_FROM[-1]) for at in FAINT_AT]
    tried = [_fitted(layout, lines, trial, (*KEYS, *HOUSED), LEVELS[1:], FAINT_EVALUATIONS) for trial in trials]
    value, p = min(tried, key=lambda one: one[0])
    return _fitted(layout, lines, p, (*KEYS, *HOUSED), LEVELS[1:])[1] if value < cost else best


def _looked(layout: Layout, lines: Sequence[_Lines], p: Array, trials: Sequence[Array]) -> Array:
    """The one of `trials` (size,) that explains most, if that is more than without (the first) and more than `p`."""
    here, *costs = (_misfit(layout, lines, trial) for trial in (p, *trials))
    best = int(np.argmin(costs))
    if here < min(costs[0] - WORTH, costs[best] + WORTH):
        return p
    return trials[best] if costs[best] < costs[0] - WORTH else trials[0]


def _crossing(unknowns: Unknowns, p: Array, side: int) -> list[Array]:
    """`p` (size,) without cross-coupling of a support, then with it where its gear might resonate across."""
    out = []
    for soft, coupled in ((p[unknowns[ACROSS]][side], 0.0), *product(ACROSS_AT, CROSS_AT)):
        trial = p.copy()
        trial[unknowns[ACROSS].start + side] = soft
        trial[unknowns[CROSS].start + side] = coupled
        out.append(trial)
    return out


def _moving(unknowns: Unknowns, p: Array, motion: int) -> list[Array]:
    """`p` (size,) without a motion of the housing, then with it where it might resonate."""
    without = p.copy()
    without[unknowns[HOUSING].start + motion] = 0.0
    return [without, *(with_motion(unknowns, p, motion, at, part) for part, at in product(HOUSING_FROM, HOUSING_AT))]


def _misfit(layout: Layout, lines: Sequence[_Lines], p: Array) -> float:
    """Nats that the lines cost: those of the wide level, which see a resonance from afar, and a tenth of those of the
    narrow one, which see a weak one."""
    system = _system(layout, p)
    total = 0.0
    for level in LEVELS:
        for one in lines:
            left = np.log1p(np.abs(_left_over(layout, system, one, level)) ** 2)
            total += level / LEVELS[0] * float(left.sum())
    return total


def _fitted(
    layout: Layout, lines: Sequence[_Lines], begin: Array, keys: Sequence[str], levels: Sequence[float],
    evaluations: int = EVALUATIONS,
) -> tuple[float, Array]:  # fmt: skip
    """Misfit, and `begin` (size,) with the unknowns of these keys where it is least."""
    unknowns = layout.unknowns
    at = np.concatenate([np.arange(*unknowns[key].indices(unknowns.size)) for key in keys if key in unknowns.slices])
    sd = unknowns.prior()[at]
    # Without cross-coupling nothing shows how a support yields across.
    unseen = np.zeros(unknowns.size, dtype=bool)
    for key in (ACROSS, CROSS, DAMPED):
        unseen[unknowns[key]] = begin[unknowns[CROSS]] == 0.0
    kept = (sd > 0.0) & ~unseen[at]
    at, sd = at[kept], sd[kept]
    low, high = (bound[at] for bound in unknowns.bounds())

    def whole(values: Array) -> Array:
        p = begin.copy()
        p[at] = values
        return p

    values = np.clip(begin[at], low, high)
    for level in levels:

        def misfit(trial: Array, level: float = level) -> Array:
            system = _system(layout, whole(trial))
            left = np.concatenate([_left_over(layout, system, one, level) for one in lines])
            parts = np.concatenate([left.real, left.imag])
            # A line that nothing explains counts by the logarithm of its size.
            robust = np.sign(parts) * np.sqrt(np.log1p(parts**2))
            return np.concatenate([robust, trial / sd])

        fit = least_squares(misfit, values, bounds=(low, high), x_scale=sd, max_nfev=evaluations, tr_solver="lsmr")
        values = fit.x
    p = whole(values)
    return _misfit(layout, lines, p), p


def _left_over(layout: Layout, system: _System, lines: _Lines, level: float) -> Complex:
    """What no force in the mesh explains of the channels (K * C,), over their noise and a part of their level."""
    answer = _answers(layout, system, lines)
    weight = 1.0 / np.sqrt(lines.noise + level**2 * lines.level)
    driven = lines.channels - answer[:, :, 1] * (lines.torque / layout.model.base_radius[0])[:, None]
    along = answer[:, :, 0] * weight
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    seen = driven * weight
    return np.asarray((seen - along * (along.conj() * seen).sum(axis=1, keepdims=True)).ravel())


def _system(layout: Layout, p: Array) -> _System:
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
    gain = exp(float(p[layout.unknowns[GAIN]][0]))
    late = {channel: float(p[layout.unknowns[key]][0]) for channel, key in DELAYS.items()}
    return _System(free, springs[inside], dampers[inside], np.diag(1.0 / inverse[free]), forces,
                   {name: row[free] for name, row in rows.items()}, gain, late)  # fmt: skip


def _answers(layout: Layout, system: _System, lines: _Lines) -> Complex:
    """Channels (K, C, 2) per unit of force in the mesh, and of force of the drive at its base circle."""
    omega = lines.omega[:, None, None]
    stiffness = system.springs + 1j * omega * system.dampers - omega**2 * system.mass
    moved = np.linalg.solve(stiffness, np.broadcast_to(system.forces + 0j, (len(omega), *system.forces.shape)))
    answer = np.zeros((len(lines.omega), len(lines.names), 2), dtype=complex)
    for column, name in enumerate(lines.names):
        if name == REACTION:
            answer[:, column, 0] = layout.model.base_radius[1] * system.gain
        else:
            late = np.exp(-1j * lines.omega * system.late[name])[:, None]
            answer[:, column] = np.einsum("n,knf->kf", system.shown[name], moved) * late
    return answer


def _lines_of(model: NominalModel, condition: Condition, wanted: tuple[str, ...], most: int) -> _Lines | None:
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
    return _Lines(names, omega, channels, spectra["torque_driver"], noise, level)
