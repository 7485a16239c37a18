"""The rig around its mesh, from how it answers whatever force acts there.

At one frequency the force F in the mesh and the torque T of the drive move a linear rig by

    q = Z^-1 (-d F + e T / rb1),    Z = K + j w C - w^2 M    without the mesh,

d being what each coordinate contributes to the transmission error. F is one number a line: what it explains of driver,
displacements and reaction together is taken out, and what is left depends on supports, masses and housing alone. So
they are found without a simulation, from anywhere; only what acts through the deflection of the mesh (supports across)
is not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.covariance import KINDS, kinds_of
from gearbench.diagnosis.output.layout import Layout
from gearbench.diagnosis.output.structure import CROSS, HOUSING, LEAST_HOUSING, MODE
from gearbench.geometry import pair

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# What is found, beside whatever else is held.
KEYS = ("stiffness", "damping", "mass", "inertia", CROSS, HOUSING, MODE)
# Channels, and the coordinate that each is; the reaction is the force itself.
COORDINATE = {"angle_driver": 0, "y_driver": 1, "y_driven": 2}
REACTION = "torque_driven"
LINES = 200  # of each record, excited and operating, that are enough
# Parts of the local level below which no model is right: wide first, so that distant resonances pull.
LEVELS = (0.1, 0.01)
SMOOTHED = 12  # parts of the band over which the level is taken
EVALUATIONS = 25
HOUSING_AT = (-1.0, 0.0)  # logarithms of a housing's frequency over the supports', where to begin
HOUSING_FROM = 0.04


@dataclass(frozen=True)
class _Lines:
    """Lines of a record: omega (K,), channels (K, C) with variances of noise (C,) and levels (K, C), torque (K,)."""

    names: tuple[str, ...]
    omega: Array
    channels: Complex
    torque: Complex
    noise: Array
    level: Array


def around(layout: Layout, conditions: Sequence[Condition], held: Array) -> Array | None:
    """Unknowns (size,): `held` with those of supports, masses and housing that the records show; None where records
    have no displacement of the gears or no line, or no rig answers."""
    load = layout.nominal.rig.load
    # Held at its end the driven gear hands the force of the mesh on.
    reaction = (REACTION,) if load.boundary == "speed" and not load.twists else ()
    lines = [found for found in (_lines_of(one, (*COORDINATE, *reaction)) for one in conditions) if found is not None]
    if not lines:
        return None
    unknowns, found = layout.unknowns, []
    for frequency in HOUSING_AT if HOUSING in unknowns.slices else (0.0,):
        begin = held.copy()
        if HOUSING in unknowns.slices:
            begin[unknowns[HOUSING]], begin[unknowns[MODE].start] = HOUSING_FROM, frequency
        try:
            found.append(_fitted(layout, lines, begin))
        except ValueError:  # no rig there
            continue
    return min(found, key=lambda one: one[0])[1] if found else None


def _fitted(layout: Layout, lines: Sequence[_Lines], begin: Array) -> tuple[float, Array]:
    unknowns = layout.unknowns
    at = np.concatenate([np.arange(*unknowns[key].indices(unknowns.size)) for key in KEYS if key in unknowns.slices])
    sd = unknowns.prior()[at]
    at, sd = at[sd > 0.0], sd[sd > 0.0]
    low, high = (bound[at] for bound in unknowns.bounds())
    if HOUSING in unknowns.slices:
        low = np.where(at == unknowns[HOUSING].start, LEAST_HOUSING, low)

    def whole(values: Array) -> Array:
        p = begin.copy()
        p[at] = values
        return p

    values, cost = np.clip(begin[at], low, high), np.inf
    for level in LEVELS:

        def misfit(trial: Array, level: float = level) -> Array:
            left = np.concatenate([left_over(layout, whole(trial), one, level) for one in lines])
            parts = np.concatenate([left.real, left.imag])
            # A line that nothing explains counts by the logarithm of its size.
            robust = np.sign(parts) * np.sqrt(np.log1p(parts**2))
            return np.concatenate([robust, trial / sd])

        fit = least_squares(misfit, values, bounds=(low, high), x_scale=sd, max_nfev=EVALUATIONS)
        values, cost = fit.x, float(fit.cost)
    return cost, whole(values)


def left_over(layout: Layout, p: Array, lines: _Lines, level: float) -> Complex:
    """What no force in the mesh explains of the channels (K * C,), over their noise and a part of their level."""
    answer = _answers(layout, p, lines)
    weight = 1.0 / np.sqrt(lines.noise + level**2 * lines.level)
    driven = lines.channels - answer[:, :, 1] * (lines.torque / layout.model.base_radius[0])[:, None]
    along = answer[:, :, 0] * weight
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    seen = driven * weight
    return np.asarray((seen - along * (along.conj() * seen).sum(axis=1, keepdims=True)).ravel())


def _answers(layout: Layout, p: Array, lines: _Lines) -> Complex:
    """Channels (K, C, 2) per unit of force in the mesh, and of force of the drive at its base circle."""
    # The model's time loop is compiled on import, which not every user of this module wants.
    from gearbench.lumped.nonlinear.model import nonlinear_model
    from gearbench.lumped.nonlinear.rest import inverse_masses, mesh_direction, springs_and_dampers

    rig = layout.case(p).rig
    model = nonlinear_model(rig, pair(rig), layout.model.law)
    c, s = model.constants(), model.structure
    springs, dampers = springs_and_dampers(c, s, (c.stiffness1, c.stiffness2))
    inverse, mesh = inverse_masses(c, s), mesh_direction(c, s)
    free = np.flatnonzero(inverse > 0.0)
    inside = np.ix_(free, free)
    omega = lines.omega[:, None, None]
    stiffness = springs[inside] + 1j * omega * dampers[inside] - omega**2 * np.diag(1.0 / inverse[free])
    forces = np.zeros((len(free), 2))
    forces[:, 0] = -mesh[free]
    forces[np.flatnonzero(free == (0 if c.rigid else 4)), 1] = 1.0
    moved = np.zeros((len(lines.omega), len(inverse), 2), dtype=complex)
    moved[:, free] = np.linalg.solve(stiffness, np.broadcast_to(forces.astype(complex), (len(omega), *forces.shape)))
    answer = np.zeros((len(lines.omega), len(lines.names), 2), dtype=complex)
    for column, name in enumerate(lines.names):
        if name == REACTION:
            answer[:, column, 0] = layout.model.base_radius[1]
        else:
            answer[:, column] = moved[:, COORDINATE[name]]
    return answer


def _lines_of(condition: Condition, wanted: tuple[str, ...]) -> _Lines | None:
    kinds = kinds_of(condition)
    strong = (KINDS.index("operating"), KINDS.index("excited"))
    bins = np.flatnonzero(np.isin(kinds, strong) & (np.arange(condition.bins) > 0))
    names = tuple(name for name in wanted if name in condition.spectra)
    if len(names) < 3 or not any(name.startswith("y_") for name in names) or len(bins) < SMOOTHED:
        return None
    if len(bins) > LINES:
        bins = bins[np.linspace(0, len(bins) - 1, LINES).astype(int)]
    channels = np.stack([condition.spectra[name][bins] for name in names], axis=1)
    width = max(len(bins) // SMOOTHED, 3)
    padded = np.pad(np.abs(channels) ** 2, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
    level = np.lib.stride_tricks.sliding_window_view(padded, width, axis=0).mean(axis=-1)
    noise = np.array([condition.noise.get(name, 0.0) for name in names])
    still = level.mean(axis=0) + noise == 0.0
    if still.any():  # a channel that shows nothing tells nothing
        return None
    torque = condition.spectra["torque_driver"][bins]
    return _Lines(names, condition.omega[bins], channels, torque, noise, level)
