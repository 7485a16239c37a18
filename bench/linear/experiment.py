"""A whole experiment on the lumped model: all realisations, and the record that a rig would hand back.

The steady state repeats itself, so the record holds one block (the shortest run after which excitation
and mesh both repeat, mostly one excitation period), averaged over all recorded periods; attributes tell
how many and how much they scattered. That keeps a hundred realisations of four periods within a gigabyte.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.linear.run import Setup, SteadyState, steady_state, tables_for
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.schedule import ProgressReport, Schedule, schedule
from gearbench.bench.plan.workers import processors
from gearbench.bench.record.attributes import rig_attributes
from gearbench.bench.refusals.effects import is_nonlinear
from gearbench.geometry import Pair, body, pair
from gearbench.lumped import choose_substeps, lumped_model
from gearbench.lumped.stiffness.potential_energy import outside_foundation_fit
from gearbench.records import make_record, provenance
from gearbench.rig import Case, Rig, dump_case

Array = NDArray[np.float64]


def simulate_lumped(case: Case, progress: ProgressReport | None = None) -> xr.Dataset:
    """Record of the case's experiment on the lumped model.

    A rig with effects beyond the linear model, or a mesh law from finite elements, runs on the non-linear one (see
    `nonlinear_experiment`). Runs the realisations on all processors that this process may use; the result does not
    depend on their number. Raises BenchError, LumpedError or GeometryError (each one sentence) for what cannot be
    simulated.
    """
    if is_nonlinear(case):
        # Imported on use: it brings in the mesher.
        from gearbench.bench.nonlinear.experiment import simulate_nonlinear

        return simulate_nonlinear(case, progress)
    meshing = pair(case.rig)
    plan = schedule(case.experiment, case.rig)
    setup = _setup(case, meshing, plan)
    collected = _Collected(case.experiment.realisations, plan.block_samples)
    total = case.experiment.realisations
    with _workers(min(total, processors())) as pool:

        def run(number: int) -> int:
            torque = torque_realisation(case.experiment, number, case.rig)
            collected.put(number, steady_state(setup, plan, case.experiment, torque))
            return number

        futures = [pool.submit(run, number) for number in range(total)]
        for done, future in enumerate(as_completed(futures), start=1):
            future.result()
            if progress is not None:
                progress(done / total, f"realisation {done} of {total}")
    return _record(case, meshing, plan, setup, collected)


@contextmanager
def _workers(count: int) -> Iterator[ThreadPoolExecutor]:
    """Threads that drop what has not begun when the caller fails or is interrupted."""
    pool = ThreadPoolExecutor(count)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _setup(case: Case, meshing: Pair, plan: Schedule) -> Setup:
    model = lumped_model(case.rig, meshing, case.simulation)
    rate = model.fastest_rate()
    if case.experiment.multisine is not None:
        # The forced response is a mode of that frequency as far as the time step is concerned.
        rate = max(rate, 2 * np.pi * case.experiment.multisine.band[1])
    substeps = choose_substeps(rate, plan.mesh_period, plan.sampling_rate, case.simulation.substeps)
    return Setup(model, tables_for(model, plan, substeps), substeps, 1.0 / meshing.driver.base_radius)


class _Collected:
    """Arrays that the realisations fill, each its own row."""

    def __init__(self, realisations: int, samples: int) -> None:
        shape = (realisations, samples)
        self.torque, self.x, self.y1, self.y2, self.mesh_force = (np.empty(shape) for _ in range(5))
        self.scatter = np.empty((realisations, 4))
        self.residual = np.empty(realisations)
        self.settling_periods = np.empty(realisations, dtype=int)

    def put(self, row: int, result: SteadyState) -> None:
        """Store one realisation."""
        self.torque[row] = result.torque
        for target, column in zip((self.x, self.y1, self.y2, self.mesh_force), result.outputs.T, strict=True):
            target[row] = column
        self.scatter[row] = result.scatter
        self.residual[row] = result.residual
        self.settling_periods[row] = result.settling_periods


def _record(case: Case, meshing: Pair, plan: Schedule, setup: Setup, collected: _Collected) -> xr.Dataset:
    channels, scatter = _channels(case.rig, meshing, plan, setup, collected)
    attributes = {
        **_rig_attributes(case.rig, meshing),
        "sampling_rate": plan.sampling_rate,
        "samples_per_period": plan.samples_per_period,
        "periods": plan.block_periods,
        "periods_averaged": plan.blocks,
        "mesh_period": plan.mesh_period,
        "mesh_phase_origin": "geometry",
        "torque_mean": case.experiment.torque_mean,
        "settling_residual": float(collected.residual.max()),
        "settling_periods": int(collected.settling_periods.max()),
        "model": "lumped",
        "substeps": setup.substeps,
        "provenance": provenance(
            dump_case(case), case.experiment.seed, {"model": "lumped", "substeps": setup.substeps}
        ),
    }
    if case.simulation.mesh_stiffness == "potential-energy":
        attributes["warnings"] = "; ".join(outside_foundation_fit(case.rig, meshing)) or None
    details = {name: {"period_scatter": value} for name, value in scatter.items()}
    return make_record(channels, attributes, channel_attributes=details)


def _rig_attributes(rig: Rig, meshing: Pair) -> dict[str, Any]:
    density = rig.material.density
    bodies = (
        body(meshing.driver, rig.driver, density, "rig.driver"),
        body(meshing.driven, rig.driven, density, "rig.driven"),
    )
    return rig_attributes(rig, meshing, bodies)


def _channels(
    rig: Rig, meshing: Pair, plan: Schedule, setup: Setup, collected: _Collected
) -> tuple[Mapping[str, Array], Mapping[str, float]]:
    """Channels of the record and the rms scatter of each over the averaged blocks."""
    r1, r2 = meshing.driver.base_radius, meshing.driven.base_radius
    about = _rig_attributes(rig, meshing)
    mass = setup.model.mesh_mass
    free = rig.load.boundary == "torque"
    # Angle per x: 1/r1 and 0 if the driven gear turns steadily, else shared as the inertias are.
    share1 = mass * r1 / about["inertia_driver"]
    share2 = mass * r2 / about["inertia_driven"] if free else 0.0
    time = np.arange(plan.block_samples) / plan.sampling_rate
    phase = np.arange(plan.block_samples) * (plan.mesh_cycles / plan.block_samples)
    x, y1, y2 = collected.x, collected.y1, collected.y2
    factor = setup.model.support_factor
    channels = {
        "torque_driver": collected.torque,
        "torque_driven": collected.torque * (r2 / r1) if free else collected.mesh_force * r2,
        "angle_driver": plan.speed_driver * time + share1 * x,
        "angle_driven": plan.speed_driven * time - share2 * x,
        "y_driver": y1,
        "y_driven": y2,
        "mesh_phase": np.broadcast_to(phase, x.shape),
        "dte": x + factor * (y1 - y2),
        "force": collected.torque * setup.force_per_torque,
    }
    sx, s1, s2, sf = np.sqrt((collected.scatter**2).mean(axis=0))
    scatter = {
        "torque_driven": 0.0 if free else sf * r2,
        "angle_driver": share1 * sx,
        "angle_driven": share2 * sx,
        "y_driver": s1,
        "y_driven": s2,
    }
    return channels, {name: float(value) for name, value in scatter.items()}
