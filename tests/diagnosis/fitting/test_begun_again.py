"""A fit begun again from the nominal rig, on lines made by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shared.fake_simulator import LINES, FakeSimulator, sensitivities, target, unknowns

from gearbench.diagnosis.fitting.closeness import answers_alike, is_close
from gearbench.diagnosis.fitting.fit import cost_of, fit, sensitivity_of
from gearbench.diagnosis.fitting.restructured import begun_at_nominal

MATRIX = sensitivities(3)


def test_a_fit_in_a_valley_beside_the_nominal_rig_is_begun_there_again() -> None:
    """An unknown that lines see through a hill: the fit stops in the hollow behind it."""
    true = np.zeros(8)
    true[3] = 0.4

    def hilly(p: np.ndarray) -> np.ndarray:
        return p[1:] @ MATRIX[1:] + (0.125 * (1.0 - np.cos(25 * p[0])) + 0.4 * p[0]) * MATRIX[0]

    rng = np.random.default_rng(5)
    lines = hilly(true) + 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))
    simulator = FakeSimulator(hilly, target(lines))
    sd = unknowns().prior()
    sd[3], sd[6:] = 0.5, 0.0
    far = true.copy()
    far[0] = 0.25
    first = sensitivity_of(simulator, far, sd)
    assert first is not None
    stuck = fit(simulator, far, sd, first, renewals=3)
    assert stuck is not None and stuck.cost > 5.0 + cost_of(simulator, true, sd)
    kept = np.arange(8) == 3
    again = begun_at_nominal(simulator, stuck, kept)
    assert again.evidence > stuck.evidence + 5.0 and again.p[:4] == pytest.approx(true[:4], abs=0.02)
    # Where the nominal rig is far off nothing is begun.
    simulator.jacobians = 0
    assert begun_at_nominal(simulator, again, np.zeros(8, dtype=bool)) is again and simulator.jacobians == 0


@pytest.mark.parametrize(("off", "level", "close"), [
    (0.0, 1.0, True), (3.0, 1.0, True), (500.0, 1.0, False),
    # The same above the floor, of a channel that fluctuates by little more: three floors are a part of it that counts.
    (3.0, 0.01, False),
])  # fmt: skip
def test_a_block_that_no_rig_answers_is_not_close(off: float, level: float, close: bool) -> None:
    """Whatever the median block is left with; in multiples of the floor."""
    lines = np.full(LINES, level, dtype=complex)
    simulator = FakeSimulator(lambda p: lines, target(lines.copy()))
    at = simulator.target.of_line == 2
    simulator.target.lines[at] += np.sqrt(off * simulator.target.floors[2])
    found = SimpleNamespace(lines=lines)
    assert is_close(simulator, found) is close  # type: ignore[arg-type]


@pytest.mark.parametrize(("kept", "alike"), [(1.0, True), (0.9, True), (0.05, False), (0.0, False)])
def test_rigs_answer_alike_by_what_they_leave_of_the_excited_lines_alone(kept: float, alike: bool) -> None:
    """Energies 1e4 floors above it: a twentieth of these, 3.0 of 9.2 nats less. A shaft's lines, halves of all, have no
    say."""
    blank = np.zeros(LINES, dtype=complex)
    made = target(blank)
    blocks = tuple(replace(one, kind="excited" if i < 2 else "driver-shaft") for i, one in enumerate(made.blocks))
    simulator = FakeSimulator(lambda p: blank, replace(made, blocks=blocks))
    size, of_line = 100 * np.sqrt(made.floors[0]), made.of_line
    before, after = np.where(of_line < 4, size, 0.0), np.where(of_line < 2, np.sqrt(kept) * size, 0.0)
    one, other = (SimpleNamespace(lines=lines.astype(complex)) for lines in (before, after))
    assert answers_alike(simulator, one, other) is alike  # type: ignore[arg-type]
