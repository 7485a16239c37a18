"""A truth rig on the test bench: settle, run, and write down what its sensors see."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, pi

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.fft import irfft, rfft, rfftfreq
from scipy.interpolate import CubicSpline
from scipy.signal import fftconvolve, firwin, kaiser_beta

from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.schedule import Schedule, schedule
from gearbench.bench.record.attributes import experiment_attributes, rig_attributes
from gearbench.bench.record.sensors import repeated, resampled
from gearbench.challenge.truth.levels import DELAYED, Foreign, Levels
from gearbench.challenge.truth.motion import integrate
from gearbench.challenge.truth.plant import (
    DEGREES,
    DRIVEN,
    DRIVER,
    LOAD,
    OUTPUTS,
    ROTOR,
    STATES,
    TWIST,
    X_DRIVEN,
    X_DRIVER,
    Y_DRIVEN,
    Y_DRIVER,
    Plant,
    Teeth,
)
from gearbench.challenge.truth.rigs import Bench, build_plant
from gearbench.challenge.truth.structure import Structure
from gearbench.records import make_record
from gearbench.rig import Condition, Sensors

Array = NDArray[np.float64]

SETTLING = 0.5  # excitation periods before the record begins
OVERSAMPLED = 4  # values per sample that delays are interpolated in, before the anti-alias filter
# Samples integrated beyond both ends of the record, half as long as the filter, which damps what would fold into the
# lower nine tenths of the band by 80 dB.
MARGIN, STOPPED = 40, 80.0
STEP = 0.6  # largest product of step and fastest angular frequency
DAMPED_STEP = 1.5  # of step and fastest rate of decay; RK4 is stable up to 2.8
IMPACT = 0.4, 4.0  # closing rate [m/s] and deflection, in references, of an impact


@dataclass(frozen=True)
class Run:
    """What the integrator handed out: `seen` (n, OUTPUTS) at `time` (n,) [s], OVERSAMPLED values a sample."""

    time: Array
    seen: Array
    command: Array  # (samples a period,) [N m] recorded torque before noise


def _stiffest(teeth: Teeth) -> float:
    """Tangent stiffness [N/m] of the mesh at most, of two pairs or of one in an impact."""
    return float(max(2.0, (1.0 + teeth.exponent) * IMPACT[1] ** teeth.exponent) * teeth.stiffness.max())


def fastest(plant: Plant) -> float:
    """An upper estimate of the fastest angular frequency [rad/s]."""
    mesh = _stiffest(plant.teeth)
    rows = [
        plant.coupling.stiffness / plant.inertia.rotor,
        (plant.coupling.stiffness + mesh * plant.base_driver**2) / plant.inertia.driver,
        (plant.shaft.stiffness + mesh * plant.base_driven**2) / plant.inertia.driven,
        *((plant.support[i] + mesh) / plant.mass[i // 2] for i in range(4)),
    ]
    return float(np.sqrt(max(rows)))


def fastest_decay(plant: Plant) -> float:
    """An upper estimate of the mesh's fastest rate of decay [1/s], in an impact."""
    teeth = plant.teeth
    damping = teeth.damping * max(1.0, 1.0 - teeth.damping_load + teeth.damping_load * IMPACT[1])
    damping += teeth.damping_quadratic * IMPACT[0]
    mobility = plant.base_driver**2 / plant.inertia.driver + plant.base_driven**2 / plant.inertia.driven
    return float(damping * _stiffest(teeth) * (mobility + (1.0 / np.array(plant.mass)).sum()))


def steps_per_sample(plant: Plant, rate: float) -> int:
    """Integration steps per sample at `rate` [Hz]: a multiple of OVERSAMPLED."""
    needed = max(fastest(plant) / STEP, fastest_decay(plant) / DAMPED_STEP) / rate
    return OVERSAMPLED * max(2, ceil(needed / OVERSAMPLED))


def filtered(values: Array, foreign: Foreign, period: float) -> Array:
    """One period of a signal behind the torque filter."""
    ratio = rfftfreq(values.size, period / values.size) / foreign.filter_frequency
    if foreign.filter_order == 1:
        gain = 1.0 / (1.0 + 1j * ratio)
    else:
        gain = 1.0 / (1.0 - ratio**2 + 1j * np.sqrt(2.0) * ratio)
    return np.asarray(irfft(rfft(values) * gain, values.size))


def start_state(plant: Plant, torque: Array, step: float, first: int) -> Array:
    """Equilibrium under the mean torque, and the rigid turning of the whole train under the rest of it.

    Without the latter the load would begin with a turning that only the governor damps, slowly.
    """
    state = np.zeros(STATES)
    mean = float(torque.mean())
    force = mean / plant.base_driver
    lift = np.array([-plant.sine, -plant.cosine, plant.sine, plant.cosine]) * force / plant.support
    state[X_DRIVER : Y_DRIVEN + 1] = lift
    ratio = plant.base_driver / plant.base_driven
    inertia = plant.inertia.driven + plant.inertia.load + (plant.inertia.rotor + plant.inertia.driver) / ratio**2
    points = torque.size
    spectrum = rfft(torque - mean) / ratio
    omega = 2 * pi * rfftfreq(points, 0.5 * step)
    governor = plant.governor
    turning = spectrum / (governor.stiffness - inertia * omega**2 + 1j * omega * governor.damping)
    at = 2 * pi * ((2 * first) % points) * np.arange(turning.size) / points
    waves = 2.0 / points * turning * np.exp(1j * at)
    driven, speed = float(waves.real.sum()), float((1j * omega * waves).real.sum())
    state[DRIVEN], state[LOAD] = driven + mean / ratio / plant.shaft.stiffness, driven
    near = plant.teeth.stiffness.max() * 1.4
    across = (state[Y_DRIVER] - state[Y_DRIVEN]) * plant.cosine + (state[X_DRIVER] - state[X_DRIVEN]) * plant.sine
    state[DRIVER] = (force / near - across + plant.base_driven * state[DRIVEN]) / plant.base_driver
    state[TWIST] = mean / plant.coupling.stiffness
    state[ROTOR] = state[DRIVER] + state[TWIST]
    state[DEGREES + DRIVEN] = state[DEGREES + LOAD] = speed
    state[DEGREES + ROTOR] = state[DEGREES + DRIVER] = speed / ratio
    return state


