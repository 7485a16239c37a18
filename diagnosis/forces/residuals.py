"""Force residuals: what is missing from each equation of motion of the measured rig, and how it depends on unknowns.

In a periodic record accelerations follow in the frequency domain, so every equation of motion gives its own estimate of
the one normal force in the mesh, without simulation. With s = j omega, F_m the force that the mesh law gives for the
measured deflection, mu A the friction lever of each row, Q(y) the support's force:

    drive           [T1 + ripple - J_r s^2 theta1 - (1 + J_r s^2 H)(J_1 s^2 theta1 + rb1 F_m (1 + mu A1))] / rb1
    driver support  [-(m1 s^2 + c1 s) y1 - Q1(y1)] / g - F_m (1 + mu As)
    load            [M2 + J_2 s^2 theta2] / rb2 - F_m (1 + mu A2)
    driven support  [(m2 s^2 + c2 s) y2 + Q2(y2)] / g - F_m (1 + mu As)

H is the coupling's compliance (0: rigid). Signs: docs/physics.md, "Axes, signs, zeros". A residual is zero for a
rig that the unknowns describe, and noise besides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import KNOTS
from gearbench.diagnosis.forces.condition import CHANNELS, Condition
from gearbench.diagnosis.forces.nominal import Machine
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.unknowns import DELAYED, ROWS, SUPPORTS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RADIAL_STIFFNESS, RADIAL_DAMPING = 5.0, 1.5  # of radial supports, as multiples of the tangential ones'
LOSS_FACTOR = 0.05  # of a coupling that the nominal rig takes for rigid


@dataclass(frozen=True)
class Mesh:
    """The mesh of one condition under given unknowns, over time (N,).

    Deflection [m], force without damping [N], its tangent [N/m], damping coefficient [N s/m], rate of the DTE [m/s],
    the whole force [N] and the touching flags; `stiffening` is the mean logarithm of the stiffness's factor.
    """

    delta: Array
    elastic: Array
    tangent: Array
    viscosity: Array
    rate: Array
    force: Array
    touching: NDArray[np.bool_]
    stiffening: float


def corrected(condition: Condition, where: Layout, p: Array) -> dict[str, Complex]:
    """Spectra (N/2 + 1,) of the channels with the delays of the unknowns taken out."""
    out = {}
    for channel in CHANNELS:
        spectrum = condition.spectra.get(channel)
        if spectrum is None:
            continue
        if channel in DELAYED:
            lag = p[where[f"delay-{channel}"]][0]
            if lag:
                spectrum = spectrum * np.exp(1j * condition.omega * lag)
                spectrum[0] += _advance(condition, channel) * lag
        out[channel] = spectrum
    return out


def _advance(condition: Condition, channel: str) -> float:
    """Steady rate [m/s] of a channel that its departures leave out: rb times speed for angles."""
    return condition.pitch_speed if channel.startswith("angle") else 0.0


def excess(condition: Condition, where: Layout, p: Array) -> Array:
    """Excess material (N,) [m] that all pairs share: offset, run-out and profile."""
    first, second = condition.lobes
    lobes = p[where["eccentricity-driver"]] @ first + p[where["eccentricity-driven"]] @ second
    return np.asarray(p[where["offset"]][0] + lobes + p[where["profile"]] @ condition.waves)


def pitch_excess(condition: Condition, where: Layout, p: Array) -> Array:
    """Excess material (N, n_o) [m] of each pair in contact by its teeth's pitch errors."""
    return np.asarray(p[where["pitch-driver"]][condition.tooth[0]] + p[where["pitch-driven"]][condition.tooth[1]])


def modulation(condition: Condition, where: Layout, p: Array) -> Array:
    """Factor (N,) of the mesh stiffness: scale, shape and loss of single teeth."""
    factor = 1.0 + p[where["shape"]] @ condition.waves
    left = (condition.share * softened(condition, p[where["crack"]])).sum(axis=-1)
    return np.asarray(np.exp(p[where["scale"]][0]) * factor * left)


def softened(condition: Condition, loss: Array) -> Array:
    """Factor (N, n_o) of each pair's stiffness when teeth (z1 + z2,) lose these parts of their bending stiffness."""
    z1 = condition.teeth[0]
    more = loss / (1.0 - loss)
    first, second = more[:z1][condition.tooth[0]], more[z1:][condition.tooth[1]]
    return np.asarray(1.0 / (1.0 + condition.bending[..., 0] * first + condition.bending[..., 1] * second))


