"""One measured condition, prepared for the force residuals: spectra, phases, pairs in contact, weights of teeth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import hats, on_path, waves
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import about_rest
from gearbench.lumped.nonlinear.coordinates import leaning_of
from gearbench.lumped.nonlinear.ends import aside_of, ends_between, turned_by

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

TINY = 1e-40  # variance that no channel falls below: divisions stay finite
CHANNELS = ("angle_driver", "angle_driven", "y_driver", "y_driven", "torque_driver", "torque_driven")


@dataclass(frozen=True)
class Condition:
    """What the force residuals need of one condition: N samples of one repetition, `cycles` mesh periods, K bins up to
    `band` [Hz].

    `spectra` maps a channel to its full half-spectrum (N/2 + 1,) = rfft/N of the period mean, angles as departures
    u = rb (theta - nominal rotation) [m]; `noise` to the variance of one of its bins; `omega` (N/2 + 1,) [rad/s];
    `phase` (N,) mesh phase [cycles] with the centres' motion; `tooth` (2, N, n_o) tooth numbers of the pairs that
    touch, `load_share` (N, n_o) their shares of the load, `bending` (N, n_o, 2) the teeth's parts of their flexibility;
    `lever_arms` (3, N) of friction over base radius, for driver rotation, y and driven rotation; `waves` (2 orders, N)
    of the rotation's mesh phase, `flanks` (parts, N) what the mesh as a whole has of a unit of each of the
    `basis.FORM_PARTS` on all pairs, `lobes` (2, 2, N) cosine and sine of both rotations, `leaning` (2, 2,
    3, N) what these parts of a unit of either gear's run-out add to the levers of `Departures` [1/m], `ends` (2, 2, N)
    how far they turn the mesh on [cycles/m]; `pitch_speed`
    rb speed [m/s]; `force_level` [N] and `stiffness_level` [N/m] of the mesh at the mean torque; `force_full` (N/2
    + 1,) spectrum of the mesh force that a nominal equation gives, zero beyond the used bins; `hats_full` basis of
    smooth functions of frequency (knots, N/2 + 1). `rest_known`: the mean displacements, if there are two, are about
    those of the supports, as of sensors whose zero is without load.
    """

    name: str
    samples: int
    bins: int
    band: float
    cycles: int
    spectra: Mapping[str, Complex]
    noise: Mapping[str, float]
    omega: Array
    phase: Array
    tooth: NDArray[np.int64]
    load_share: Array
    bending: Array
    lever_arms: Array
    waves: Array
    flanks: Array
    lobes: Array
    leaning: Array
    ends: Array
    pitch_speed: float
    teeth: tuple[int, int]
    torque_mean: float
    force_level: float
    stiffness_level: float
    force_full: Complex
    hats_full: Array
    rest_known: bool


def prepare(measured: Measurement, model: NominalModel, band: float) -> Condition:
    """The condition of a measurement; `band` [Hz] is where the used bins end."""
    rate, samples = measured.sampling_rate, measured.phase.size
    spectra, noise = _spectra(measured, model)
    rest, rest_known = _rest(model, spectra)
    phase = measured.phase + _turned_on(model, spectra, samples, rest)
    omega = np.asarray(2 * np.pi * np.fft.rfftfreq(samples, 1 / rate), dtype=np.float64)
    bins = min(int(np.searchsorted(omega, 2 * np.pi * band, side="right")), samples // 2)
    numbers, share = model.law.pairs(phase)
    turns = [2 * np.pi * measured.phase / z for z in model.teeth]
    ends = ends_between(model.path, model.base_radius, model.law.base_pitch, model.line)
    rb1 = model.base_radius[0]
    mean = float(spectra["torque_driver"][0].real)
    force = _force(model, spectra, omega)
    force[bins:] = 0.0
    return Condition(
        name=measured.name,
        samples=samples,
        bins=bins,
        band=band,
        cycles=measured.mesh_cycles,
        spectra=spectra,
        noise=noise,
        omega=omega,
        phase=phase,
        tooth=np.stack([numbers % model.teeth[0], numbers % model.teeth[1]]),
        load_share=share,
        bending=model.law.bending_of(phase),
        lever_arms=_lever_arms(model, measured.mesh_frequency, phase, spectra, omega),
        waves=waves(measured.phase),
        flanks=(on_path(phase[:, None] - numbers, model.path) * share).sum(axis=-1),
        lobes=np.stack([(np.cos(turn), np.sin(turn)) for turn in turns]),
        leaning=np.stack([_leaning(model, side, turn) for side, turn in enumerate(turns)]),
        ends=np.stack([turned_by(phase, turn, side, ends) for side, turn in enumerate(turns)]),
        pitch_speed=model.pitch_speed(measured.mesh_frequency),
        teeth=model.teeth,
        torque_mean=mean,
        force_level=abs(mean) / rb1,
        stiffness_level=_stiffness(model, abs(mean) / rb1),
        force_full=force,
        hats_full=hats(omega / (2 * np.pi), band),
        rest_known=rest_known,
    )


def _leaning(model: NominalModel, side: int, turn: Array) -> Array:
    """What run-out of a gear (0: driver) adds to the levers (2, 3, N) [1/m] at its rotations (N,): its centre stands
    aside of the normal through its axis, and turns the line of action (`lumped.nonlinear.ends`)."""
    aside = aside_of(turn, side)
    out = np.zeros((2, 3, turn.size))
    out[:, (0, 2)[side]] = aside / model.base_radius[side]
    if model.support_factor < 1.0:  # supports across the line of centres, with the force's part tan(a_w) across them
        out[:, 1] = aside / sum(model.base_radius)
    return out


def _turned_on(model: NominalModel, spectra: Mapping[str, Complex], samples: int, rest: float) -> Array:
    """How far (samples,) [cycles] the driven gear's vibration and the centres' motion turn the mesh on, as in the
    lumped model: the motion as measured, about where the supports `rest` [m]."""

    def swing(channel: str) -> Array:
        if channel not in spectra:
            return np.zeros(samples)
        lines = spectra[channel].copy()
        lines[0] = 0.0
        return np.asarray(np.fft.irfft(lines, samples) * samples)

    closed = swing("y_driver") - swing("y_driven") + rest
    leaning = leaning_of(model.base_radius, model.cross_factor > 0.0)
    return np.asarray((swing("angle_driven") - leaning * model.support_factor * closed) / model.law.base_pitch)


def _rest(model: NominalModel, spectra: Mapping[str, Complex]) -> tuple[float, bool]:
    """Mean difference [m] of both centres' displacements: the nominal supports' under the mean torque, or the measured
    one where that is near it, as that of sensors is which have their zero without load; and whether it is, if there are
    two."""
    force = float(spectra["torque_driver"][0].real) / model.base_radius[0] * model.support_factor
    rest = -force * (1.0 / model.stiffness[0] + 1.0 / model.stiffness[1])
    if "y_driver" not in spectra or "y_driven" not in spectra:
        return rest, True
    seen = float((spectra["y_driver"][0] - spectra["y_driven"][0]).real)
    near = about_rest(seen, rest)
    return (seen if near else rest), near


def _spectra(measured: Measurement, model: NominalModel) -> tuple[dict[str, Complex], dict[str, float]]:
    """Spectra of the means over the repetitions, and the noise variance of one of their bins."""
    stated = dict(zip(("angle", "y", "torque"), model.noise, strict=True))
    spectra, noise = {}, {}
    for channel in CHANNELS:
        if channel not in measured.periods:
            continue
        arc = model.base_radius[channel == "angle_driven"] if channel.startswith("angle") else 1.0
        values = arc * measured.periods[channel]
        samples, count = values.shape[1], len(values)
        each = np.fft.rfft(values, axis=-1) / samples
        spectra[channel] = each.mean(axis=0)
        floor = (arc * stated[channel.split("_")[0]]) ** 2 / samples / count
        if count > 1:
            # White noise has the same variance in every bin: the median ignores what is not noise.
            scatter = (np.abs(each[:, 1:] - spectra[channel][1:]) ** 2).sum(axis=0) / (count - 1)
            floor = max(float(np.median(scatter)) / np.log(2.0) / count, 1e-3 * floor)
        noise[channel] = max(floor, TINY)
    return spectra, noise


def force_at_load(model: NominalModel, spectra: Mapping[str, Complex], omega: Array) -> Complex:
    """Spectrum [N] of the mesh force by the nominal equation of the load: its reaction, and what the driven gear's own
    inertia takes."""
    radius = model.base_radius[1]
    turning = model.inertia[1] * omega**2 * spectra["angle_driven"] / radius
    return np.asarray((spectra["torque_driven"] - turning) / radius)


def _force(model: NominalModel, spectra: Mapping[str, Complex], omega: Array) -> Complex:
    """Spectrum [N] of the mesh force by the nominal equation of the load, or of the drive for a record without it."""
    if "torque_driven" in spectra:
        return force_at_load(model, spectra, omega)
    rb1 = model.base_radius[0]
    turning = (model.inertia[0] + model.rotor) * omega**2 * spectra["angle_driver"] / rb1
    return np.asarray((spectra["torque_driver"] + turning) / rb1)


def _stiffness(model: NominalModel, force: float) -> float:
    """Secant stiffness [N/m] of the mesh at a force [N], mean over the cycle."""
    mean = model.hardened.force.mean(axis=0)
    return force / float(np.interp(force, mean, model.law.approach))


def _lever_arms(
    model: NominalModel, mesh_frequency: float, phase: Array, spectra: Mapping[str, Complex], omega: Array
) -> Array:
    """Lever arms of friction over base radius (3, N), for driver rotation, supports and driven rotation.

    The direction of sliding is that of the measured motion: vibration is as fast as the rolling teeth slide near the
    pitch point, and turns part of Coulomb's friction into damping.
    """
    law, n = model.law, phase.size
    numbers, carried = law.pairs(phase)[0], law.carried_at(phase)
    travel = (phase[:, None] - numbers) * law.base_pitch
    centre1, centre2 = law.pitch_roll
    rho1, rho2 = centre1 + travel, centre2 - travel
    rb1, rb2 = model.base_radius

    def rate(channel: str) -> Array:
        if channel not in spectra:
            return np.zeros(n)
        return np.asarray(np.fft.irfft(1j * omega * spectra[channel], n) * n)

    turn1, turn2 = (2 * np.pi * mesh_frequency / z for z in model.teeth)
    speed1, speed2 = turn1 + rate("angle_driver") / rb1, turn2 + rate("angle_driven") / rb2
    across = model.cross_factor * (rate("y_driver") - rate("y_driven"))
    sliding = rho1 * speed1[:, None] - rho2 * speed2[:, None] + across[:, None]
    weight = carried * np.tanh(sliding / model.transition)
    m1, m2 = (weight * rho1).sum(axis=-1), (weight * rho2).sum(axis=-1)
    factor = model.cross_factor / model.support_factor
    return np.stack([m1 / rb1, weight.sum(axis=-1) * factor, m2 / rb2])