def run_condition(bench: Bench, rig: Structure, levels: Levels, condition: Condition, finer: int = 1) -> Run:
    """Integrate one condition; `finer` multiplies the number of steps."""
    experiment, plan = condition.experiment, schedule(condition.experiment, bench.nominal.rig)
    plant = build_plant(bench, rig, levels, experiment)
    substeps = finer * steps_per_sample(plant, plan.sampling_rate)
    step = 1.0 / (plan.sampling_rate * substeps)
    period = plan.samples_per_period / plan.sampling_rate
    points = 2 * substeps * plan.samples_per_period
    if condition.name in bench.torques:
        torque = resampled(bench.torques[condition.name], points)
    else:
        torque = torque_realisation(experiment, 0, bench.nominal.rig).sample(points)
    command = torque[:: 2 * substeps].copy()
    if levels.foreign.filter_frequency:
        behind = filtered(torque, levels.foreign, period)
        torque, command = (behind, command) if levels.foreign.filter_acting else (torque, behind[:: 2 * substeps])
    settling = int(SETTLING * plan.samples_per_period) * substeps
    begin = -MARGIN * substeps
    state = start_state(plant, torque, step, begin - settling)
    state, _ = integrate(plant, torque, state, step=step, first=begin - settling, outputs=1, stride=settling)
    stride = substeps // OVERSAMPLED
    count = OVERSAMPLED * (plan.record_samples + 2 * MARGIN)
    _, seen = integrate(plant, torque, state, step=step, first=begin, outputs=count, stride=stride)
    time = np.asarray((begin + stride * np.arange(count)) * step, dtype=np.float64)
    return Run(time, seen, np.ascontiguousarray(command))


def measure(
    bench: Bench, rig: Structure, levels: Levels, condition: Condition, name: str, rng: np.random.Generator
) -> xr.Dataset:
    """The record of one condition: delayed and noisy channels, attributes of the nominal rig, provenance of the
    challenge `name` and nothing else."""
    plan = schedule(condition.experiment, bench.nominal.rig)
    run = run_condition(bench, rig, levels, condition)
    channels = _channels(run, plan, levels, (bench.meshing.driver.base_radius, bench.meshing.driven.base_radius))
    return make_record(noisy(channels, bench.nominal.rig.sensors, rng), attributes_of(bench, condition, plan, name))


def noisy(channels: Mapping[str, Array], sensors: Sensors, rng: np.random.Generator) -> dict[str, Array]:
    """Channels (1, N) with the noise of their sensors."""
    noise = {"angle": sensors.noise_angle, "y": sensors.noise_displacement, "torque": sensors.noise_torque}
    return {
        key: (values + noise[key.split("_")[0]] * rng.standard_normal(values.size))[None]
        for key, values in channels.items()
    }


def _channels(run: Run, plan: Schedule, levels: Levels, radii: tuple[float, float]) -> dict[str, Array]:
    samples = plan.record_samples
    time = np.arange(samples) / plan.sampling_rate
    delay = dict(zip(DELAYED, levels.delay, strict=True))
    speed = {"angle_driver": plan.speed_driver, "angle_driven": plan.speed_driven}
    channels = {"torque_driver": repeated(run.command, samples)}
    for name in ("torque_driven", *DELAYED):
        values, late = run.seen[:, OUTPUTS.index(name)], delay.get(name, 0.0)
        seen = CubicSpline(run.time, values)(run.time - late) if late else values
        channels[name] = sampled(seen) + speed.get(name, 0.0) * (time - late)
    for name, radius, size, phase in zip(speed, radii, levels.encoder, levels.encoder_phase, strict=True):
        channels[name] = channels[name] + size / radius * np.cos(channels[name] - phase)
    return channels


def sampled(values: Array) -> Array:
    """The samples (samples,) of values (OVERSAMPLED (samples + 2 MARGIN),) behind a linear-phase anti-alias filter, its
    delay taken back (Kaiser, in System Analysis by Digital Computer, 1966)."""
    taps = 2 * MARGIN * OVERSAMPLED + 1
    kernel = firwin(taps, 1 / OVERSAMPLED, window=("kaiser", kaiser_beta(STOPPED)))
    mean = values.mean()
    return np.asarray(mean + fftconvolve(values - mean, kernel, mode="valid")[::OVERSAMPLED])


def attributes_of(bench: Bench, condition: Condition, plan: Schedule, name: str) -> dict[str, object]:
    """Attributes of a case's record: of the nominal rig, and its name in the challenge."""
    return {
        **rig_attributes(bench.nominal.rig, bench.meshing),
        **experiment_attributes(plan, plan.periods, condition.experiment.torque_mean),
        "condition": condition.name,
        "provenance": json.dumps({"challenge": name}),
    }