def closing(machine: Machine, spectra: Mapping[str, Complex]) -> Complex:
    """Spectrum [m] of how far the gears' motion closes the mesh; supports without a channel stand still."""
    g = machine.support_factor
    total = spectra["angle_driver"] - spectra["angle_driven"]
    if "y_driver" in spectra:
        total = total + g * spectra["y_driver"]
    if "y_driven" in spectra:
        total = total - g * spectra["y_driven"]
    return total


def mesh(machine: Machine, condition: Condition, where: Layout, p: Array, spectra: Mapping[str, Complex]) -> Mesh:
    """The mesh force that the measured motion makes under the unknowns."""
    dte = closing(machine, spectra)
    filtered = dte + _yielding(machine, condition, where, p)
    n = condition.samples
    delta = np.fft.irfft(filtered, n) * n + excess(condition, where, p)
    rate = np.fft.irfft(1j * condition.omega * dte, n) * n
    law = replace(machine.law, backlash=max(machine.law.backlash + p[where["backlash"]][0], 0.0))
    modulated = modulation(condition, where, p)
    factor = machine.scale * modulated
    # The errors of all pairs in contact act together, each by its part of the stiffness.
    weight = condition.share * softened(condition, p[where["crack"]])
    weight = weight / weight.sum(axis=-1, keepdims=True)
    delta = delta + (weight * pitch_excess(condition, where, p)).sum(axis=-1)
    force, slope = law.evaluate(delta, condition.phase)
    curve = p[where["curvature"]][0]
    if curve:
        level = np.maximum(np.abs(force), 1e-3 * condition.force_level) / condition.force_level
        factor = factor * level**curve
    elastic, tangent = factor * force, factor * slope
    touching = force != 0.0
    ratio = machine.mesh_ratio * np.exp(p[where["mesh-ratio"]][0])
    viscosity = 2 * ratio * np.sqrt(np.maximum(tangent, 0.0) * machine.mesh_mass)
    quadratic = p[where["dissipation"]][0] * np.abs(rate)
    total = elastic + (viscosity + quadratic) * rate * touching
    stiffening = float(np.log(np.maximum(modulated, 1e-3)).mean())
    return Mesh(delta, elastic, tangent, viscosity, rate, total, touching, stiffening)


def radial_impedance(
    machine: Machine, condition: Condition, where: Layout, p: Array
) -> tuple[Complex, Array, Complex]:
    """Dynamic stiffness (2, N/2 + 1) [N/m] of both gears' radial supports, their springs (2,) and dampers' part."""
    values = p[where["radial"]]
    spring = RADIAL_STIFFNESS * np.array(machine.stiffness) * np.exp(values[:2])
    damping = RADIAL_DAMPING * np.array(machine.damping) * np.exp(values[2:])
    damper = np.asarray(1j * condition.omega * damping[:, None], dtype=np.complex128)
    impedance = spring[:, None] + damper - np.array(machine.mass)[:, None] * condition.omega**2
    return np.asarray(impedance, dtype=np.complex128), np.asarray(spring), damper


def _yielding(machine: Machine, condition: Condition, where: Layout, p: Array) -> Complex:
    """Departure of the deflection's spectrum by what moves no measured channel: radial supports, webs and shafts."""
    values = p[where["compliance"]]
    count = len(KNOTS)
    gain = (values[:count] + 1j * values[count:]) @ condition.hats_full / condition.stiffness_level
    impedance, _, _ = radial_impedance(machine, condition, where, p)
    gain = gain - machine.transverse_factor**2 * (1 / impedance).sum(axis=0)
    return np.asarray(gain * condition.force_full)


def coupling_compliance(machine: Machine, condition: Condition, where: Layout, p: Array) -> Complex:
    """H (K,) [rad/(N m)] of the drive's coupling."""
    s = 1j * condition.omega[: condition.bins]
    more = p[where["coupling"]][0] * (1.0 - 1j * LOSS_FACTOR * np.sign(s.imag))
    if machine.compliance == 0.0:
        return np.asarray(more)
    return np.asarray(machine.compliance / (1 + s * machine.coupling_damping * machine.compliance) + more)


def support_force(machine: Machine, side: int, y: Array, log_stiffness: float, more: float) -> tuple[Array, Array]:
    """Spring force (N,) [N] of a support, and its derivative to the exponent."""
    reference = machine.reference[side]
    size = np.maximum(np.abs(y), 1e-4 * reference) / reference
    force = machine.stiffness[side] * np.exp(log_stiffness) * y * size ** (machine.exponent[side] + more)
    return force, force * np.log(size)


