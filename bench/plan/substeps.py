"""Integration steps per sample of the lumped models."""

from __future__ import annotations

from math import pi

from gearbench.bench.plan.schedule import Schedule
from gearbench.lumped import choose_substeps
from gearbench.rig import Experiment, Simulation


def runge_kutta_substeps(
    fastest: float, experiment: Experiment, simulation: Simulation, plan: Schedule, coarser: float = 1.0
) -> int:
    """Steps per sample for modes up to `fastest` [rad/s]; of the excitation's, steps may be `coarser` by that factor.
    Raises LumpedError where the case asks for fewer."""
    # The forced response is a mode of that frequency as far as the time step is concerned.
    forced = 2 * pi * experiment.multisine.band[1] if experiment.multisine is not None else 0.0
    resolved = max(fastest, forced / coarser)
    return choose_substeps(resolved, plan.shortest_mesh_period, plan.sampling_rate, simulation.substeps)
