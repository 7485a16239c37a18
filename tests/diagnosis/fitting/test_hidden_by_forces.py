"""The resonance of a housing under the displacement sensors in the forces of truth rigs: equations of motion of another
structure, which the diagnosis does not know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.truth_plants import STIFFNESS, drawn_levels

from gearbench.cases import case_files
from gearbench.challenge.truth.measure import measure
from gearbench.challenge.truth.rigs import conditions_of, make_bench
from gearbench.challenge.truth.structure import draw_structure
from gearbench.diagnosis.evidence.fit import refit
from gearbench.diagnosis.evidence.problem import Problem, problem_of
from gearbench.diagnosis.evidence.search import COARSE, STEPS_BASE, begin_of
from gearbench.diagnosis.fitting.hidden_by_forces import motion_by_forces
from gearbench.diagnosis.fitting.hidden_motion import Motion
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.structure.structure import pace_of
from gearbench.rig import read_case

RATIO = 0.045
ALONG, ACROSS = (-0.9, 0.6), (-0.6, 0.4)  # of driver and driven gear


def found_in(frequency: float, soft: float, seed: int) -> tuple[Motion | None, Problem]:
    """The motion that is found in a record of a truth rig whose housing has one of that frequency [Hz] and compliance
    over the supports', its sensors moving along; the other is hardly there."""
    nominal = read_case(case_files()["gap_demo"])
    bench, rng = make_bench(nominal, STIFFNESS), np.random.default_rng(seed)
    structure = replace(
        draw_structure(nominal, "test", rng),
        mode_frequency=np.array([frequency, 900.0]),
        mode_damping=np.array([RATIO, 0.05]),
        mode_part=np.array([soft, 1e-4]),
        mode_shape=np.array([[ACROSS[0], ALONG[0], ACROSS[1], ALONG[1]], [0.0, 1.0, 0.0, 1.0]]),
        sensor_on_housing=1.0,
    )
    record = measure(bench, structure, drawn_levels(seed), conditions_of(nominal)[0], "base", rng)
    problem = problem_of([measurement(record, "base", nominal)], nominal)
    base = refit(problem, problem.unknowns.prior(), begin_of(problem), most=STEPS_BASE, coarse=COARSE)
    return motion_by_forces(problem, base), problem


@pytest.mark.parametrize(("frequency", "soft", "seed"), [(170.0, 0.03, 1), (420.0, 0.03, 2), (250.0, 0.01, 8)])
def test_a_housing_that_sensors_stand_on_is_seen_in_the_forces(frequency: float, soft: float, seed: int) -> None:
    found, problem = found_in(frequency, soft, seed)
    assert found is not None
    assert np.exp(found.resonance.at) * pace_of(problem.model) / (2 * np.pi) == pytest.approx(frequency, rel=0.05)
    assert found.shares[0] * found.shares[1] < 0.0 < found.compliance < 2 * soft  # it rocks


@pytest.mark.parametrize("seed", [3, 4])
def test_of_a_rigid_housing_nothing_is_seen(seed: int) -> None:
    """Gears that resonate across their supports, above what a housing does, are none."""
    found, _ = found_in(300.0, 1e-4, seed)
    assert found is None
