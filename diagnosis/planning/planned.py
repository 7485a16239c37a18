"""The records that a planned experiment would leave on the nominal rig, taken in as measured ones are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import xarray as xr

from gearbench.bench.conditions import simulate_all
from gearbench.bench.readiness import check_timing
from gearbench.diagnosis.diagnosis import Inputs, on_finite_elements, take_in
from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.evidence.problem import Problem, problem_of
from gearbench.diagnosis.forces.condition import Condition, prepare
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.replay.replays import Replay, replays_of
from gearbench.diagnosis.selection.followable import followable
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.structure.layout import Layout, layout_of
from gearbench.rig import Case

Report = Callable[[str], None]


@dataclass(frozen=True)
class Planned:
    """Records of the nominal rig, what a diagnosis would make of them before its search, and which of the
    measurements are `smooth`: flanks stay together, or where they do in none, `nudges` hold the driver [N s/m] to its
    recorded motion, by the record's name."""

    inputs: Inputs
    problem: Problem
    layout: Layout
    simulate: Replay
    smooth: tuple[int, ...]
    nudges: Mapping[str, float] = field(default_factory=dict)

    def simulator(self, measurements: Sequence[Measurement], conditions: Sequence[Condition]) -> Simulator:
        """Simulates the lines of measurements, which have those conditions."""
        return Simulator(self.layout, target_of(measurements, conditions), self.simulate, self.nudges)

    @property
    def fitted(self) -> tuple[Measurement, ...]:
        """The measurements that the unknowns are fitted on."""
        return tuple(self.inputs.measurements[number] for number in self.smooth)

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Theirs."""
        return tuple(self.problem.conditions[number] for number in self.smooth)

    @property
    def rough(self) -> tuple[int, ...]:
        """The measurements whose flanks part."""
        measurements = self.inputs.measurements
        return tuple(n for n, one in enumerate(measurements) if n not in self.smooth or one.name in self.nudges)

    @property
    def judged(self) -> tuple[Measurement, Condition]:
        """The measurement that the verdict would be judged on, and its condition."""
        one = self.inputs.judged
        return one, prepare(one, self.problem.model, self.problem.conditions[0].band)


def planned(case: Case, report: Report = lambda step: None, held_out: str | None = None) -> Planned:
    """The case's conditions carried out on its nominal rig, by the model that diagnosis replays on, with the noise of
    its sensors; `held_out` as in `take_in`. Raises BenchError or DiagnosisError, a sentence each, for what cannot be
    simulated or diagnosed."""
    check_timing(case)
    nominal = on_finite_elements(case)
    report("simulating the planned records")
    inputs = take_in(_records(nominal), nominal, held_out=held_out)
    report("taking them in")
    problem = problem_of(inputs.measurements, inputs.nominal)
    simulate = replays_of(inputs.nominal, inputs.all)
    smooth, nudges, _ = followable((inputs.nominal,), inputs.measurements, problem, simulate)
    if not smooth:
        raise DiagnosisError(
            f"{nominal.name}: flanks part in all {len(inputs.measurements)} records to search from, and no angle_driver"
            " tells how the driver moves then: record it, or plan one under a heavier torque_mean_nm or a smaller"
            " multisine"
        )
    # One tooth of each gear for all of them.
    layout = layout_of(inputs.nominal, problem.model, problem.conditions, (0, problem.model.teeth[0]))
    return Planned(inputs, problem, layout, simulate, tuple(smooth), nudges)


def _records(nominal: Case) -> list[xr.Dataset]:
    """A record of each condition, one realisation, the only one that diagnosis uses."""
    named = nominal.experiments()
    single = [replace_experiment(case, realisations=1) for _, case in named]
    records: dict[int, xr.Dataset] = {}
    simulate_all(single, records.__setitem__, "lumped")
    return [records[number].assign_attrs(condition=name or "base") for number, (name, _) in enumerate(named)]


def replace_experiment(case: Case, **update: object) -> Case:
    """The case with fields of its experiment replaced."""
    return case.model_copy(update={"experiment": case.experiment.model_copy(update=update)})
