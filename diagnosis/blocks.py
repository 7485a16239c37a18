"""Covariance of the force residuals: rows err on their own, the mesh force errs in all rows at once.

Bins are cut into blocks of one condition, one kind (excited, operating, shaft sideband, rest) and a narrow band. In a
block the residuals r (rows,) have covariance diag(sigma_i^2 lambda_i) + sigma_m^2 lambda_m g g^H, with g the share of
an error of the mesh force in each row. sigma are the floors that a sound, imperfectly modelled rig has; lambda >= 1 is
what is missing beyond, with prior lambda^-1.5, found by expectation-maximisation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.condition import Condition
from gearbench.diagnosis.machine import Machine
from gearbench.diagnosis.unknowns import ROWS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

KINDS = ("operating", "excited", "driver-shaft", "driven-shaft", "other")
BLOCK = 8  # bins
SHRINK = 1.5  # exponent of the prior on lambda
AUDIBLE = 3.0  # times the noise
EXCITED = 0.05  # of the largest torque line


@dataclass(frozen=True)
class Blocks:
    """Blocks of one condition: `used` (B,) bins in which anything but noise is heard, `of_bin` (B,) their blocks;
    `kind` (blocks,) index into KINDS, `count` (blocks,) bins, `frequency` (blocks,) centre [Hz]; `floor` (rows + 1, B)
    variances [N^2], the mesh last; `rows` those that the record has channels for."""

    used: NDArray[np.int64]
    of_bin: NDArray[np.int64]
    kind: NDArray[np.int64]
    count: Array
    frequency: Array
    floor: Array
    rows: NDArray[np.int64]


def kinds_of(condition: Condition) -> NDArray[np.int64]:
    """Kind of every bin (K,), read off the torque and the bin's number modulo the cycles of a row."""
    number = np.arange(condition.bins)
    torque = np.abs(condition.spectra["torque_driver"][: condition.bins])
    kind = np.full(condition.bins, KINDS.index("other"))
    for side, name in ((1, "driven-shaft"), (0, "driver-shaft")):
        kind[number % (condition.cycles // condition.teeth[side]) == 0] = KINDS.index(name)
    kind[torque > EXCITED * torque[1:].max()] = KINDS.index("excited")
    kind[number % condition.cycles == 0] = KINDS.index("operating")
    return kind


def cut(machine: Machine, condition: Condition, level: Array, relative: Array, separates: bool) -> Blocks:
    """Blocks of a condition. `level` (rows, K) [N] is each row's own estimate of the mesh force (NaN: no such row),
    `relative` (rows + 1, K) the floors as shares of the block's force. Where flanks separate, impacts reach beyond the
    sampled band and only excited and operating bins are used."""
    kind = kinds_of(condition)
    present = np.flatnonzero(np.isfinite(level).all(axis=1))
    of_bin = np.full(condition.bins, -1)
    kinds, counts, centres = [], [], []
    for label in range(2 if separates else len(KINDS)):
        bins = np.flatnonzero(kind == label)
        for start in range(0, len(bins), BLOCK):
            chosen = bins[start : start + BLOCK]
            of_bin[chosen] = len(kinds)
            kinds.append(label)
            counts.append(len(chosen))
            centres.append(condition.frequency[chosen].mean())
    number = len(kinds)
    inside = of_bin >= 0
    power = np.zeros((len(present), number))
    for i, row in enumerate(present):
        power[i] = np.bincount(of_bin[inside], np.abs(level[row, inside]) ** 2, number) / np.array(counts)
    size = np.median(power, axis=0)
    noise = _noise(machine, condition)
    loudest = np.bincount(of_bin[inside], noise[[*present, len(ROWS)]].max(axis=0)[inside], number) / np.array(counts)
    # In bins of noise alone the mesh force is stiffness times noise: they would pull every stiffness to zero.
    heard = size > AUDIBLE**2 * loudest
    renumber = np.where(heard, np.cumsum(heard) - 1, -1)
    used = np.flatnonzero(inside)[heard[of_bin[inside]]]
    floor = relative**2 * size[of_bin] + noise
    return Blocks(
        used=used,
        of_bin=renumber[of_bin[used]],
        kind=np.array(kinds)[heard],
        count=np.array(counts, dtype=float)[heard],
        frequency=np.array(centres)[heard],
        floor=floor[:, used],
        rows=present,
    )


def _noise(machine: Machine, condition: Condition) -> Array:
    """Variance (rows + 1, K) [N^2] that the channels' noise puts into each row and into the mesh force."""
    omega = condition.omega[: condition.bins]
    rb1, rb2 = machine.base_radius
    g, noise = machine.support_factor, condition.noise
    first = (noise["torque_driver"] + ((machine.inertia[0] + machine.rotor) * omega**2 / rb1) ** 2 * noise["angle_driver"]) / rb1**2
    last = (noise.get("torque_driven", 0.0) + (machine.inertia[1] * omega**2 / rb2) ** 2 * noise["angle_driven"]) / rb2**2
    out = [first]
    for side, channel in enumerate(("y_driver", "y_driven")):
        dynamic = np.abs(machine.stiffness[side] + 1j * omega * machine.damping[side] - omega**2 * machine.mass[side])
        out.append((dynamic / g) ** 2 * noise.get(channel, 0.0))
    motion = noise["angle_driver"] + noise["angle_driven"]
    motion += g**2 * (noise.get("y_driver", 0.0) + noise.get("y_driven", 0.0))
    meshing = np.full(omega.size, condition.stiffness_level**2 * motion)
    return np.stack([out[0], out[1], last, out[2], meshing])


def missing(blocks: Blocks, residual: Complex, share: Complex, start: Array, rounds: int) -> tuple[Array, float]:
    """Lambda (rows + 1, blocks) >= 1 by expectation-maximisation from `start`, and the cost
    sum n log|V| + r^H V^-1 r + SHRINK log lambda."""
    use = blocks.rows
    r, g = residual[np.ix_(use, blocks.used)], share[np.ix_(use, blocks.used)]
    floor = blocks.floor[[*use, len(ROWS)]]
    number = len(blocks.count)
    factor = start.copy()
    for _ in range(rounds):
        d = floor * factor[:, blocks.of_bin]
        weight = np.abs(g) ** 2 / d[:-1]
        precision = 1.0 / d[-1] + weight.sum(axis=0)
        mean = -(np.conj(g) * r / d[:-1]).sum(axis=0) / precision
        second = np.empty_like(d)
        second[-1] = np.abs(mean) ** 2 + 1.0 / precision
        second[:-1] = np.abs(r + g * mean) ** 2 + np.abs(g) ** 2 / precision
        total = np.stack([np.bincount(blocks.of_bin, row, number) for row in second / floor])
        factor = np.maximum(total / (blocks.count + SHRINK), 1.0)
    return factor, cost_of(blocks, r, g, floor, factor)


def cost_of(blocks: Blocks, r: Complex, g: Complex, floor: Array, factor: Array) -> float:
    """The cost of residuals under given lambda."""
    d = floor * factor[:, blocks.of_bin]
    weight = np.abs(g) ** 2 / d[:-1]
    precision = 1.0 / d[-1] + weight.sum(axis=0)
    through = np.abs((np.conj(g) * r / d[:-1]).sum(axis=0)) ** 2 / precision
    square = (np.abs(r) ** 2 / d[:-1]).sum(axis=0) - through
    logdet = np.log(d).sum(axis=0) + np.log(precision)
    return float((square + logdet).sum() + SHRINK * np.log(factor).sum())


def whitened(blocks: Blocks, residual: Complex, share: Complex, columns: Complex, factor: Array) -> tuple[Array, Array]:
    """Residuals (2 rows B,) and columns (2 rows B, unknowns), real, whose squares add up to r^H V^-1 r; `columns`
    (4, B, unknowns) are those of the used bins."""
    use = blocks.rows
    d = blocks.floor[[*use, len(ROWS)]] * factor[:, blocks.of_bin]
    here = np.ix_(use, blocks.used)
    g = share[here] / np.sqrt(d[:-1])
    r = residual[here] / np.sqrt(d[:-1])
    j = columns[use] / np.sqrt(d[:-1])[..., None]
    # (1 + dm g g^H)^(-1/2) = 1 - t g g^H with one scalar a bin.
    norm = (np.abs(g) ** 2).sum(axis=0)
    t = (1.0 - 1.0 / np.sqrt(1.0 + d[-1] * norm)) / np.maximum(norm, 1e-300)
    r = r - g * (t * (np.conj(g) * r).sum(axis=0))
    j = j - g[..., None] * (t[:, None] * np.einsum("rk,rkp->kp", np.conj(g), j))
    flat, tall = r.ravel(), j.reshape(-1, j.shape[-1])
    return np.concatenate([flat.real, flat.imag]), np.concatenate([tall.real, tall.imag])
