"""A record's own torque and driven rotation on the non-linear lumped model of a rig: what that rig would have
answered."""

from __future__ import annotations

from math import ceil, log
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.fft import irfft, rfft

from gearbench.bench.errors import BenchError
from gearbench.bench.nonlinear.followed import Followed, followed, follows, guide_of
from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.nonlinear.run import HEADROOM, Setup, make_setup
from gearbench.bench.plan.schedule import Schedule, schedule
from gearbench.bench.plan.settling import change
from gearbench.bench.protocol import Channels, Drive
from gearbench.bench.record.attributes import experiment_attributes, rig_attributes, shown_mean, turning_inertias
from gearbench.bench.record.channels import mesh_phases, sensed, with_rotation
from gearbench.bench.record.remarks import joined, lost_contact
from gearbench.bench.record.sensors import check_delays, imposed, lag, repeated, resampled
from gearbench.geometry import pair
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.rest import mesh_direction
from gearbench.lumped.nonlinear.step import columns
from gearbench.records import make_record
from gearbench.rig import Case, Experiment, Sensors

Array = NDArray[np.float64]

TRANSIENT = 1e-6  # of its first size, that free vibrations keep when the first period begins
TOLERANCE = 1e-4  # change of the DTE over its standard deviation from period to period
PERIODS_MAX = 6


class Given(NamedTuple):
    """What a record imposes on a rig: the case, its experiment being the record's; the schedule; mean torque on the rig
    over one excitation period (samples,) [N m]; mesh frequency [Hz] and mesh phase [cycles] of the first sample; how
    the driven gear turns, None where steadily; whether that phase is the nominal rotation's, else the driven gear's;
    whether its samples are those of instants, as of a simulation, not of sensors that hold no more than half the
    sampling rate."""

    case: Case
    plan: Schedule
    torque: Array
    frequency: float
    phase: float
    turning: Followed | None
    nominal: bool
    instants: bool


class Steady(NamedTuple):
    """A rig in the steady motion of a record: its setup, what drives it, one repetition of outputs (samples, n) and of
    the force at the load's base circle (samples,) [N] as a sensor shows it, the state (2 size,) at its first sample,
    how steady that is, and what the record imposes."""

    setup: Setup
    drive: Drive
    outputs: Array
    load_force: Array
    state: Array
    residual: float
    given: Given


def given_by(case: Case, record: xr.Dataset, realisation: int = 0) -> Given:
    """What one realisation of a record imposes on the case's rig. Raises BenchError for a rig that does not let it act,
    and for a record that says too little."""
    if case.rig.drive.boundary != "torque":
        raise BenchError(
            f'a replay imposes the recorded driver torque, which rig.drive.boundary = "{case.rig.drive.boundary}" does'
            ' not let act: set "torque"'
        )
    rate, samples, periods = (record.attrs[key] for key in ("sampling_rate", "samples_per_period", "periods"))
    samples, periods, rate = int(samples), int(periods), float(rate)
    torque = record["torque_driver"].values[realisation].reshape(periods, samples).mean(axis=0)
    torque = imposed(torque[None], case.rig.sensors, rate)[0]
    frequency, phase = _rotation(case, record, realisation)
    experiment = _experiment(case.experiment, torque, frequency, rate, samples, periods)
    case = case.model_copy(update={"experiment": experiment})
    plan = schedule(experiment, case.rig)
    check_delays(case.rig, plan.wraps, plan.repeat_time)
    turning = None
    if follows(case.rig, record) and plan.repeat_periods == 1:
        turning = followed(case.rig, record, realisation, plan.cycles_per_sample, phase)
    nominal = "mesh_phase" in record and turning is None
    return Given(case, plan, torque, frequency, phase, turning, nominal, "model" in record.attrs)


def steady_motion(
    case: Case, record: xr.Dataset, law: MeshLaw | None = None, realisation: int = 0, nudge: float = 0.0,
    coarser: float = 1.0,
) -> Steady:  # fmt: skip
    """The steady motion of the case's rig under the record's torque, as its sensors would not show it; arguments and
    refusals as those of `replay`."""
    if nudge and "angle_driver" not in record:
        raise BenchError("a replay can be nudged towards angle_driver only, a channel that the record does not have")
    given = given_by(case, record, realisation)
    case, torque = given.case, given.torque
    law = law or mesh_law(case.rig, case.simulation, HEADROOM * float(np.abs(torque).max()))
    guide = None
    if nudge:
        guide = guide_of(case.rig, record, realisation, given.plan.cycles_per_sample, given.phase, given.turning)
    setup = make_setup(
        case, given.plan, law, given.phase, given.turning, nominal=given.nominal, guide=guide, nudge=nudge,
        coarser=coarser,
    )
    drive = Drive(torque, resampled(torque, 2 * setup.substeps * torque.size) / setup.meshing.driver.base_radius)
    load_forces = np.empty(setup.substeps * setup.block_samples)
    outputs, state, residual = _settled(setup, drive, load_forces)
    shown = columns(outputs).load_force if given.instants else seen_at(load_forces, len(outputs))
    return Steady(setup, drive, outputs, np.asarray(shown, dtype=float), state, residual, given)


