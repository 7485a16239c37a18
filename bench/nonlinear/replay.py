"""A record's own torque on the non-linear lumped model of a rig: what that rig would have answered."""

from __future__ import annotations

from math import ceil, log

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.nonlinear.experiment import attributes_of, channels_of, signals_of
from gearbench.bench.nonlinear.mesh_law import mesh_law
from gearbench.bench.nonlinear.run import HEADROOM, Setup, change, make_setup
from gearbench.bench.plan.schedule import schedule
from gearbench.bench.record.attributes import lost_contact
from gearbench.bench.record.sensors import Signal, check_delays, delayed, measured
from gearbench.geometry import pair
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.step import columns
from gearbench.records import make_record
from gearbench.rig import Case, Experiment, Sensors

Array = NDArray[np.float64]

TRANSIENT = 1e-6  # of its first size, that free vibrations keep when the first period begins
TOLERANCE = 1e-4  # change of the DTE over its standard deviation from period to period
PERIODS_MAX = 6


def replay(case: Case, record: xr.Dataset, law: MeshLaw | None = None, realisation: int = 0) -> xr.Dataset:
    """One steady period of the case's rig under the record's torque, speed, sampling and starting mesh phase.

    The torque is the mean over the record's periods of one realisation, as a trigonometric sum; where the rig's torque
    sensor lags, the torque on the rig leads what was recorded. Delays of the rig's sensors are applied, noise is not.
    Where teeth differ and the excitation period does not hold all pairings, the result is as long as they take.
    Attribute `settling_residual` is the change of the DTE over the last two periods; a motion that does not settle is
    returned with a warning. Raises BenchError for a record that says too little.
    """
    rate, samples, periods = (record.attrs[key] for key in ("sampling_rate", "samples_per_period", "periods"))
    samples, periods, rate = int(samples), int(periods), float(rate)
    torque = record["torque_driver"].values[realisation].reshape(periods, samples).mean(axis=0)
    torque = delayed(Signal(torque[None]), -case.rig.sensors.delay_torque_driver, rate).swing[0]
    frequency, phase = _rotation(case, record, realisation)
    experiment = _experiment(case.experiment, torque, frequency, rate, samples, periods)
    meshing = pair(case.rig)
    law = law or mesh_law(case.rig, case.simulation, HEADROOM * float(np.abs(torque).max()))
    plan = schedule(experiment, case.rig)
    setup = make_setup(case.rig, case.simulation, experiment, meshing, plan, law, phase)
    check_delays(case.rig, setup.repeats, setup.block_samples / rate)
    force = resampled(torque, 2 * setup.substeps * samples) / meshing.driver.base_radius
    outputs, residual = _settled(setup, force)
    quiet = case.rig.sensors.model_copy(update={name: 0.0 for name in Sensors.model_fields if name.startswith("noise")})
    rig = case.rig.model_copy(update={"sensors": quiet})
    signals = signals_of(setup, np.resize(torque, len(outputs))[None], outputs[None])
    seen = measured(signals, rig, rate, seed=0, samples=len(outputs), samples_per_period=samples)
    unsettled = None if residual <= TOLERANCE else f"the DTE still changes by {residual:.3g} from period to period"
    lost = int((columns(outputs).mesh_force == 0).sum())
    attributes = {
        **attributes_of(case.rig, meshing),
        "sampling_rate": rate,
        "samples_per_period": samples,
        "periods": len(outputs) // samples,
        "mesh_period": 1.0 / frequency,
        "mesh_phase_origin": "geometry",
        "torque_mean": float(torque.mean()),
        "settling_residual": residual,
        "contact_lost_samples": lost,
        "warnings": "; ".join(filter(None, (lost_contact(lost, len(outputs)), unsettled))) or None,
        "model": "lumped",
        "mesh": "non-linear",
        "substeps": setup.substeps,
    }
    return make_record(channels_of(setup, seen), attributes)


def resampled(period: Array, points: int) -> Array:
    """The trigonometric sum through the samples of one period, at `points` instants, a multiple of their number."""
    samples = period.size
    spectrum = np.fft.rfft(period)
    if samples % 2 == 0 and points > samples:
        spectrum[-1] *= 0.5  # the highest line and its mirror image share it
    return np.asarray(np.fft.irfft(spectrum, n=points) * (points / samples))


def _rotation(case: Case, record: xr.Dataset, realisation: int) -> tuple[float, float]:
    """Mesh frequency [Hz], such that the record holds whole cycles, and mesh phase of the first sample [cycles]."""
    rate = float(record.attrs["sampling_rate"])
    if "mesh_phase" in record:
        phase = record["mesh_phase"].values[realisation]
        first, speed = float(phase[0]), float(phase[-1] - phase[0]) / (len(phase) - 1)
    elif record.attrs.get("mesh_phase_origin") == "geometry" and "angle_driven" in record:
        angle = record["angle_driven"].values[realisation] * case.rig.driven.teeth / (2 * np.pi)
        speed, first = (float(value) for value in np.polyfit(np.arange(angle.size), angle, 1))
        first += speed * rate * case.rig.sensors.delay_angle_driven
    else:
        raise BenchError(
            'the record has no channel mesh_phase, and mesh_phase_origin is not "geometry": its mesh phase is unknown'
        )
    total = record.sizes["time"]
    cycles = round(speed * total)
    if cycles < 1 or abs(speed * total - cycles) > 0.01:
        raise BenchError(f"the record holds {speed * total:.6g} mesh periods, which must be a whole number")
    return cycles * rate / total, first


def _experiment(
    base: Experiment, torque: Array, frequency: float, rate: float, samples: int, periods: int
) -> Experiment:
    """The record's experiment, as far as step and tables ask for it."""
    values = {"mesh_frequency": frequency, "speed_driver": None, "torque_mean": float(torque.mean())}
    values |= {"sampling_rate": rate, "samples_per_period": samples, "periods": periods}
    if base.multisine is not None and base.multisine.band[1] >= rate / 2:
        values["multisine"] = None
    return base.model_copy(update=values)


def _settled(setup: Setup, force: Array) -> tuple[Array, float]:
    """Outputs (samples, 7) of one repetition after free vibrations have died out, and how steady it is."""
    mean = float(force.mean())
    block = setup.block_samples
    decay = setup.model.slowest_decay(mean)
    early = min(ceil(log(1 / TRANSIENT) / max(decay, 1e-9) * setup.sampling_rate), block)
    state, _ = setup.advance(force, setup.at_rest(mean, -early), -early, early)
    end, outputs = setup.advance(force, state, 0, block)
    residual = _unsteady(setup, state, end, outputs)
    for _ in range(PERIODS_MAX):
        if residual <= TOLERANCE:
            break
        before = outputs
        end, outputs = setup.advance(force, end, 0, block)
        residual = change(setup.dte(before), setup.dte(outputs))
    return outputs, residual


def _unsteady(setup: Setup, start: Array, end: Array, outputs: Array) -> float:
    """How far the state has not come back, in deflection over its standard deviation and velocity likewise."""
    mesh = np.array([1.0, setup.model.factor, -setup.model.factor, -1.0])
    dte = setup.dte(outputs)
    scale = max(float(dte.std()), 1e-6 * abs(float(dte.mean())))
    rate = max(float(np.diff(dte).std()) * setup.sampling_rate, 1e-6 * scale)
    moved, sped = (end - start)[:4] @ mesh, (end - start)[5:9] @ mesh
    return float(max(abs(moved) / scale, abs(sped) / rate))
