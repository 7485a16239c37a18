"""A whole experiment on the non-linear lumped model, with all effects of the rig and its sensors.

Channels are what sensors on the rig would show: torque_driver is the commanded torque, without ripple; dte and force
are computed from the measured channels. All excitation periods are kept, since their noise differs. What the model
leaves out is listed in `lumped.nonlinear.LIMITS` and in the record's attribute `limits`.
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.nonlinear.run import Setup, Steady, make_setup, steady_state
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.schedule import ProgressReport, Schedule, schedule
from gearbench.bench.plan.workers import realisations
from gearbench.bench.record.attributes import lost_contact, rig_attributes
from gearbench.bench.record.sensors import Signal, check_delays, measured
from gearbench.geometry import Pair, body, pair
from gearbench.lumped.nonlinear.model import LIMITS
from gearbench.lumped.nonlinear.step import columns
from gearbench.lumped.stiffness.potential_energy import outside_foundation_fit
from gearbench.records import make_record, provenance
from gearbench.rig import Case, Rig, dump_case

Array = NDArray[np.float64]


def simulate_nonlinear(case: Case, progress: ProgressReport | None = None) -> xr.Dataset:
    """Record of the case's experiment on the non-linear lumped model.

    Raises BenchError, LumpedError, ContactError or GeometryError (each one sentence) for what cannot be simulated.
    """
    meshing = pair(case.rig)
    plan = schedule(case.experiment, case.rig)
    if progress is not None:
        progress(0.0, "mesh law")
    setup = make_setup(case.rig, case.simulation, case.experiment, meshing, plan)
    check_delays(case.rig, setup.repeats, setup.block_samples / plan.sampling_rate)
    samples = plan.blocks * plan.block_samples
    total = case.experiment.realisations
    lock, done, stop = threading.Lock(), [0], threading.Event()

    def run(number: int) -> tuple[Array, Steady]:
        if stop.is_set():
            raise InterruptedError("another realisation has failed, or the run was interrupted")
        torque = torque_realisation(case.experiment, number, case.rig)
        result = steady_state(setup, case.experiment, torque, samples)
        with lock:
            done[0] += 1
            if progress is not None:
                progress(done[0] / total, f"realisation {done[0]} of {total}")
        return torque.sample(plan.samples_per_period), result

    runs = realisations(run, total, stop)
    return _record(case, meshing, plan, setup, runs)


def signals_of(setup: Setup, torque: Array, outputs: Array) -> dict[str, Signal]:
    """True channels from torques (R, samples) [N m] and outputs (R, samples, 7) of the integrator."""
    seen = columns(outputs)
    r1, r2 = setup.model.base_radii
    rate = 2 * np.pi * setup.cycles_per_sample * setup.sampling_rate
    return {
        "torque_driver": Signal(torque),
        "torque_driven": Signal(seen.load_force * r2),
        "angle_driver": Signal(seen.u1 / r1, rate / setup.model.rig.driver.teeth),
        "angle_driven": Signal(seen.u2 / r2, rate / setup.model.rig.driven.teeth),
        "y_driver": Signal(seen.y1),
        "y_driven": Signal(seen.y2),
    }


def channels_of(setup: Setup, signals: dict[str, Signal]) -> dict[str, Array]:
    """Channels of a record; steady rotations begin at the angles of the first sample's mesh phase."""
    shape = signals["torque_driver"].swing.shape
    number = np.arange(shape[-1])
    time = (number + setup.first_phase / setup.cycles_per_sample) / setup.sampling_rate
    out = {name: s.swing + s.ramp * time if s.ramp else s.swing for name, s in signals.items()}
    r1, r2 = setup.model.base_radii
    swing = {name: s.swing for name, s in signals.items()}
    out["mesh_phase"] = np.broadcast_to(setup.first_phase + number * setup.cycles_per_sample, shape)
    turned = r1 * swing["angle_driver"] - r2 * swing["angle_driven"]
    out["dte"] = turned + setup.model.factor * (swing["y_driver"] - swing["y_driven"])
    out["force"] = swing["torque_driver"] / r1
    return out


def attributes_of(rig: Rig, meshing: Pair) -> dict[str, Any]:
    """What the record says about the rig; a rotor that turns with the driver counts as part of it."""
    density = rig.material.density
    bodies = (
        body(meshing.driver, rig.driver, density, "rig.driver"),
        body(meshing.driven, rig.driven, density, "rig.driven"),
    )
    about = rig_attributes(rig, meshing, bodies)
    coupling = rig.drive.coupling
    if coupling is not None and coupling.stiffness is None:
        about["inertia_driver"] += coupling.inertia
    return about


def _record(case: Case, meshing: Pair, plan: Schedule, setup: Setup, runs: list[tuple[Array, Steady]]) -> xr.Dataset:
    outputs = np.stack([result.outputs for _, result in runs])
    periods = plan.blocks * plan.block_periods
    samples = periods * plan.samples_per_period
    torque = np.stack([np.resize(period, outputs.shape[1]) for period, _ in runs])
    signals = measured(
        signals_of(setup, torque, outputs),
        case.rig,
        plan.sampling_rate,
        seed=case.experiment.seed,
        samples=samples,
        samples_per_period=plan.samples_per_period,
    )
    lost = int(np.resize(columns(outputs).mesh_force == 0, (len(runs), samples)).sum())
    settings = {"model": "lumped", "mesh": "non-linear", "substeps": setup.substeps}
    warnings = [lost_contact(lost, len(runs) * samples) or ""]
    if case.simulation.mesh_stiffness == "potential-energy":
        warnings += outside_foundation_fit(case.rig, meshing)
    attributes = {
        **attributes_of(case.rig, meshing),
        "sampling_rate": plan.sampling_rate,
        "samples_per_period": plan.samples_per_period,
        "periods": periods,
        "mesh_period": plan.mesh_period,
        "mesh_phase_origin": "geometry",
        "torque_mean": case.experiment.torque_mean,
        "settling_residual": max(result.residual for _, result in runs),
        "settling_periods": max(result.settling_periods for _, result in runs),
        "contact_lost_samples": lost,
        "warnings": "; ".join(filter(None, warnings)) or None,
        "limits": "; ".join(LIMITS),
        "model": "lumped",
        "mesh": "non-linear",
        "substeps": setup.substeps,
        "provenance": provenance(dump_case(case), case.experiment.seed, settings),
    }
    return make_record(channels_of(setup, signals), attributes)
