"""Where an experiment meets a solver."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

import xarray as xr

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import ProgressReport
from gearbench.bench.readiness import check_gears
from gearbench.rig import Case

Simulator = Callable[[Case, ProgressReport | None], xr.Dataset]

# Each model: module and function. Imported on use: one brings in Numba, the other the mesher.
SIMULATORS: dict[str, tuple[str, str]] = {
    "lumped": ("gearbench.bench.linear.experiment", "simulate_lumped"),
    "reduced": ("gearbench.bench.elastic.experiment", "simulate_reduced"),
}


def simulate(case: Case, model: str | None = None, progress: ProgressReport | None = None) -> xr.Dataset:
    """Record of the case's experiment, simulated with `model` (absent: the case's own).

    `progress(fraction, note)` is called now and then. A case with conditions has one experiment for each:
    simulate `case.under(condition)`. Raises BenchError for an unknown model, and what the solver raises.
    """
    name = model or case.simulation.model
    if name not in SIMULATORS:
        raise BenchError(f"simulation.model = {name!r} is not one of {', '.join(sorted(SIMULATORS))}")
    check_gears(case.rig)
    module, function = SIMULATORS[name]
    chosen = case.model_copy(update={"simulation": case.simulation.model_copy(update={"model": name})})
    simulator: Simulator = getattr(import_module(module), function)
    return simulator(chosen, progress)
