"""The volume by which departures stretch the measured motion into force residuals, as its logarithm, and its gradient.

It belongs to the probability density of the records: without it, zero stiffness would explain every error of motion.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.covariance import Blocks
from gearbench.diagnosis.forces.departures import Departures
from gearbench.diagnosis.forces.equations import SUPPORTS
from gearbench.diagnosis.forces.mesh import softened
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Unknowns

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def log_volume(
    model: NominalModel, condition: Condition, blocks: Blocks, departures: Departures, stiffening: float
) -> float:
    """Log of the volume for one condition: the mesh's stiffness (`stiffening` is the mean logarithm of its factor)
    stretches the deflection, dynamic stiffness the supports' displacements."""
    total = 2 * blocks.used.size * stiffening
    for _, _, whole in _dynamic_stiffness(model, condition, blocks, departures):
        total += 2 * float(np.log(np.abs(whole)).sum())
    return total


def log_volume_gradient(
    model: NominalModel,
    condition: Condition,
    blocks: Blocks,
    unknowns: Unknowns,
    departures: Departures,
    stiffer: Array,
) -> Array:
    """Gradient (size,) of `log_volume` by the unknowns; `stiffer` (size,) is that of its `stiffening`."""
    gradient = 2 * blocks.used.size * stiffer
    for side, parts, whole in _dynamic_stiffness(model, condition, blocks, departures):
        for slot, part in parts.items():
            for entry in unknowns.moving.get((slot, side), ()):
                gradient[entry] += 2 * float((part / whole).real.sum())
    return gradient


def stiffening_gradient(condition: Condition, unknowns: Unknowns, departures: Departures) -> Array:
    """Gradient (size,) of `Mesh.stiffening`: the mean logarithm over time of the mesh stiffness's factor."""
    gradient = np.zeros(unknowns.size)
    for entry in unknowns.moving.get(("scale", 0), ()):
        gradient[entry] = 1.0
    loss = departures.loss
    soft = softened(condition, loss)
    left = (condition.load_share * soft).sum(axis=-1)
    weaker = (condition.load_share * soft**2 / left[:, None])[..., None] * condition.bending
    z1, z2 = condition.teeth
    for side, (start, count) in enumerate(((0, z1), (z1, z2))):
        total = np.bincount(condition.tooth[side].ravel(), weaker[..., side].ravel(), count) / condition.samples
        values = -total / (1.0 - loss[start : start + count]) ** 2
        for tooth, value in enumerate(values):
            for entry in unknowns.moving.get(("loss", start + tooth), ()):
                gradient[entry] = value
    return gradient


def _dynamic_stiffness(
    model: NominalModel, condition: Condition, blocks: Blocks, departures: Departures
) -> Iterator[tuple[int, dict[str, Complex], Complex]]:
    """Of each support that has an equation: side, derivatives of its dynamic stiffness by slot, and it (B,)."""
    omega = condition.omega[blocks.used]
    for one in SUPPORTS:
        if one.equation not in blocks.equations:
            continue
        side = one.side
        spring = np.full(omega.size, model.stiffness[side] * np.exp(departures.stiffness[side]), dtype=complex)
        damper = np.asarray(1j * omega * model.damping[side] * np.exp(departures.damping[side]), dtype=complex)
        inertia = -(omega**2) * model.mass[side] + 0j
        whole = spring + damper + inertia * (1 + departures.mass[side])
        parts = {"stiffness": spring, "damping": damper, "mass": np.asarray(inertia, dtype=complex)}
        yield side, parts, whole
