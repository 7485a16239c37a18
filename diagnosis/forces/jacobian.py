"""Derivatives of the force residuals to all unknowns, by the chain through the mesh and directly.

Left out are friction's and the filters' modulation of a column, the change of the damping with the stiffness, and what
the law's curvature does to its tangent: below 3 % of a column at the background's size, up to 40 % for a strongly bent
law. Steps that do not help are refused, so that this costs steps, not truth. With all of it in, descents went further,
into optima where supports and rows absorb friction, and verdicts on the calibration family became worse.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import KNOTS
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import Machine
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.residuals import (
    LOSS_FACTOR,
    Mesh,
    Residuals,
    assemble,
    carried,
    corrected,
    coupling_compliance,
    mesh,
    modulation,
    radial_impedance,
    ripple_lines,
    softened,
    support_force,
)
from gearbench.diagnosis.forces.unknowns import DELAYED, ROWS, SUPPORTS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

BACKLASH_STEP = 1e-7  # [m]


def rows_and_columns(
    machine: Machine, condition: Condition, where: Layout, p: Array, used: NDArray[np.int64]
) -> tuple[Residuals, Complex, Complex]:
    """Residuals in the B `used` bins, their derivatives (4, B, unknowns) to the unknowns, and those (B, unknowns) of
    the mesh force."""
    spectra = corrected(condition, where, p)
    state = mesh(machine, condition, where, p, spectra)
    residuals = assemble(machine, condition, where, p, spectra, state)
    out = np.zeros((len(ROWS), len(used), where.size), dtype=complex)
    index, moved = _mesh_columns(machine, condition, where, p, spectra, state, used)
    share = residuals.share
    pressing = np.zeros((len(used), where.size), dtype=complex)
    pressing[:, index] = moved.T
    # One error of the mesh force shows in every row, as strongly as the row weighs it.
    out[:, :, index] = -share[:, used, None] * moved.T
    put = _Put(out, used)
    _support_columns(machine, condition, where, p, spectra, put)
    forces = carried(machine, condition, where, p, state.force)
    _drive_columns(machine, condition, where, p, spectra, forces[0], share[0], put)
    _row_columns(condition, where, state, forces, share, put)
    return residuals.at(used), out, pressing


@dataclass(frozen=True)
class _Put:
    """Adds a spectrum (K,) to one column of one row, at the used bins."""

    out: Complex
    used: NDArray[np.int64]

    def __call__(self, row: int, entry: int, spectrum: Complex) -> None:
        self.out[row, :, entry] += spectrum[self.used]


def _mesh_columns(
    machine: Machine,
    condition: Condition,
    where: Layout,
    p: Array,
    spectra: Mapping[str, Complex],
    state: Mesh,
    used: NDArray[np.int64],
) -> tuple[list[int], Complex]:
    """What moves the mesh force: entries (n,) and spectra (n, B) of the derivatives of F_m, the same in all rows."""
    n = condition.samples
    listed: list[tuple[int, Array]] = []

    def put(key: str, *values: Array, start: int = 0) -> None:
        first = where[key].start + start
        listed.extend((first + i, value) for i, value in enumerate(values))

    viscous = state.viscosity * state.rate * state.touching
    put("scale", state.elastic + 0.5 * viscous)
    put("mesh-ratio", viscous)
    put("dissipation", np.abs(state.rate) * state.rate * state.touching)
    put("offset", state.tangent)
    put("eccentricity-driver", *(state.tangent * condition.lobes[0]))
    put("eccentricity-driven", *(state.tangent * condition.lobes[1]))
    put("shape", *(state.elastic * condition.waves))
    put("profile", *(state.tangent * condition.waves))
    level = np.maximum(np.abs(state.elastic), 1e-3 * condition.force_level) / condition.force_level
    put("curvature", state.elastic * np.log(level))
    put("backlash", _backlash(machine, condition, where, p, state))
    impedance, spring, damper = radial_impedance(machine, condition, where, p)
    softening = machine.transverse_factor**2 * condition.force_full / impedance**2
    changes = np.concatenate([softening * spring[:, None], softening * damper])
    put("radial", *(state.tangent * (np.fft.irfft(changes, n, axis=-1) * n)))
    bins = np.zeros((2 * len(KNOTS), n // 2 + 1), dtype=complex)
    bins[: len(KNOTS)] = condition.hats_full * condition.force_full / condition.stiffness_level
    bins[len(KNOTS) :] = 1j * bins[: len(KNOTS)]
    put("compliance", *(state.tangent * (np.fft.irfft(bins, n, axis=-1) * n)))
    g = machine.support_factor
    for channel, sign in zip(DELAYED, (1.0, -1.0, g, -g), strict=True):
        if channel in spectra:
            rate = 1j * condition.omega * spectra[channel]
            faster = np.fft.irfft(1j * condition.omega * rate, n) * n
            rate[0] = condition.pitch_speed if channel.startswith("angle") else 0.0
            damping = state.viscosity * state.touching * faster
            put(f"delay-{channel}", sign * (state.tangent * (np.fft.irfft(rate, n) * n) + damping))
    pitch, crack = _tooth_columns(condition, p[where["crack"]], state)
    put("pitch-driver", *pitch[: condition.teeth[0]])
    put("pitch-driven", *pitch[condition.teeth[0] :])
    put("crack", *crack)
    index = [at for at, _ in listed]
    values = np.fft.rfft(np.stack([value for _, value in listed]), axis=-1)[:, used] / n
    return index, np.asarray(values)


def _tooth_columns(condition: Condition, loss: Array, state: Mesh) -> tuple[Array, Array]:
    """Derivatives (z1 + z2, N) of the mesh force to each tooth's pitch error and to its loss of bending stiffness."""
    soft = softened(condition, loss)
    left = (condition.share * soft).sum(axis=-1)
    weaker = (condition.share * soft**2)[..., None] * condition.bending
    both = np.stack([condition.share, condition.share], axis=-1)
    pitch = _of_teeth(condition, both * state.tangent[:, None, None])
    own = (1.0 - loss[:, None]) ** -2
    return pitch, own * _of_teeth(condition, weaker * (-state.elastic / left)[:, None, None])


