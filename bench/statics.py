"""Static response over the mesh cycle, hub centres held: transmission error, stiffness, load sharing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from gearbench.bench.errors import BenchError
from gearbench.bench.models import model_for
from gearbench.bench.plan.schedule import ProgressReport
from gearbench.bench.record.static import load_key
from gearbench.bench.refusals.gears import check_gears
from gearbench.bench.refusals.stated import mean_torque
from gearbench.rig import Case

MOST_POSITIONS = 65_536


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

    >>> import gearbench as gb
    >>> found = gb.static(gb.read_case("quick_lumped"), torque=[100.0, 200.0])
    >>> (1e6 * found["transmission_error"].mean("phase")).round(1).values
    array([4.2, 8.3])
    """
    case, solver = model_for(case, model)
    if len(torque) and len(dte):
        raise BenchError("static loads are torques or transmission errors: give one kind")
    if positions < 2:
        raise BenchError(f"positions = {positions} must be at least 2")
    if cycles < 1:
        raise BenchError(f"cycles = {cycles} must be at least 1")
    if positions * cycles > MOST_POSITIONS:
        times = f" x cycles = {cycles}" if cycles > 1 else ""
        raise BenchError(f"positions = {positions}{times} must be at most {MOST_POSITIONS}")
    if cycles > 1 and not solver.elastic:
        name = solver.name
        raise BenchError(f"cycles = {cycles} must be 1 for the model {name}, which has no teeth of their own at rest")
    unit, values = ("m", dte) if len(dte) else ("N m", torque or (mean_torque(case),))
    loads = np.asarray(values, dtype=float)
    key, scale = load_key(unit)
    for load in loads * scale:
        if not (np.isfinite(load) and load > 0):
            raise BenchError(f"{key} = {load:g} must be finite and greater than 0")
    check_gears(case.rig)
    phase = np.arange(positions * cycles) / positions
    return solver.static(case, (unit, loads), phase, progress or (lambda fraction, note: None))