def replay(
    case: Case, record: xr.Dataset, law: MeshLaw | None = None, realisation: int = 0, nudge: float = 0.0,
    coarser: float = 1.0,
) -> xr.Dataset:  # fmt: skip
    """One steady period of the case's rig under the record's torque, rotation of the driven gear, sampling and starting
    mesh phase.

    The torque is the mean over the record's periods of one realisation, as a trigonometric sum; gain, delay and filter
    of the rig's torque sensor are taken back for the torque on the rig. Where the rig prescribes the driven gear's
    speed, it turns as recorded, whatever holds the load (`bench.nonlinear.followed`). What the rig's sensors do is
    applied, but for noise and quantisation. Where teeth differ and the excitation period does not hold all pairings,
    the result is as long as they take; where the mesh stiffness drifts, as long as the record. A `nudge` [N s/m] is a
    damper between the driver and its recorded motion, less its mean rate, that keeps flanks which part on the record's
    way (Abarbanel et al., SIAM J. Appl. Dyn. Syst. 8, 2009). Steps may be `coarser` than those of a simulation.
    Attribute `settling_residual` is the change of the DTE over the last two periods; a motion that does not settle is
    returned with a warning. Raises BenchError for a record that says too little.
    """
    return seen_of(case, steady_motion(case, record, law, realisation, nudge, coarser))


def seen_of(case: Case, steady: Steady) -> xr.Dataset:
    """The record of a steady motion of the case's rig, as `replay` has it."""
    setup, outputs = steady.setup, steady.outputs
    applied = repeated(steady.given.torque, len(outputs))
    channels = setup.channels(outputs, applied)
    turned = 2 * np.pi * setup.departures(len(outputs))
    channels = channels._replace(
        torque_driver=applied,
        torque_driven=steady.load_force * setup.meshing.driven.base_radius,
        angle_driver=channels.angle_driver + turned / case.rig.driver.teeth,
        angle_driven=channels.angle_driven + turned / case.rig.driven.teeth,
    )
    about = {"model": "lumped", "mesh": "non-linear", "substeps": setup.substeps,
             "unloaded_samples": int(setup.unloaded(outputs).sum())}  # fmt: skip
    lost = int(setup.apart(outputs).sum())
    return answer(steady.given, channels, steady.residual, lost, about)


def answer(
    given: Given, channels: Channels, residual: float, lost: int, about: dict[str, Any]
) -> xr.Dataset:
    """The record of a replay: `channels` (samples,) of the rig without its steady rotation, which still changed by
    `residual` and lost contact in so many samples, as the rig's sensors show them without noise; `about` the model."""
    case, plan, phase = given.case, given.plan, given.phase
    meshing, samples = pair(case.rig), len(channels.dte)
    swings = {name: values for name, values in channels._asdict().items() if name != "tooth_force"}
    rows = {name: values[None] for name, values in swings.items() if values is not None}
    quiet = case.rig.model_copy(update={"sensors": _quiet(case.rig.sensors)})
    shown = sensed(rows, quiet, meshing, plan, samples=samples, seed=0, first=phase)
    seen = with_rotation(shown, plan, phase)
    seen["mesh_phase"] = mesh_phases(plan, samples, phase)[None] + case.rig.sensors.mesh_phase_zero
    unsettled = None if residual <= TOLERANCE else f"the DTE still changes by {residual:.3g} from period to period"
    inertias = turning_inertias(case.rig, meshing)
    attributes = {
        **rig_attributes(case.rig, meshing),
        **experiment_attributes(plan, samples // plan.samples_per_period,
                                shown_mean(case.rig, float(given.torque.mean()))),
        "inertia_driver": inertias[0],
        "inertia_driven": inertias[1],
        "mesh_period": 1.0 / given.frequency,
        "settling_residual": residual,
        "contact_lost_samples": lost,
        "warnings": joined(lost_contact(lost, samples), unsettled),
        **about,
    }  # fmt: skip
    return make_record(seen, attributes)


