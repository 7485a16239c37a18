"""One measured condition, prepared for the force residuals: spectra, phases, pairs in contact, weights of teeth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.basis import hats
from gearbench.diagnosis.machine import Machine

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

CHANNELS = ("angle_driver", "angle_driven", "y_driver", "y_driven", "torque_driver", "torque_driven")


@dataclass(frozen=True)
class Condition:
    """What the rows need of one condition; N samples of one hunting period, K bins up to the band's end.

    `spectra` maps a channel to its full half-spectrum (N/2 + 1,) = rfft/N of the period mean, angles as departures
    u = rb (theta - nominal rotation) [m]; `omega` (N/2 + 1,) [rad/s]; `phase` (N,) mesh phase [cycles]; `tooth`
    (2, N, n_o) tooth numbers of the pairs in contact, `share` (N, n_o) their shares, `bending` (N, n_o, 2); `arms`
    (3, N) friction levers over base radius, for driver rotation, y and driven rotation; `rotation` (2, N) angle [rad]
    of both gears; `speed` their speeds [rad/s], `pitch_speed` rb speed [m/s]; `noise` variance of one bin of each
    channel's spectrum; `force_level` [N] and `stiffness_level` [N/m] of the mesh at the mean torque; `force_full`
    (N/2 + 1,) spectrum of the mesh force that the nominal drive row gives, zero beyond the used bins; `hats_full` basis
    of smooth functions of frequency (knots, N/2 + 1).
    """

    name: str
    samples: int
    bins: int
    rate: float
    mesh_frequency: float
    spectra: Mapping[str, Complex]
    noise: Mapping[str, float]
    omega: Array
    phase: Array
    tooth: NDArray[np.int64]
    share: Array
    bending: Array
    arms: Array
    rotation: Array
    speed: tuple[float, float]
    pitch_speed: float
    teeth: tuple[int, int]
    torque_mean: float
    force_level: float
    stiffness_level: float
    force_full: Complex
    hats_full: Array

    @property
    def frequency(self) -> Array:
        """Frequencies (K,) [Hz] of the bins that are used."""
        return self.omega[: self.bins] / (2 * np.pi)


def departures(name: str, values: Array, rate: float, speed: tuple[float, float], radii: tuple[float, float]) -> Array:
    """Channel values (..., N) with angles turned into u = rb (theta - speed t) [m]; others as they are."""
    for side, channel in enumerate(("angle_driver", "angle_driven")):
        if name == channel:
            time = np.arange(values.shape[-1]) / rate
            return radii[side] * (values - speed[side] * time)
    return values


def prepare(
    name: str,
    periods: Mapping[str, Array],
    rate: float,
    mesh_frequency: float,
    phase: Array,
    machine: Machine,
    band: float,
) -> Condition:
    """Condition from channels (P, N) over hunting periods; `band` [Hz] is where the used bins end."""
    samples = phase.size
    speed = tuple(2 * np.pi * mesh_frequency / z for z in machine.teeth)
    spectra, noise = {}, {}
    stated = dict(zip(("angle", "y", "torque"), machine.noise, strict=True))
    for channel, values in periods.items():
        if channel not in CHANNELS:
            continue
        spectrum = np.fft.rfft(values, axis=-1) / samples
        spectra[channel] = spectrum.mean(axis=0)
        count = len(values)
        floor = stated[channel.split("_")[0]] ** 2 / samples / count
        if channel.startswith("angle"):
            floor *= machine.base_radius[channel == "angle_driven"] ** 2
        if count > 1:
            # White noise has the same variance in every bin: the median ignores what is not noise.
            scatter = np.abs(spectrum[:, 1:] - spectra[channel][1:]) ** 2
            seen = float(np.median(scatter.sum(axis=0) / (count - 1))) / np.log(2.0) / count
            floor = max(seen, 1e-3 * floor)
        noise[channel] = max(floor, 1e-40)
    omega = 2 * np.pi * np.fft.rfftfreq(samples, 1 / rate)
    bins = int(np.searchsorted(omega, 2 * np.pi * band, side="right"))
    numbers, share = machine.law.pairs(phase)
    tooth = np.stack([numbers % machine.teeth[0], numbers % machine.teeth[1]])
    m1, s, m2 = machine.law.friction(phase)
    rb1, rb2 = machine.base_radius
    arms = np.stack([m1 / rb1, s * machine.cross_factor / machine.support_factor, m2 / rb2])
    rotation = np.stack([2 * np.pi * phase / z for z in machine.teeth])
    mean = float(spectra["torque_driver"][0].real)
    drive = (spectra["torque_driver"] + (machine.inertia[0] + machine.rotor) * omega**2 * _angle(spectra, rb1)) / rb1
    drive[bins:] = 0.0
    return Condition(
        name=name,
        samples=samples,
        bins=bins,
        rate=rate,
        mesh_frequency=mesh_frequency,
        spectra=spectra,
        noise=noise,
        omega=omega,
        phase=phase,
        tooth=tooth,
        share=share,
        bending=machine.law.bending_of(phase),
        arms=arms,
        rotation=rotation,
        speed=(speed[0], speed[1]),
        pitch_speed=rb1 * speed[0],
        teeth=machine.teeth,
        torque_mean=mean,
        force_level=abs(mean) / rb1,
        stiffness_level=_stiffness(machine, abs(mean) / rb1),
        force_full=drive,
        hats_full=hats(omega / (2 * np.pi)),
    )


def _angle(spectra: Mapping[str, Complex], radius: float) -> Complex:
    return spectra["angle_driver"] / radius


def _stiffness(machine: Machine, force: float) -> float:
    """Secant stiffness [N/m] of the mesh at a force [N], mean over the cycle."""
    mean = machine.law.force.mean(axis=0)
    return force / float(np.interp(force, mean, machine.law.approach))