def _of_teeth(condition: Condition, weights: Array) -> Array:
    """Weights (N, n_o, 2) of the pairs sorted to their teeth: (z1 + z2, N)."""
    z1, z2 = condition.teeth
    total = np.zeros((z1 + z2, condition.samples))
    at = np.arange(condition.samples)
    for pair in range(weights.shape[1]):
        total[condition.tooth[0][:, pair], at] += weights[:, pair, 0]
        total[z1 + condition.tooth[1][:, pair], at] += weights[:, pair, 1]
    return total


def _backlash(machine: Machine, condition: Condition, where: Layout, p: Array, state: Mesh) -> Array:
    present = max(machine.law.backlash + p[where["backlash"]][0], 0.0)
    if not np.any(state.delta < -present):
        return np.zeros(condition.samples)
    wider = replace(machine.law, backlash=present + BACKLASH_STEP).evaluate(state.delta, condition.phase)[0]
    now = replace(machine.law, backlash=present).evaluate(state.delta, condition.phase)[0]
    return np.asarray(machine.scale * modulation(condition, where, p) * (wider - now) / BACKLASH_STEP)


def _support_columns(
    machine: Machine, condition: Condition, where: Layout, p: Array, spectra: Mapping[str, Complex], put: _Put
) -> None:
    n, k, g = condition.samples, condition.bins, machine.support_factor
    s = 1j * condition.omega[:k]
    for side, (row, channel, sign, name) in enumerate(SUPPORTS):
        if channel not in spectra:
            continue
        y = spectra[channel]
        stiffness = p[where["stiffness"]][side]
        values = support_force(machine, side, np.fft.irfft(y, n) * n, stiffness, p[where[name]][0])
        spring, more = np.fft.rfft(np.stack(values), axis=-1)[:, :k] / n
        damping = machine.damping[side] * np.exp(p[where["damping"]][side])
        put(row, where["stiffness"].start + side, sign * spring / g)
        put(row, where[name].start, sign * more / g)
        put(row, where["damping"].start + side, sign * damping * s * y[:k] / g)
        put(row, where["mass"].start + side, sign * machine.mass[side] * s**2 * y[:k] / g)
        mass = machine.mass[side] * (1 + p[where["mass"]][side])
        moving = (mass * s**2 + damping * s) * y[:k] + spring
        put(row, where[f"delay-{channel}"].start, sign * s * moving / g)


