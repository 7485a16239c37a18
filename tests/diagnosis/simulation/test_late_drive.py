"""A drive whose torque acts after its channel shows it: a lag of the rig that a fit finds, and no effect."""

from __future__ import annotations

import numpy as np
import pytest
from shared.simulated_lines import demonstration, jacobian_at, off

from gearbench.diagnosis.structure.structure import LATE, lag_of_drive
from gearbench.rig import Case


def test_the_derivative_is_that_between_two_simulations() -> None:
    simulator = demonstration()
    unknowns = simulator.layout.unknowns
    at, sd = unknowns[LATE].start, lag_of_drive(unknowns, np.zeros(unknowns.size))[1]
    column = jacobian_at(simulator, np.zeros(unknowns.size))[at]
    for channel, (error, size) in off(simulator, column, np.zeros(unknowns.size), at, 0.1 * sd).items():
        assert error < 0.04 * size, channel  # that is half a step aside of the middle


def test_a_lag_of_the_drive_is_a_torque_channel_that_leads() -> None:
    """Shifting what is measured by whole samples is the second formulation."""
    simulator = demonstration()
    unknowns, layout = simulator.layout.unknowns, simulator.layout
    (measured,) = simulator.target.measurements
    p = np.zeros(unknowns.size)
    p[unknowns[LATE]] = 2 / measured.sampling_rate
    late = simulator.channels(p, measured)
    record = measured.record
    rolled = record.assign(torque_driver=record.torque_driver.roll(time=2, roll_coords=False))
    shifted: Case = layout.case(np.zeros(unknowns.size))
    answer = simulator.simulate(shifted, rolled)
    assert late["y_driver"] == pytest.approx(answer["y_driver"].values[0], rel=1e-3, abs=1e-9)