def _quiet(sensors: Sensors) -> Sensors:
    """The sensors without their noise and steps."""
    names = [name for name in Sensors.model_fields if name.startswith(("noise", "quantisation"))]
    return sensors.model_copy(update=dict.fromkeys(names, 0.0))


def seen_at(fine: NDArray[np.floating[Any]], samples: int, axis: int = -1) -> NDArray[np.floating[Any]]:
    """What a sensor behind an anti-aliasing filter shows at `samples` instants of one period that is given at a
    multiple of them along an axis: teeth that come into contact make the force in the mesh jump."""
    lines = rfft(fine, axis=axis).take(range(samples // 2 + 1), axis=axis)
    return np.asarray(irfft(lines, samples, axis=axis) * fine.dtype.type(samples / fine.shape[axis]))


def _rotation(case: Case, record: xr.Dataset, realisation: int) -> tuple[float, float]:
    """Mesh frequency [Hz], such that the record holds whole cycles, and mesh phase of the first sample [cycles]."""
    rate, total = float(record.attrs["sampling_rate"]), record.sizes["time"]
    sensors, lagging = case.rig.sensors, 0.0
    if "mesh_phase" in record:
        turned = record["mesh_phase"].values[realisation]
    elif record.attrs.get("mesh_phase_origin") == "geometry" and "angle_driven" in record:
        turned = record["angle_driven"].values[realisation] * case.rig.driven.teeth / (2 * np.pi)
        lagging = lag(sensors, "angle_driven")
    else:
        raise BenchError(
            'the record has no channel mesh_phase, and mesh_phase_origin is not "geometry": its mesh phase is unknown'
        )
    # Gears that a load lets swing are elsewhere at both ends of a record than they turn to.
    if "mesh_period" in record.attrs:
        held = total / (rate * float(record.attrs["mesh_period"]))
    else:
        held = float(np.polyfit(np.arange(total), turned, 1)[0]) * total
    cycles = round(held)
    if cycles < 1 or abs(held - cycles) > 0.01:
        raise BenchError(f"the record holds {held:.6g} mesh periods, which must be a whole number")
    frequency = cycles * rate / total
    first = float(np.mean(turned - np.arange(total) * (cycles / total))) + frequency * lagging
    return frequency, first - sensors.mesh_phase_zero


def _experiment(
    base: Experiment, torque: Array, frequency: float, rate: float, samples: int, periods: int
) -> Experiment:
    """The record's experiment, as far as step and tables ask for it."""
    values: dict[str, Any] = {"torque_mean": float(torque.mean())}
    values |= {"sampling_rate": rate, "samples_per_period": samples, "periods": periods}
    if base.multisine is not None and base.multisine.band[1] >= rate / 2:
        values["multisine"] = None
    return base.at_mesh_frequency(frequency).model_copy(update=values)


def _settled(setup: Setup, drive: Drive, load_forces: Array) -> tuple[Array, Array, float]:
    """Outputs (samples, n) of one repetition after free vibrations have died out, with the `load_forces` (steps,) [N]
    of its steps, the state (2 size,) at its first sample, and how steady it is; of a rig that drifts, what is left of
    free vibrations."""
    mean = float(drive.fine.mean())
    block = setup.block_samples
    decay = setup.model.slowest_decay(mean)
    early = min(ceil(log(1 / TRANSIENT) / max(decay, 1e-9) * setup.sampling_rate), block)
    begin, _ = setup.advance(drive, setup.at_rest(mean, -early), early)
    end, outputs = setup.advance(drive, begin, block, load_forces)
    if setup.model.rig.mesh.stiffness_drift:
        return outputs, begin.values, TRANSIENT
    residual = _unsteady(setup, begin.values, end.values, outputs)
    for _ in range(PERIODS_MAX):
        if residual <= TOLERANCE:
            break
        before, begin = outputs, end
        end, outputs = setup.advance(drive, end, block, load_forces)
        residual = change(setup.dte(before), setup.dte(outputs))
    return outputs, begin.values, residual


def _unsteady(setup: Setup, start: Array, end: Array, outputs: Array) -> float:
    """How far the state has not come back, in deflection over its standard deviation and velocity likewise."""
    mesh = mesh_direction(setup.model.constants(), setup.model.structure)
    dte = setup.dte(outputs)
    scale = max(float(dte.std()), 1e-6 * abs(float(dte.mean())))
    rate = max(float(np.diff(dte).std()) * setup.sampling_rate, 1e-6 * scale)
    moved, sped = (end - start)[: mesh.size] @ mesh, (end - start)[mesh.size :] @ mesh
    return float(max(abs(moved) / scale, abs(sped) / rate))