def _drive_columns(
    machine: Machine,
    condition: Condition,
    where: Layout,
    p: Array,
    spectra: Mapping[str, Complex],
    force: Complex,
    share: Complex,
    put: _Put,
) -> None:
    """Inertias, coupling, ripple and the direct part of a late driver angle. `force` (K,) is rb1's in the drive row."""
    k = condition.bins
    rb1, rb2 = machine.base_radius
    s = 1j * condition.omega[:k]
    turning = s**2 * spectra["angle_driver"][:k] / rb1
    relative = p[where["inertia"]]
    inertia = machine.inertia[0] * (1 + relative[0])
    rotor = machine.rotor * (1 + relative[2])
    shaft = inertia * turning + rb1 * force
    start = where["inertia"].start
    put(0, start, -share * machine.inertia[0] * turning / rb1)
    soft = coupling_compliance(machine, condition, where, p)
    put(0, start + 2, -machine.rotor * (turning + s**2 * soft * shaft) / rb1)
    put(0, where["coupling"].start, -rotor * s**2 * (1 - 1j * LOSS_FACTOR * (s.imag > 0)) * shaft / rb1)
    put(0, where["delay-angle_driver"].start, -(rotor + share * inertia) * s * turning / rb1)
    for entry, at, unit in ripple_lines(condition, where):
        line = np.zeros(k, dtype=complex)
        line[at] = unit / rb1
        put(0, entry, line)
    if "torque_driven" in spectra:
        moving = machine.inertia[1] * s**2 * spectra["angle_driven"][:k] / rb2
        put(2, start + 1, moving / rb2)
        put(2, where["delay-angle_driven"].start, (1 + relative[1]) * s * moving / rb2)


def _row_columns(
    condition: Condition, where: Layout, state: Mesh, forces: Complex, share: Complex, put: _Put
) -> None:
    """Friction, and the smooth filters of single rows."""
    k, n = condition.bins, condition.samples
    rubbing = np.fft.rfft(state.force * condition.arms, axis=-1)[:, :k] / n
    for row, name in enumerate(ROWS):
        lever = (0, 1, 2, 1)[row]
        put(row, where["friction"].start, -share[row] * rubbing[lever])
        weighted = condition.hats_full[:, :k] * (share[row] * forces[lever])
        at = where[f"filter-{name}"].start
        for knot, spectrum in enumerate(weighted):
            put(row, at + knot, spectrum)
            put(row, at + len(KNOTS) + knot, 1j * spectrum)


def stiffening_slope(condition: Condition, where: Layout, p: Array) -> Array:
    """Gradient (unknowns,) of `Mesh.stiffening`: the row's mean logarithm of the mesh stiffness's factor."""
    gradient = np.zeros(where.size)
    gradient[where["scale"]] = 1.0
    loss = p[where["crack"]]
    soft = softened(condition, loss)
    left = (condition.share * soft).sum(axis=-1)
    weaker = (condition.share * soft**2 / left[:, None])[..., None] * condition.bending
    z1, z2 = condition.teeth
    for side, (start, count) in enumerate(((0, z1), (z1, z2))):
        total = np.bincount(condition.tooth[side].ravel(), weaker[..., side].ravel(), count) / condition.samples
        at = slice(where["crack"].start + start, where["crack"].start + start + count)
        gradient[at] = -total / (1.0 - loss[start : start + count]) ** 2
    return gradient
