"""Mesh phases at which a fit leaves more than elsewhere, and what parameters and response may be off by for them.

Noise of sensors knows nothing of the mesh: its power is the same at all phases. What a model cannot follow of a switch
of stiffness, and flanks whose contact moves with the load, leave their residuals where they are. In a residue class a
residual is a function of phase, the inverse transform of its lines over the sidebands; powers add up over classes and
realisations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.refine import Refined, State, derivatives, normal_system
from gearbench.identification.spectra.joint import Complexes, Floats

# Parts of a mesh period, and complex equations in each of them at least.
PARTS, LEAST_EQUATIONS, FEWEST_PARTS = 64, 24, 8
# Deviations of chance above the median from which on a part is loud.
LOUD = 5.0
# Least part of itself that an equation does without having determined parameters.
LEAST_FREEDOM = 0.1


@dataclass(frozen=True)
class Loud:
    """`phases` (n,) [cycles]: middles of the loud parts; `excess`: what these hold above the others' level, over the
    whole residual's power; more than 1 where parameters have followed the residual."""

    phases: Floats
    excess: float


def settled(fit: Refined, data: ClassData) -> tuple[Refined, Loud | None]:
    """The fit with the covariance at the model itself (that of `refined` belongs to the model before its last step,
    which is another one where a pole comes near zero frequency), and its loud phases, if it has any.

    These count with the residuals that they have, r / (1 - h) each, h the part of an equation that parameters have
    taken in (HC3; MacKinnon and White 1985): a record holds few passages of a switch, and the fit has followed them.
    """
    assert fit.mesh is not None
    state = State.of(fit.model, fit.mesh, data)
    system = normal_system(state, data, fit.noise)
    root, free = system.root(), fit.model.free
    count, power = by_phase(fit.left, data)
    loud = loud_parts(count, power)
    if not loud.any():
        return replace(fit, root=fit.mesh.of_model(root, free)), None
    taken, left = _leverage(state, data, root, fit.noise)
    equations, part = data.equations / left.size, _parts(left.size, loud.size)
    level = left / equations / np.maximum(1.0 - taken / equations, LEAST_FREEDOM) ** 2
    quiet = float(np.median(power)) / count
    level = np.where(loud[part], level, quiet)
    middle = 2.0 / fit.noise * _gram(state, data, np.sqrt(level / fit.noise))
    middle[np.diag_indices_from(middle)] += np.concatenate([np.zeros(free), fit.mesh.precision])
    excess = float(np.sum(level - quiet) * equations / np.sum(power))
    phases = (np.flatnonzero(loud) + 0.5) / loud.size
    return replace(fit, root=fit.mesh.of_model(system.root(middle), free)), Loud(phases, max(excess, 0.0))


def by_phase(left: Complexes, data: ClassData) -> tuple[float, Floats]:
    """Complex equations in each part of a mesh period, and the power (parts,) of the residual `left` (C, S, E) there;
    a single part where equations or sidebands are too few."""
    sidebands = int(data.valid.sum(axis=1).max())
    parts = int(min(PARTS, sidebands, data.equations / LEAST_EQUATIONS))
    if parts < FEWEST_PARTS:
        return data.equations, np.array([float(np.sum(_counted(left, data)))])
    weighted = left * (data.weight[:, None] * data.valid)[:, :, None]
    power = np.sum(np.abs(_in_phase(weighted.transpose(1, 0, 2))) ** 2, axis=(1, 2))
    return data.equations / parts, np.asarray(np.bincount(_parts(power.size, parts), power), dtype=float)


def _counted(left: Complexes, data: ClassData) -> Floats:
    return np.asarray((np.abs(left) * (data.weight[:, None] * data.valid)[:, :, None]) ** 2)


def _in_phase(lines: Complexes) -> Complexes:
    """Functions (M, ...) of phase, of the same sum of squares, that the sidebands (S, ...) of a class make."""
    size = 1 << int(2 * lines.shape[0] - 1).bit_length()
    return np.asarray(np.fft.ifft(lines, size, axis=0) * np.sqrt(size))


def _parts(size: int, parts: int) -> np.ndarray:
    """Number of the part that each of `size` phases lies in."""
    return np.arange(size) * parts // size


def loud_parts(count: float, power: Floats) -> np.ndarray:
    """Which parts (parts,) hold more power than noise would that is the same at all phases: of `count` complex
    equations each, the power of noise scatters by 1/sqrt(count) of itself."""
    return np.asarray(power > np.median(power) * (1.0 + LOUD / np.sqrt(count)))


def _columns(state: State, data: ClassData) -> Iterator[tuple[Complexes, Complexes]]:
    """Derivatives (S, P) and residual (S,) of each class and realisation."""
    of = derivatives(state.model, data, state.operator, state.deflection, state.mesh.shapes)
    return ((columns, left) for _, columns, left in of)


def _leverage(state: State, data: ClassData, root: Floats, noise: float) -> tuple[Floats, Floats]:
    """By phase (M,): complex equations that parameters with this `root` of their covariance take in, and the power of
    the residual."""
    taken = power = np.zeros(1)
    for columns, left in _columns(state, data):
        taken = taken + np.sum(np.abs(_in_phase(columns @ root)) ** 2, axis=1) / noise
        power = power + np.abs(_in_phase(left)) ** 2
    return taken, power


def _gram(state: State, data: ClassData, weight: Floats) -> Floats:
    """J^T J (P, P) of the equations times a `weight` (M,) by phase."""
    gram = np.zeros((1, 1))
    for columns, _ in _columns(state, data):
        turned = _in_phase(columns) * weight[:, None]
        stacked = np.concatenate([turned.real, turned.imag])
        gram = gram + stacked.T @ stacked
    return gram
