"""One realisation of a lumped experiment: settle from the static equilibrium, then average the steady
state."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import Schedule
from gearbench.lumped import Lumped
from gearbench.lumped.linear.runge_kutta import Tables, integrate, tabulate
from gearbench.rig import Experiment

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Setup:
    """What all realisations share: model, tables for `substeps` steps a sample, force per driver torque
    [1/m]."""

    model: Lumped
    tables: Tables
    substeps: int
    force_per_torque: float


@dataclass(frozen=True)
class SteadyState:
    """Mean over the recorded blocks, one block long.

    `outputs` (samples, 4): x, y1, y2 [m], mesh force [N]; `torque` (samples,) [N m] on the driver;
    `scatter` (4,) the rms of the departure of single blocks from the mean; `residual` the change of the
    DTE from the last settling block to the first recorded one, largest value over its standard deviation;
    `settling_periods` excitation periods.
    """

    outputs: Array
    torque: Array
    scatter: Array
    residual: float
    settling_periods: int


def tables_for(model: Lumped, plan: Schedule, substeps: int) -> Tables:
    """Mesh tables of the shortest run that holds whole numbers of steps and of mesh periods."""
    steps = substeps * plan.block_samples
    common = gcd(steps, plan.mesh_cycles)
    step = 1.0 / (plan.sampling_rate * substeps)
    return tabulate(model, cycles=plan.mesh_cycles // common, steps=steps // common, step=step)


def steady_state(setup: Setup, plan: Schedule, experiment: Experiment, torque: Torque) -> SteadyState:
    """Run one realisation. Raises BenchError if it does not settle within experiment.settling_periods_max."""
    fine = torque.sample(2 * setup.substeps * plan.samples_per_period)
    force = setup.force_per_torque * fine
    state = setup.model.equilibrium(setup.force_per_torque * torque.mean)
    state, before = _block(setup, plan, force, state)
    settling = plan.block_periods
    while True:
        state, block = _block(setup, plan, force, state)
        residual = _change(setup.model, before, block)
        if residual <= experiment.settling_tolerance:
            break
        settling += plan.block_periods
        if settling > experiment.settling_periods_max:
            raise BenchError(
                f"no steady state: after {settling} excitation periods the DTE still changes by"
                f" {residual:.3g} of its standard deviation from period to period, which"
                f" experiment.settling_tolerance limits to {experiment.settling_tolerance:g}; raise"
                f" settling_periods_max = {experiment.settling_periods_max} or the damping"
            )
        before = block
    mean, scatter = _average(setup, plan, force, state, block)
    coarse = np.tile(fine[:: 2 * setup.substeps], plan.block_periods)
    return SteadyState(mean, coarse, scatter, residual, settling)


def _block(setup: Setup, plan: Schedule, force: Array, state: Array) -> tuple[Array, Array]:
    """One block from its start: both tables repeat with it, so every block begins at their first entry."""
    return integrate(setup.tables, force, state, samples=plan.block_samples, substeps=setup.substeps)


def _dte(model: Lumped, outputs: Array) -> Array:
    return outputs[:, :3] @ model.output_vector[:3]


def _change(model: Lumped, before: Array, after: Array) -> float:
    """Largest change of the DTE between two blocks over its standard deviation.

    A DTE that hardly varies (constant torque and stiffness) is measured against a millionth of its mean
    instead.
    """
    dte = _dte(model, after)
    scale = max(float(dte.std()), 1e-6 * abs(float(dte.mean())), np.finfo(float).tiny)
    return float(np.abs(dte - _dte(model, before)).max()) / scale


def _average(setup: Setup, plan: Schedule, force: Array, state: Array, first: Array) -> tuple[Array, Array]:
    """Mean over all recorded blocks, of which `first` has been run, and the rms departure (4,) from it."""
    # Departures from the first block are small: their sums lose no digits.
    total, squares = np.zeros_like(first), np.zeros_like(first)
    for _ in range(plan.blocks - 1):
        state, block = _block(setup, plan, force, state)
        block -= first
        total += block
        block *= block
        squares += block
    total /= plan.blocks
    variance = squares / plan.blocks - total**2
    return first + total, np.sqrt(np.maximum(variance, 0.0).mean(axis=0))