@dataclass(frozen=True)
class Residuals:
    """Force residuals `left` (4, K) [N], `share` (4, K) of an error of the mesh force in each, and the spectrum
    `force` (K,) [N] of the mesh force itself; `stiffening` the mean logarithm of the mesh stiffness's factor. Rows of
    channels that the record lacks are NaN."""

    left: Complex
    share: Complex
    force: Complex
    stiffening: float

    def at(self, used: NDArray[np.int64]) -> Residuals:
        """The same at some bins."""
        return Residuals(self.left[:, used], self.share[:, used], self.force[used], self.stiffening)


def rows(machine: Machine, condition: Condition, where: Layout, p: Array) -> Residuals:
    """Force residuals under the unknowns."""
    spectra = corrected(condition, where, p)
    state = mesh(machine, condition, where, p, spectra)
    return assemble(machine, condition, where, p, spectra, state)


def _transform(condition: Condition, values: Array) -> Complex:
    return np.asarray(np.fft.rfft(values, axis=-1)[..., : condition.bins] / condition.samples)


def carried(machine: Machine, condition: Condition, where: Layout, p: Array, force: Array) -> Complex:
    """Spectra (3, K) of the mesh force with friction as driver rotation, supports and driven rotation feel it."""
    mu = machine.friction + p[where["friction"]][0]
    return _transform(condition, force * (1 + mu * condition.arms))


def assemble(
    machine: Machine, condition: Condition, where: Layout, p: Array, spectra: Mapping[str, Complex], state: Mesh
) -> Residuals:
    """Residuals of given channel spectra (`corrected`) and mesh."""
    k = condition.bins
    s = 1j * condition.omega[:k]
    rb1, rb2 = machine.base_radius
    inertia = machine.inertia * (1 + p[where["inertia"]][:2])
    rotor = machine.rotor * (1 + p[where["inertia"]][2])
    first, middle, last = carried(machine, condition, where, p, state.force)
    theta1, theta2 = spectra["angle_driver"][:k] / rb1, spectra["angle_driven"][:k] / rb2
    out = np.full((len(ROWS), k), np.nan, dtype=complex)
    share = np.ones((len(ROWS), k), dtype=complex)
    share[0] = 1 + rotor * s**2 * coupling_compliance(machine, condition, where, p)
    torque = spectra["torque_driver"][:k] + ripple(machine, condition, where, p)
    out[0] = (torque - (rotor + share[0] * inertia[0]) * s**2 * theta1) / rb1 - share[0] * first
    if "torque_driven" in spectra:
        out[2] = (spectra["torque_driven"][:k] + inertia[1] * s**2 * theta2) / rb2 - last
    for side, (row, channel, sign, _) in enumerate(SUPPORTS):
        if channel not in spectra:
            continue
        out[row] = sign * support(machine, condition, where, p, side, spectra[channel]) - middle
    filters = _filters(condition, where, p)
    out += filters * np.stack([share[0] * first, middle, last, middle])
    return Residuals(out, share, _transform(condition, state.force), state.stiffening)


def support(machine: Machine, condition: Condition, where: Layout, p: Array, side: int, y: Complex) -> Complex:
    """Force (K,) [N] along the line of action that moves one gear's centre as measured: y its spectrum (N/2 + 1,)."""
    k, n = condition.bins, condition.samples
    s = 1j * condition.omega[:k]
    exponent = p[where[SUPPORTS[side][-1]]][0]
    spring, _ = support_force(machine, side, np.fft.irfft(y, n) * n, p[where["stiffness"]][side], exponent)
    mass = machine.mass[side] * (1 + p[where["mass"]][side])
    damping = machine.damping[side] * np.exp(p[where["damping"]][side])
    moving = (mass * s**2 + damping * s) * y[:k] + _transform(condition, spring)
    return np.asarray(moving / machine.support_factor)


def ripple(machine: Machine, condition: Condition, where: Layout, p: Array) -> Complex:
    """Spectrum (K,) of the torque ripple [N m]."""
    out = np.zeros(condition.bins, dtype=complex)
    for entry, at, unit in ripple_lines(condition, where):
        out[at] += p[entry] * unit
    return out


def ripple_lines(condition: Condition, where: Layout) -> list[tuple[int, int, complex]]:
    """Of each unknown of this condition's ripple: its entry, its bin, and what it adds there per N m."""
    start = where["ripple"].start
    found = []
    for i, name in enumerate(where.block("ripple").names):
        label, order, part = name.rsplit(":", 2)
        if label == condition.name:
            at = int(order) * condition.cycles // condition.teeth[0]
            found.append((start + i, at, 0.5 if part == "cos" else -0.5j))
    return found


def _filters(condition: Condition, where: Layout, p: Array) -> Complex:
    count = len(KNOTS)
    basis = condition.hats_full[:, : condition.bins]
    return np.stack([(v[:count] + 1j * v[count:]) @ basis for v in (p[where[f"filter-{row}"]] for row in ROWS)])
