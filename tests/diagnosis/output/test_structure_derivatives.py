"""Derivatives by what holds the gears, where a rig has it: against two simulations, unknown by unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from gearbench.bench import simulate
from gearbench.cases import case_files
from gearbench.diagnosis.effects.bearing_nonlinearity import KEYS as BEARINGS
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.output.layout import layout_of
from gearbench.diagnosis.output.simulator import Simulator
from gearbench.diagnosis.output.structure import ACROSS, CROSS, HOUSING, MODE, SHAFT, SHAPE, with_motion
from gearbench.diagnosis.output.target import target_of
from gearbench.diagnosis.replay.replays import replays
from gearbench.rig import read_case

CLOSE = 0.04  # of the change in any channel


@dataclass(frozen=True)
class Bench:
    simulator: Simulator
    p: np.ndarray
    jacobian: np.ndarray


@pytest.fixture(scope="module")
def bench() -> Bench:
    """A rig on a housing that moves along and rocks, whose supports yield across and stiffen, before a soft shaft."""
    nominal = read_case(case_files()["gap_demo"])
    record = simulate(nominal.under(nominal.conditions[0]))
    measured = measurement(record, "base", nominal)
    problem = problem_of([measured], nominal)
    layout = layout_of(nominal, problem.model, problem.conditions, (3,))
    simulator = Simulator(layout, target_of([measured], problem.conditions), replays(problem.model.law))
    unknowns, p = layout.unknowns, np.zeros(layout.size)
    for motion, frequency in enumerate((0.3, -0.2)):
        p = with_motion(unknowns, p, motion, frequency, 0.05)
    p[unknowns[ACROSS]], p[unknowns[CROSS]], p[unknowns[SHAFT]] = (0.2, 0.15), (0.1, -0.1), 0.5
    p[unknowns[BEARINGS["driver"]]] = 0.2
    prior = unknowns.prior()
    jacobian = simulator.jacobian(p, prior, np.ones(layout.size, dtype=bool))
    assert jacobian is not None
    return Bench(simulator, p, jacobian)


@pytest.mark.parametrize(
    ("key", "entry", "part"),
    [
        ("stiffness", 0, 0.02),
        ("damping", 1, 0.05),
        ("mass", 0, 0.05),
        ("inertia", 1, 0.05),
        ("scale", 0, 0.02),
        (BEARINGS["driver"], 0, 0.02),
        (ACROSS, 0, 0.02),
        (CROSS, 1, 0.02),
        (HOUSING, 0, 0.02),
        (HOUSING, 1, 0.02),
        (MODE, 2, 0.01),
        (MODE, 3, 0.05),
        (SHAPE, 1, 0.02),
        (SHAFT, 0, 0.02),
    ],
)
def test_a_derivative_is_what_two_simulations_differ_by(bench: Bench, key: str, entry: int, part: float) -> None:
    """`part` of the unknown's standard deviation."""
    unknowns, target = bench.simulator.layout.unknowns, bench.simulator.target
    at = unknowns[key].start + entry
    step = np.zeros(bench.p.size)
    step[at] = part * unknowns.prior()[at]
    lines = [bench.simulator.lines(bench.p + signed * step) for signed in (1, -1)]
    assert lines[0] is not None and lines[1] is not None
    change, start, largest = (lines[0] - lines[1]) / (2 * step[at]), 0, 0.0
    for _, channel, bins in target.plan:
        own = slice(start, start + len(bins))
        start += len(bins)
        size = float(np.linalg.norm(change[own]))
        largest = max(largest, size)
        assert np.linalg.norm(bench.jacobian[at, own] - change[own]) < CLOSE * size, channel
    assert largest > 0.0


def test_one_record_of_a_target_costs_what_it_costs_among_others(bench: Bench) -> None:
    whole = bench.simulator.target
    alone = whole.of_record(0)
    residual = 1e-3 * whole.lines
    assert alone.cost(residual) == pytest.approx(whole.cost(residual), rel=1e-12)
    assert whole.most_excited == 0
