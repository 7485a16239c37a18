"""The force in the mesh that the measured motion makes, under given departures from the nominal rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import smooth
from gearbench.diagnosis.forces.condition import CHANNELS, Condition
from gearbench.diagnosis.forces.departures import Departures
from gearbench.diagnosis.forces.equations import DELAYED
from gearbench.diagnosis.forces.nominal import NominalModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RADIAL_STIFFNESS, RADIAL_DAMPING = 5.0, 1.5  # of radial supports, as multiples of the tangential ones'


@dataclass(frozen=True)
class Mesh:
    """The mesh of one condition under given departures, over time (N,).

    Deflection [m], what working flanks alone have of it [m], force without damping [N], its tangent [N/m], damping
    coefficient [N s/m], rate of the DTE [m/s], the whole force [N] and the touching flags; `stiffening` is the mean
    logarithm of the stiffness's factor.
    """

    delta: Array
    filled: Array
    elastic: Array
    tangent: Array
    viscosity: Array
    rate: Array
    force: Array
    touching: NDArray[np.bool_]
    stiffening: float

    @cached_property
    def working_tangent(self) -> Array:
        """The tangent [N/m] where the working flanks touch: what is on them is not felt on the back flanks."""
        return np.where(self.elastic < 0.0, 0.0, self.tangent)


def corrected(condition: Condition, departures: Departures) -> dict[str, Complex]:
    """Spectra (N/2 + 1,) of the channels with the delays of their sensors taken out."""
    out = {}
    for channel in CHANNELS:
        spectrum = condition.spectra.get(channel)
        if spectrum is None:
            continue
        if channel in DELAYED:
            lag = departures.delay[DELAYED.index(channel)]
            if lag:
                spectrum = spectrum * np.exp(1j * condition.omega * lag)
                spectrum[0] += steady_rate(condition, channel) * lag
        out[channel] = spectrum
    return out


def steady_rate(condition: Condition, channel: str) -> float:
    """Steady rate [m/s] of a channel that its departures leave out: rb times speed for angles."""
    return condition.pitch_speed if channel.startswith("angle") else 0.0


def closing(model: NominalModel, spectra: Mapping[str, Complex]) -> Complex:
    """Spectrum [m] of how far the gears' motion closes the mesh; supports without a channel stand still."""
    g = model.support_factor
    total = spectra["angle_driver"] - spectra["angle_driven"]
    if "y_driver" in spectra:
        total = total + g * spectra["y_driver"]
    if "y_driven" in spectra:
        total = total - g * spectra["y_driven"]
    return total


def stiffness_factor(condition: Condition, departures: Departures) -> Array:
    """Factor (N,) on the mesh stiffness: scale, shape and loss of single teeth."""
    factor = 1.0 + departures.shape @ condition.waves
    left = (condition.load_share * softened(condition, departures.loss)).sum(axis=-1)
    return np.asarray(np.exp(departures.scale) * factor * left)


def softened(condition: Condition, loss: Array) -> Array:
    """Factor (N, n_o) of each pair's stiffness when teeth (z1 + z2,) lose these parts of their bending stiffness."""
    z1 = condition.teeth[0]
    more = loss / (1.0 - loss)
    first, second = more[:z1][condition.tooth[0]], more[z1:][condition.tooth[1]]
    return np.asarray(1.0 / (1.0 + condition.bending[..., 0] * first + condition.bending[..., 1] * second))


def mesh(model: NominalModel, condition: Condition, departures: Departures, spectra: Mapping[str, Complex]) -> Mesh:
    """The mesh force that the measured motion, `corrected`, makes under the departures."""
    dte = closing(model, spectra)
    filtered = dte + _yielding(model, condition, departures)
    n = condition.samples
    delta = np.fft.irfft(filtered, n) * n + departures.closed
    rate = np.fft.irfft(1j * condition.omega * dte, n) * n
    law = replace(model.hardened, backlash=max(model.law.backlash + departures.backlash, 0.0))
    modulated = stiffness_factor(condition, departures)
    factor = model.scale * modulated
    # The errors of all pairs in contact act together, each by its part of the stiffness.
    weight = condition.load_share * softened(condition, departures.loss)
    weight = weight / weight.sum(axis=-1, keepdims=True)
    filled = model.law.lead + departures.offset + departures.excess + departures.profile @ condition.waves
    filled = filled + (weight * _pitch_excess(condition, departures)).sum(axis=-1)
    delta = delta + filled
    force, slope = law.evaluate(delta, condition.phase + departures.turned, filled)
    if departures.curvature:
        level = np.maximum(np.abs(force), 1e-3 * condition.force_level) / model.reference_force
        stiffer = departures.curvature / (1.0 + model.hardening)
        factor = factor * level**stiffer
        slope = (1.0 + stiffer) * slope
    elastic, tangent = factor * force, factor * slope
    touching = force != 0.0
    ratio = model.mesh_ratio * np.exp(departures.mesh_ratio)
    viscosity = 2 * ratio * np.sqrt(np.maximum(tangent, 0.0) * model.mesh_mass)
    quadratic = departures.dissipation * np.abs(rate)
    total = elastic + (viscosity + quadratic) * rate * touching
    stiffening = float(np.log(np.maximum(modulated, 1e-3)).mean())
    return Mesh(delta, filled, elastic, tangent, viscosity, rate, total, touching, stiffening)


def _pitch_excess(condition: Condition, departures: Departures) -> Array:
    """Excess material (N, n_o) [m] of each pair in contact by its teeth's pitch errors."""
    z1 = condition.teeth[0]
    first, second = departures.pitch[:z1], departures.pitch[z1:]
    return np.asarray(first[condition.tooth[0]] + second[condition.tooth[1]])


def radial_impedance(
    model: NominalModel, condition: Condition, departures: Departures
) -> tuple[Complex, Array, Complex]:
    """Dynamic stiffness (2, N/2 + 1) [N/m] of both gears' radial supports, their springs (2,) and dampers' part."""
    values = departures.radial
    spring = RADIAL_STIFFNESS * np.array(model.stiffness) * np.exp(values[:2])
    damping = RADIAL_DAMPING * np.array(model.damping) * np.exp(values[2:])
    damper = np.asarray(1j * condition.omega * damping[:, None], dtype=np.complex128)
    impedance = spring[:, None] + damper - np.array(model.mass)[:, None] * condition.omega**2
    return np.asarray(impedance, dtype=np.complex128), np.asarray(spring), damper


def _yielding(model: NominalModel, condition: Condition, departures: Departures) -> Complex:
    """Departure of the deflection's spectrum by what moves no measured channel: radial supports, webs and shafts."""
    compliance = smooth(departures.yielding, condition.hats_full) / condition.stiffness_level
    impedance, _, _ = radial_impedance(model, condition, departures)
    compliance = compliance - model.transverse_factor**2 * (1 / impedance).sum(axis=0)
    return np.asarray(compliance * condition.force_full)
