"""Forces without a name, against a plain integration of joints that are not linear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr
from shared.plain_joints import Joints, Moved, moved
from shared.truth_plants import CASES

from gearbench.bench import simulate
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.fitting.fit import fit_afresh
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.judging.decided import FREE
from gearbench.diagnosis.remainder.free_forces import FreeForce, free_forces, lines_of_forms, motion_of
from gearbench.diagnosis.replay.replays import Replays
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.structure.layout import layout_of
from gearbench.lumped.nonlinear.constants import Constants
from gearbench.lumped.nonlinear.model import nonlinear_model
from gearbench.rig import Case, read_case

STIFFNESS = 4.2e8
TIGHT = 0.1  # of its uncertainty, how much the rig may differ from the one that moves: it is the same
# A mesh whose stiffness hardly changes, at a speed at which a repetition lasts 0.117 s.
EVEN = (
    "experiment.mesh_frequency_hz=512", "experiment.samples_per_period=1200",
    "simulation.mesh_stiffness=rectangular", f"simulation.stiffness_single_n_per_m={0.998 * STIFFNESS}",
    f"simulation.stiffness_double_n_per_m={1.002 * STIFFNESS}", "rig.sensors.noise_angle_urad=0.1",
    "rig.sensors.noise_displacement_um=0.005",
)  # fmt: skip


@dataclass(frozen=True)
class Bench:
    nominal: Case
    record: xr.Dataset
    constants: Constants
    radius: float

    def moved(self, joints: Joints) -> Moved:
        """The plain rig under the record's torque."""
        samples = int(self.record.attrs["samples_per_period"])
        force = self.record["torque_driver"].values[0, :samples] / self.radius
        return moved(self.constants, STIFFNESS, force, float(self.record.attrs["sampling_rate"]), joints)

    def difference(self, one: Joints, other: Joints) -> dict[str, np.ndarray]:
        """What one repetition of the channels (N,) changes by from the first joints to the others."""
        first, second = self.moved(one), self.moved(other)
        supports = zip(("y_driver", "y_driven"), first.supports, second.supports, strict=True)
        return {"angle_driver": (second.driver - first.driver) / self.radius} | {n: b - a for n, a, b in supports}

    def simulator(self, changes: dict[str, np.ndarray]) -> Simulator:
        """That of the record with these changes."""
        changed = self.record.copy(deep=True)
        for name, part in changes.items():
            changed[name] = changed[name] + np.tile(part, changed[name].shape[1] // part.size)
        measured = measurement(changed, "one", self.nominal)
        problem = problem_of([measured], self.nominal)
        layout = layout_of(self.nominal, problem.model, problem.conditions, ())
        return Simulator(layout, target_of([measured], problem.conditions), Replays(problem.model.sound))

    def found(self, joints: Joints) -> dict[str, FreeForce]:
        """What is found in the record with what these joints change in it."""
        simulator = self.simulator(self.difference(Joints(), joints))
        unknowns = simulator.layout.unknowns
        best = fit_afresh(simulator, np.zeros(unknowns.size), TIGHT * unknowns.prior(), renewals=1)
        assert best is not None
        return {one.form.name: one for one in free_forces(simulator, best)}

    def factor(self, joint: str, size: float) -> Joints:
        """A joint whose force has that rms over the linear one's."""
        return Joints(**{joint: size / getattr(self.moved(Joints()).sizes, joint)})


def bench_of(*more: str) -> Bench:
    nominal = read_case(CASES / "gap_demo.toml", (*EVEN, *more)).model_copy(update={"conditions": ()})
    # The plain rig says nothing of the load's torque.
    record = simulate(nominal).drop_vars("torque_driven")
    problem = problem_of([measurement(record, "one", nominal)], nominal)
    layout = layout_of(nominal, problem.model, problem.conditions, ())
    model = nonlinear_model(nominal.rig, layout.meshing, problem.model.law)
    return Bench(nominal, record, model.constants(), layout.model.base_radius[0])


@pytest.fixture(scope="module")
def bench() -> Bench:
    return bench_of()


def test_a_rig_of_linear_joints_has_none(bench: Bench) -> None:
    assert max(one.worth for one in bench.found(Joints()).values()) < 3.0


@pytest.mark.parametrize(
    ("name", "joint"),
    [("damper mesh", "mesh"), ("damper driver-support", "damper"), ("spring driver-support", "spring")],
)
def test_lines_are_those_of_the_plain_rig(bench: Bench, name: str, joint: str) -> None:
    """Its motions with a little more and a little less of the force differ by as much."""
    simulator, small = bench.simulator({}), 0.02
    motions = [motion_of(simulator, np.zeros(simulator.layout.size), one) for one in simulator.target.measurements]
    forms = lines_of_forms(simulator, motions)
    column = next(lines for form, lines in forms if form.name == name)
    wanted = bench.difference(bench.factor(joint, -small), bench.factor(joint, small))
    g = bench.constants.factor
    wanted["dte"] = bench.radius * wanted["angle_driver"] + g * (wanted["y_driver"] - wanted["y_driven"])
    expected = simulator.target.gathered([wanted]) / (2 * small)
    assert np.linalg.norm(column - expected) < 0.05 * np.linalg.norm(expected)


@pytest.mark.parametrize(
    ("name", "joint", "size"),
    [
        ("damper mesh", "mesh", 0.3),
        ("damper mesh", "mesh", -0.2),
        ("damper driver-support", "damper", 0.3),
        ("spring driver-support", "spring", 0.03),
    ],
)
def test_a_joint_is_found_with_its_size_and_sign(bench: Bench, name: str, joint: str, size: float) -> None:
    """Sizes are of first order: a third of damping more makes motions that are a tenth smaller."""
    found = bench.found(bench.factor(joint, size))
    first = max(found.values(), key=lambda one: one.worth)
    assert first.form.name == name
    assert first.worth > FREE
    assert first.size == pytest.approx(size, rel=0.3)


def test_a_record_whose_flanks_part_says_nothing() -> None:
    assert not bench_of("experiment.multisine.amplitude_nm=250").found(Joints())
