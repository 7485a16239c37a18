"""Derivatives by what holds the gears, where a rig has it: against two simulations, unknown by unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from shared.simulated_lines import demonstration, jacobian_at, off

from gearbench.diagnosis.effects.bearing_nonlinearity import KEYS as BEARINGS
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.contrast import CONTRAST
from gearbench.diagnosis.structure.ends import ENDS, TILT
from gearbench.diagnosis.structure.structure import ACROSS, CROSS, HOUSING, MODE, SHAPE, with_motion
from gearbench.diagnosis.structure.viscous import LOADED
from gearbench.rig import Load, OutputShaft

CLOSE = 0.04  # of the change in any channel
# What the pairs share and run-out move the edges of contact, where damping jumps and the derivative does not; there two
# simulations, by steps of 0.05 and 0.5 standard deviations, differ as much among themselves, by 0.19 in the torque.
EDGES = {"torque_driven": 0.2, "dte": 0.05, "y_driver": 0.05, "y_driven": 0.05}


@dataclass(frozen=True)
class Bench:
    simulator: Simulator
    p: np.ndarray
    jacobian: np.ndarray


@pytest.fixture(scope="module")
def bench() -> Bench:
    """A rig on a housing that moves along and rocks, whose supports yield across and stiffen, before a load on a
    shaft, with which the driven gear turns."""
    simulator = demonstration(Load(coupling=OutputShaft(stiffness=4e6, damping=50.0)))
    unknowns, p = simulator.layout.unknowns, np.zeros(simulator.layout.size)
    for motion, frequency in enumerate((0.3, -0.2)):
        p = with_motion(unknowns, p, motion, frequency, 0.05, motion)
    p[unknowns[ACROSS]], p[unknowns[CROSS]] = (0.2, 0.15), (0.1, -0.1)
    p[unknowns[BEARINGS["driver"]]], p[unknowns[LOADED]] = 0.2, 0.6
    return Bench(simulator, p, jacobian_at(simulator, p))


@pytest.mark.parametrize(
    ("key", "entry", "part"),
    [
        ("stiffness", 0, 0.02),
        ("damping", 1, 0.05),
        ("mass", 0, 0.05),
        ("inertia", 1, 0.05),
        ("scale", 0, 0.02),
        ("mesh-ratio", 0, 0.05),
        (LOADED, 0, 0.05),
        (CONTRAST, 0, 0.02),
        (ENDS, 0, 0.02),
        (TILT, 0, 0.05),
        (BEARINGS["driver"], 0, 0.02),
        (ACROSS, 0, 0.02),
        (CROSS, 1, 0.02),
        (HOUSING, 0, 0.02),
        (HOUSING, 1, 0.02),
        (MODE, 2, 0.01),
        (MODE, 3, 0.05),
        (SHAPE, 1, 0.02),
        ("delay-angle_driven", 0, 0.5),
        ("eccentricity-driven", 1, 0.5),
    ],
)
def test_a_derivative_is_what_two_simulations_differ_by(bench: Bench, key: str, entry: int, part: float) -> None:
    """`part` of the unknown's standard deviation."""
    unknowns = bench.simulator.layout.unknowns
    at = unknowns[key].start + entry
    found = off(bench.simulator, bench.jacobian[at], bench.p, at, part * unknowns.prior()[at])
    within = EDGES if key in (CONTRAST, ENDS, TILT, "eccentricity-driven") else {}
    for channel, (error, size) in found.items():
        assert error <= within.get(channel, CLOSE) * size, channel
    assert max(size for _, size in found.values()) > 0.0


def test_one_record_of_a_target_costs_what_it_costs_among_others(bench: Bench) -> None:
    whole = bench.simulator.target
    alone = whole.of_record(0)
    residual = 1e-3 * whole.lines
    assert alone.cost(residual) == pytest.approx(whole.cost(residual), rel=1e-12)
    assert whole.most_excited == 0
