"""A simulator of the demonstration's first condition, and how far derivatives are from two simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from gearbench.bench import simulate
from gearbench.cases import case_files
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.replay.replays import Replays
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.structure.layout import layout_of
from gearbench.rig import Case, Load, read_case

BAND = 1500.0  # [Hz], where the lines of other records end


def demonstration(
    load: Load | None = None, faster: int = 1, without: Sequence[str] = (), lags: Mapping[str, float] | None = None
) -> Simulator:
    """Replays of one record of `gap_demo`, or of it with this load, at so many times its speed, without these channels
    or with lags of these [s], whose tooth 3 may be cracked."""
    nominal = quicker(faster, 1)
    case = nominal.under(nominal.conditions[0])
    if load is not None:
        case = case.model_copy(update={"rig": case.rig.model_copy(update={"load": load})})
    if lags:
        late = {f"delay_{channel}": lag for channel, lag in lags.items()}
        sensors = case.rig.sensors.model_copy(update=late)
        case = case.model_copy(update={"rig": case.rig.model_copy(update={"sensors": sensors})})
    measured = measurement(simulate(case).drop_vars(without), nominal.conditions[0].name, nominal)
    problem = problem_of([measured], nominal)
    layout = layout_of(nominal, problem.model, problem.conditions, (3,))
    return Simulator(layout, target_of([measured], problem.conditions), Replays(problem.model.law))


def behind(measured: Measurement, gear: str, lag: float) -> Measurement:
    """A record whose angle of that gear is behind by what its shaft turns on in that time [s]."""
    turned = 2 * np.pi * measured.mesh_frequency / int(measured.record.attrs[f"teeth_{gear}"]) * lag
    name = f"angle_{gear}"
    return replace(measured, periods={**measured.periods, name: measured.periods[name] - turned})


def of_records(simulator: Simulator, *measurements: Measurement) -> Simulator:
    """The same rig held against other records, up to BAND."""
    conditions = [prepare(one, simulator.layout.model, BAND) for one in measurements]
    return simulator.of_target(target_of(measurements, conditions))


def quicker(faster: int, conditions: int) -> Case:
    """`gap_demo` with its first conditions, at so many times its speed."""
    nominal, out = read_case(case_files()["gap_demo"]), []
    for one in nominal.conditions[:conditions]:
        quick = {
            "mesh_frequency": faster * one.experiment.mesh_frequency,
            "samples_per_period": one.experiment.samples_per_period // faster,
        }
        out.append(one.model_copy(update={"experiment": one.experiment.model_copy(update=quick)}))
    return nominal.model_copy(update={"conditions": tuple(out)})


def jacobian_at(simulator: Simulator, p: np.ndarray) -> np.ndarray:
    """Derivatives by all unknowns at `p` (size,)."""
    found = simulator.jacobian(p, simulator.layout.unknowns.prior(), np.ones(p.size, dtype=bool))
    assert found is not None
    return found


def off(
    simulator: Simulator, column: np.ndarray, p: np.ndarray, at: int | slice, step: float, along: ArrayLike = 1.0
) -> dict[str, tuple[float, float]]:
    """By channel, how far the derivative `column` of its fluctuation by the unknown `at`, or by several `along` a
    direction, is from that between two simulations about `p` (size,), and the size of the latter."""
    change, start, found = _change(simulator, p, at, step, along), 0, {}
    for _, channel, bins in simulator.target.plan:
        own = np.arange(start, start + len(bins))[bins > 0]
        start += len(bins)
        found[channel] = (float(np.linalg.norm(column[own] - change[own])), float(np.linalg.norm(change[own])))
    return found


def of_mean(simulator: Simulator, column: np.ndarray, p: np.ndarray, at: int, step: float) -> tuple[float, float]:
    """Derivative `column` of the mean transmission error by the unknown `at`, and that between two simulations about
    `p` (size,)."""
    (own,) = np.flatnonzero(~simulator.target.fluctuating[simulator.target.of_line])
    return float(column[own].real), float(_change(simulator, p, at, step, 1.0)[own].real)


def _change(simulator: Simulator, p: np.ndarray, at: int | slice, step: float, along: ArrayLike) -> np.ndarray:
    """Change of all lines (K,) for a unit of unknowns, between two simulations."""
    before, after, part = p.copy(), p.copy(), step * np.asarray(along)
    before[at], after[at] = p[at] - part, p[at] + part
    lines = [simulator.lines(one) for one in (before, after)]
    assert lines[0] is not None and lines[1] is not None
    return np.asarray((lines[1] - lines[0]) / (2 * step))
