"""Force residuals: what is missing from each equation of motion of the measured rig under given departures.

In a periodic record accelerations follow in the frequency domain, so every equation of motion gives its own estimate of
the one normal force in the mesh, without simulation. With s = j omega, F_m the force that the mesh law gives for the
measured deflection, mu A friction over its lever arm in each equation, without what run-out adds to that, Q(y) the
support's force:

    drive           [T1 + ripple - J_r s^2 theta1 - (1 + J_r s^2 H)(J_1 s^2 theta1 + rb1 F_m (1 + mu A1))] / rb1
    driver support  [-(m1 s^2 + c1 s) y1 - Q1(y1)] / g - F_m (1 + mu As)
    load            [M2 + J_2 s^2 theta2] / rb2 - F_m (1 + mu A2)
    driven support  [(m2 s^2 + c2 s) y2 + Q2(y2)] / g - F_m (1 + mu As)

H is the coupling's compliance (0: rigid). Signs: docs/physics.md, "Axes, signs, zeros". A residual is zero for a
rig that the departures describe, and noise besides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import smooth
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.departures import Departures
from gearbench.diagnosis.forces.equations import SUPPORTS, Equation
from gearbench.diagnosis.forces.mesh import Mesh, corrected, mesh
from gearbench.diagnosis.forces.nominal import NominalModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LOSS_FACTOR = 0.05  # of a coupling that the nominal rig takes for rigid
# Which lever, of friction and of the force, acts in each equation: 0 driver rotation, 1 along the supports, 2 driven
# rotation.
LEVER_OF = {Equation.DRIVE: 0, Equation.DRIVER_SUPPORT: 1, Equation.LOAD: 2, Equation.DRIVEN_SUPPORT: 1}


@dataclass(frozen=True)
class Residuals:
    """Force residuals `left` (4, K) [N], the factor `mesh_factor` (4, K) by which an error of the mesh force enters
    each equation, and the spectrum `mesh_force` (K,) [N] of that force; `stiffening` the mean logarithm of the mesh
    stiffness's factor. Equations of channels that the record lacks are NaN."""

    left: Complex
    mesh_factor: Complex
    mesh_force: Complex
    stiffening: float

    def at(self, used: NDArray[np.int64]) -> Residuals:
        """The same at some bins."""
        return Residuals(self.left[:, used], self.mesh_factor[:, used], self.mesh_force[used], self.stiffening)


def residuals(model: NominalModel, condition: Condition, departures: Departures) -> Residuals:
    """Force residuals of a condition under the departures."""
    spectra = corrected(condition, departures)
    return assemble(model, condition, departures, spectra, mesh(model, condition, departures, spectra))


def assemble(
    model: NominalModel, condition: Condition, departures: Departures, spectra: Mapping[str, Complex], state: Mesh
) -> Residuals:
    """Residuals of given channel spectra (`corrected`) and mesh."""
    k = condition.bins
    s = 1j * condition.omega[:k]
    rb1, rb2 = model.base_radius
    inertia = model.inertia * (1 + departures.inertia[:2])
    rotor = model.rotor * (1 + departures.inertia[2])
    carried = carried_force(model, condition, departures, state.force)
    theta1, theta2 = spectra["angle_driver"][:k] / rb1, spectra["angle_driven"][:k] / rb2
    out = np.full((len(Equation), k), np.nan, dtype=complex)
    factor = np.ones((len(Equation), k), dtype=complex)
    drive = 1 + rotor * s**2 * coupling_compliance(model, condition, departures)
    factor[Equation.DRIVE] = drive
    torque = spectra["torque_driver"][:k] + departures.torque
    turning = (torque - (rotor + drive * inertia[0]) * s**2 * theta1) / rb1
    out[Equation.DRIVE] = turning - drive * carried[Equation.DRIVE]
    if "torque_driven" in spectra:
        turning = (spectra["torque_driven"][:k] + inertia[1] * s**2 * theta2) / rb2
        out[Equation.LOAD] = turning - carried[Equation.LOAD]
    for side, equation, channel, sign in ((one.side, one.equation, one.channel, one.sign) for one in SUPPORTS):
        if channel not in spectra:
            continue
        out[equation] = sign * _support(model, condition, departures, side, spectra[channel]) - carried[equation]
    carried[Equation.DRIVE] = drive * carried[Equation.DRIVE]
    out += _filters(condition, departures) * carried
    return Residuals(out, factor, transform(condition, state.force), state.stiffening)


def transform(condition: Condition, values: Array) -> Complex:
    """Spectrum (..., K) in the used band of signals (..., N)."""
    return np.asarray(np.fft.rfft(values, axis=-1)[..., : condition.bins] / condition.samples)


def carried_force(model: NominalModel, condition: Condition, departures: Departures, force: Array) -> Complex:
    """Spectra (4, K) of the mesh force with friction and its levers as each equation feels it, without the coupling's
    part."""
    mu = model.friction + departures.friction
    by_lever = transform(condition, force * (1 + mu * condition.lever_arms + departures.levers))
    return by_lever[[LEVER_OF[equation] for equation in Equation]]


def coupling_compliance(model: NominalModel, condition: Condition, departures: Departures) -> Complex:
    """H (K,) [rad/(N m)] of the drive's coupling."""
    omega = condition.omega[: condition.bins]
    return np.asarray(model.coupling_compliance(omega) + departures.coupling * yielding(model, omega))


def yielding(model: NominalModel, omega: Array) -> Complex:
    """What a part of the coupling's compliance has at frequencies (K,) [rad/s]: as that of the case, so that a stiffer
    one is damped as well; with a loss factor where the case has a rigid one."""
    if model.compliance > 0.0:
        return model.coupling_compliance(omega) / model.compliance
    return np.asarray(1.0 - 1j * LOSS_FACTOR * np.sign(omega))


def support_force(model: NominalModel, side: int, y: Array, departures: Departures) -> tuple[Array, Array]:
    """Spring force (N,) [N] of a support, and its derivative to the exponent."""
    reference = model.reference[side]
    size = np.maximum(np.abs(y), 1e-4 * reference) / reference
    factor = np.exp(departures.stiffness[side])
    force = model.stiffness[side] * factor * y * size ** (model.exponent[side] + departures.exponent[side])
    return force, force * np.log(size)


def _support(model: NominalModel, condition: Condition, departures: Departures, side: int, y: Complex) -> Complex:
    """Force (K,) along the line of action that moves one gear's centre as measured: y its spectrum (N/2 + 1,)."""
    k, n = condition.bins, condition.samples
    s = 1j * condition.omega[:k]
    spring, _ = support_force(model, side, np.fft.irfft(y, n) * n, departures)
    mass = model.mass[side] * (1 + departures.mass[side])
    damping = model.damping[side] * np.exp(departures.damping[side])
    moving = (mass * s**2 + damping * s) * y[:k] + transform(condition, spring)
    return np.asarray(moving / model.support_factor)


def _filters(condition: Condition, departures: Departures) -> Complex:
    """Part (4, K) of the mesh force that each equation misses."""
    return smooth(departures.filters, condition.hats_full[:, : condition.bins])
