"""Covariance of the force residuals: equations err on their own, the mesh force errs in all of them at once.

Bins are cut into blocks of one condition, one kind (excited, operating, shaft sideband, rest) and a narrow band. In a
block the residuals r (equations,) have covariance diag(sigma_i^2 lambda_i) + sigma_m^2 lambda_m g g^H, with g the
factor by which an error of the mesh force enters each equation. sigma are the floors that a sound, imperfectly modelled
rig has; lambda >= 1 is what is missing beyond, with prior lambda^-1.5, found by expectation-maximisation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.equations import MESH, SUPPORTS, Equation
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.residuals import Residuals

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SHAFTS = ("driver-shaft", "driven-shaft")  # sidebands of the gears
KINDS = ("operating", "excited", *SHAFTS, "other")
BLOCK = 8  # bins
OPERATING_BLOCK = 3  # as mesh orders fall off steeply
SHRINK = 1.5  # exponent of the prior on lambda
ALIASED = 1.5e-4  # of the mean mesh force: what folds back from beyond the band, and what friction makes of noise
AUDIBLE = 3.0  # times the noise
SIDEBANDS = 0.5  # part of the band in which shaft sidebands are used: errors of teeth act slowly
EXCITED = 0.05  # of the largest torque line


@dataclass(frozen=True)
class Blocks:
    """Blocks of one condition: `used` (B,) bins in which anything but noise is heard, `of_bin` (B,) their blocks,
    `count` (blocks,) bins of each; `floor` (equations + 1, B) variances [N^2], the mesh last; `equations` those that
    the record has channels for."""

    used: NDArray[np.int64]
    of_bin: NDArray[np.int64]
    count: Array
    floor: Array
    equations: NDArray[np.int64]

    @property
    def with_mesh(self) -> list[int]:
        """The equations that the record has channels for, and the mesh, in arrays over all."""
        return [*self.equations, MESH]


def kinds_of(condition: Condition) -> NDArray[np.int64]:
    """Kind of every bin (K,), read off the torque and the bin's number modulo the cycles of a repetition."""
    number = np.arange(condition.bins)
    torque = np.abs(condition.spectra["torque_driver"][: condition.bins])
    kind = np.full(condition.bins, KINDS.index("other"))
    for side, name in reversed(list(enumerate(SHAFTS))):
        kind[number % (condition.cycles // condition.teeth[side]) == 0] = KINDS.index(name)
    kind[torque > EXCITED * torque[1:].max()] = KINDS.index("excited")
    kind[number % condition.cycles == 0] = KINDS.index("operating")
    return kind


def cut(model: NominalModel, condition: Condition, level: Array, relative: Array, separates: bool) -> Blocks:
    """Blocks of a condition.

    `level` (equations + 1, K) [N] is the mesh force as each equation (NaN: none) and the nominal mesh law have it,
    `relative` (equations + 1, K) the floors as parts of the block's force. Where flanks separate, impacts reach beyond
    the sampled band and only excited and operating bins are used.
    """
    kind = kinds_of(condition)
    present = np.flatnonzero(np.isfinite(level[:-1]).all(axis=1))
    of_bin = np.full(condition.bins, -1)
    counts: list[int] = []
    for label in range(2 if separates else len(KINDS)):
        bins = np.flatnonzero(kind == label)
        if KINDS[label] not in ("operating", "excited"):
            bins = bins[bins < SIDEBANDS * condition.bins]
        for chosen in _runs(bins, KINDS[label]):
            of_bin[chosen] = len(counts)
            counts.append(len(chosen))
    number = len(counts)
    inside = of_bin >= 0
    counted = np.array(counts, dtype=float)

    def mean(values: Array) -> Array:
        return np.bincount(of_bin[inside], values[inside], number) / counted

    noise = noise_of_equations(model, condition) + (ALIASED * condition.force_level) ** 2
    size = np.median([mean(np.abs(level[one]) ** 2) for one in present], axis=0)
    moved = mean(np.abs(level[-1]) ** 2)
    # In bins of noise alone there is nothing to explain.
    heard = (size > AUDIBLE**2 * mean(noise[present].max(axis=0))) | (moved > AUDIBLE**2 * mean(noise[-1]))
    renumber = np.where(heard, np.cumsum(heard) - 1, -1)
    used = np.flatnonzero(inside)[heard[of_bin[inside]]]
    floor = relative**2 * size[of_bin] + noise
    floor[-1] += relative[-1] ** 2 * np.maximum(moved - size, 0.0)[of_bin]
    return Blocks(
        used=used,
        of_bin=renumber[of_bin[used]],
        count=counted[heard],
        floor=floor[:, used],
        equations=present,
    )


def _runs(bins: NDArray[np.int64], kind: str) -> list[NDArray[np.int64]]:
    """Bins of one kind in runs that make blocks; the mean has one of its own, as it dwarfs its neighbours."""
    if kind == "operating" and bins.size and bins[0] == 0:
        return [bins[:1], *_runs(bins[1:], kind)]
    length = OPERATING_BLOCK if kind == "operating" else BLOCK
    return [bins[start : start + length] for start in range(0, len(bins), length)]


def noise_of_equations(model: NominalModel, condition: Condition) -> Array:
    """Variance (equations + 1, K) [N^2] that the channels' noise puts into each equation and the mesh force."""
    omega = condition.omega[: condition.bins]
    rb1, rb2 = model.base_radius
    g, noise = model.support_factor, condition.noise
    turning1 = (model.inertia[0] + model.rotor) * omega**2 / rb1
    turning2 = model.inertia[1] * omega**2 / rb2
    out = np.empty((MESH + 1, omega.size))
    out[Equation.DRIVE] = (noise["torque_driver"] + turning1**2 * noise["angle_driver"]) / rb1**2
    out[Equation.LOAD] = (noise.get("torque_driven", 0.0) + turning2**2 * noise["angle_driven"]) / rb2**2
    for one in SUPPORTS:
        spring, damping, mass = model.stiffness[one.side], model.damping[one.side], model.mass[one.side]
        dynamic = np.abs(spring + 1j * omega * damping - omega**2 * mass)
        out[one.equation] = (dynamic / g) ** 2 * noise.get(one.channel, 0.0)
    motion = noise["angle_driver"] + noise["angle_driven"]
    motion += g**2 * (noise.get("y_driver", 0.0) + noise.get("y_driven", 0.0))
    out[MESH] = condition.stiffness_level**2 * motion
    return out


@dataclass(frozen=True)
class Split:
    """How given residuals divide under given lambda: `variance` (equations + 1, B) of the equations' and the mesh's own
    errors, `weight` (equations, B) conj(g)/d, `precision` (B,) of the mesh's error, `mean` (B,) its expectation,
    `force` (B,) the best estimate of the force in the mesh, `level` (B,) its mean square over the block."""

    variance: Array
    weight: Complex
    precision: Array
    mean: Complex
    force: Complex
    level: Array

    def square(self, left: Complex) -> Array:
        """r^H V^-1 r (B,) of the residuals r = `left` (equations, B)."""
        explained = np.abs(self.mean) ** 2 * self.precision
        return np.asarray((np.abs(left) ** 2 / self.variance[:-1]).sum(axis=0) - explained)


def floors(blocks: Blocks, residuals: Residuals) -> Array:
    """Variances (equations + 1, B) of the equations that the record has and of the mesh, whose errors are errors of
    motion: as forces they grow with the stiffness."""
    out = blocks.floor[blocks.with_mesh].copy()
    out[-1] *= np.exp(2 * residuals.stiffening)
    return out


def split(blocks: Blocks, residuals: Residuals, factor: Array) -> Split:
    """The split of residuals (in the used bins) under lambda (equations + 1, blocks)."""
    use = blocks.equations
    d = floors(blocks, residuals) * factor[:, blocks.of_bin]
    weight, precision, mean = mesh_error(residuals.left[use], residuals.mesh_factor[use], d)
    force = residuals.mesh_force - mean
    number = len(blocks.count)
    level = np.bincount(blocks.of_bin, np.abs(force) ** 2, number) / blocks.count
    return Split(d, weight, precision, mean, force, level[blocks.of_bin])


def mesh_error(r: Complex, g: Complex, variance: Array) -> tuple[Complex, Array, Complex]:
    """What residuals r (..., equations, B) say of the error that all equations have in common: their weights conj(g)/d
    (equations, B), its precision (B,) and its expectation (..., B). g (equations, B) is the factor by which it enters
    each, `variance` (equations + 1, B) d."""
    weight = np.asarray(np.conj(g) / variance[:-1], dtype=np.complex128)
    precision = 1.0 / variance[-1] + (weight * g).real.sum(axis=0)
    return weight, precision, -(weight * r).sum(axis=-2) / precision


def expected_squares(r: Complex, g: Complex, variance: Array) -> Array:
    """Expected squares (..., equations + 1, B) of the equations' own errors and, last, of the mesh's."""
    _, precision, mean = mesh_error(r, g, variance)
    own = np.abs(r + g * mean[..., None, :]) ** 2 + np.abs(g) ** 2 / precision
    shared = np.abs(mean) ** 2 + 1.0 / precision
    return np.concatenate([own, shared[..., None, :]], axis=-2)


def missing(blocks: Blocks, residuals: Residuals, start: Array, rounds: int) -> tuple[Array, float]:
    """Lambda (equations + 1, blocks) >= 1 by expectation-maximisation from `start`, and the cost there.

    The cost is the sum over bins of log|V| + r^H V^-1 r and of the logarithm of the force's own mean square in the
    block (its prior: Gaussian, of unknown size), plus SHRINK log lambda over the blocks.
    """
    use, number = blocks.equations, len(blocks.count)
    r, g = residuals.left[use], residuals.mesh_factor[use]
    floor = floors(blocks, residuals)
    factor = start
    for _ in range(rounds):
        squares = expected_squares(r, g, floor * factor[:, blocks.of_bin])
        total = np.stack([np.bincount(blocks.of_bin, square, number) for square in squares / floor])
        factor = np.maximum(total / (blocks.count + SHRINK), 1.0)
    return factor, cost_of(blocks, residuals, factor)


def cost_of(blocks: Blocks, residuals: Residuals, factor: Array) -> float:
    """The cost of residuals (in the used bins) under given lambda."""
    parts = split(blocks, residuals, factor)
    square = parts.square(residuals.left[blocks.equations])
    logdet = np.log(parts.variance).sum(axis=0) + np.log(parts.precision)
    return float((square + logdet + np.log(parts.level)).sum() + SHRINK * np.log(factor).sum())


def square_of(blocks: Blocks, residuals: Residuals, factor: Array) -> float:
    """r^H V^-1 r alone."""
    return float(split(blocks, residuals, factor).square(residuals.left[blocks.equations]).sum())


def whitened(blocks: Blocks, residuals: Residuals, jacobian: Complex, factor: Array) -> tuple[Array, Array]:
    """Residuals (2 equations B,) and Jacobian (2 equations B, unknowns), real, whose squares add up to r^H V^-1 r; all
    in the used bins."""
    use = blocks.equations
    d = floors(blocks, residuals) * factor[:, blocks.of_bin]
    g = residuals.mesh_factor[use] / np.sqrt(d[:-1])
    r = residuals.left[use] / np.sqrt(d[:-1])
    j = jacobian[use] / np.sqrt(d[:-1])[..., None]
    # (1 + dm g g^H)^(-1/2) = 1 - t g g^H with one scalar a bin.
    norm = (np.abs(g) ** 2).sum(axis=0)
    t = (1.0 - 1.0 / np.sqrt(1.0 + d[-1] * norm)) / np.maximum(norm, 1e-30)
    r = r - g * (t * (np.conj(g) * r).sum(axis=0))
    j = j - g[..., None] * (t[:, None] * np.einsum("rk,rkp->kp", np.conj(g), j))
    flat, tall = r.ravel(), j.reshape(-1, j.shape[-1])
    return np.concatenate([flat.real, flat.imag]), np.concatenate([tall.real, tall.imag])


def of_level(
    blocks: Blocks, residuals: Residuals, jacobian: Complex, mesh_jacobian: Complex, factor: Array, stiffening: Array
) -> tuple[Array, Array]:
    """Gradient (unknowns,) of the cost's parts that the force's own size and the mesh's variance make, and curvature
    (unknowns, unknowns) of the former without its negative part; `stiffening` (unknowns,) is the gradient of the mean
    logarithm of the mesh stiffness."""
    parts = split(blocks, residuals, factor)
    change = mesh_jacobian + np.einsum("rk,rkp->kp", parts.weight / parts.precision, jacobian[blocks.equations])
    gradient = 2 * ((np.conj(parts.force) / parts.level) @ change).real
    mesh = parts.variance[-1]
    gradient += 2 * stiffening * float((1 - 1 / (mesh * parts.precision) - np.abs(parts.mean) ** 2 / mesh).sum())
    scaled = change / np.sqrt(parts.level)[:, None]
    tall = np.concatenate([scaled.real, scaled.imag])
    return np.asarray(gradient), np.asarray(2 * tall.T @ tall)
