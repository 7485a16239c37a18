"""Static response over the mesh cycle, hub centres held: transmission error, stiffness, load sharing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import ProgressReport
from gearbench.bench.readiness import check_gears
from gearbench.rig import Case

Array = NDArray[np.float64]

MOST_POSITIONS = 65_536
SCHEMA = "gearbench-static/1"

Loads = tuple[str, Array]  # "N m" (driver torque) or "m" (dte), and values
StaticSolver = Callable[[Case, Loads, Array, ProgressReport | None], xr.Dataset]

# Each model: module and function. Imported on use: one brings in Numba and the mesher.
SOLVERS: dict[str, tuple[str, str]] = {
    "lumped": ("gearbench.bench.linear.static", "static_lumped"),
    "reduced": ("gearbench.bench.elastic.static", "static_reduced"),
}


def static(
    case: Case,
    model: str | None = None,
    *,
    torque: Sequence[float] = (),
    dte: Sequence[float] = (),
    positions: int = 64,
    cycles: int = 1,
    progress: ProgressReport | None = None,
) -> xr.Dataset:
    """Static response of the case's pair at `positions` uniform mesh phases of each of `cycles` mesh cycles.

    From mesh phase 0 on, where tooth 0 of both gears touches at the pitch point; where teeth differ, a cycle is unlike
    the next one.
    Loads are driver torques [N m] or transmission errors [m]; without either, the experiment's mean torque.
    Raises BenchError for bad loads or an unknown model, and what the solver raises.
    """
    name = model or case.simulation.model
    if name not in SOLVERS:
        raise BenchError(f"simulation.model = {name!r} has no static solution, unlike {', '.join(sorted(SOLVERS))}")
    if len(torque) and len(dte):
        raise BenchError("static loads are torques or transmission errors: give one kind")
    if positions < 2:
        raise BenchError(f"positions = {positions} must be at least 2")
    if cycles < 1:
        raise BenchError(f"cycles = {cycles} must be at least 1")
    if positions * cycles > MOST_POSITIONS:
        times = f" x cycles = {cycles}" if cycles > 1 else ""
        raise BenchError(f"positions = {positions}{times} must be at most {MOST_POSITIONS}")
    if cycles > 1 and name != "reduced":
        raise BenchError(f"cycles = {cycles} must be 1 for the model {name}, which has no teeth of their own at rest")
    unit, values = ("m", dte) if len(dte) else ("N m", torque or (case.experiment.torque_mean,))
    loads = np.asarray(values, dtype=float)
    key, scale = load_key(unit)
    for load in loads * scale:
        if not (np.isfinite(load) and load > 0):
            raise BenchError(f"{key} = {load:g} must be finite and greater than 0")
    check_gears(case.rig)
    module, function = SOLVERS[name]
    solver: StaticSolver = getattr(import_module(module), function)
    return solver(case, (unit, loads), np.arange(positions * cycles) / positions, progress)


def load_key(unit: str) -> tuple[str, float]:
    """What a user calls a load, and the factor from SI to that unit."""
    return ("dte_um", 1e6) if unit == "m" else ("torque_nm", 1.0)


def static_dataset(
    loads: Loads,
    phase: Array,
    *,
    transmission_error: Array,
    torque: Array,
    secant: Array,
    tangent: Array,
    attributes: dict[str, object],
    share: Array | None = None,
    unloaded: Array | None = None,
) -> xr.Dataset:
    """The results as a dataset (DESIGN: static.nc); arrays (load, phase), `share` (load, phase, pair), `unloaded`
    (phase,): the transmission error without load."""
    unit, values = loads
    fields = {
        "transmission_error": (transmission_error, "m"),
        "torque": (torque, "N m"),
        "stiffness_secant": (secant, "N/m"),
        "stiffness_tangent": (tangent, "N/m"),
    }
    variables: dict[str, tuple[tuple[str, ...], Array, dict[str, str]]] = {
        name: (("load", "phase"), data, {"units": units}) for name, (data, units) in fields.items()
    }
    coordinates = {"load": ("load", values, {"units": unit}), "phase": ("phase", phase, {"units": "cycles"})}
    if share is not None:
        variables["load_share"] = (("load", "phase", "pair"), share, {"units": "1"})
    if unloaded is not None:
        variables["transmission_error_unloaded"] = (("phase",), unloaded, {"units": "m"})
    return xr.Dataset(variables, coords=coordinates, attrs={"schema": SCHEMA, **attributes})
