"""Teeth that may be cracked by what simulation leaves: against dense least squares, and on a cracked rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from shared.fake_simulator import LINES, FakeSimulator, sensitivities, target
from shared.simulated_lines import demonstration

from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.fitting.fit import Optimum, fit, sensitivity_of
from gearbench.diagnosis.fitting.likely_teeth import LIKELY, gains_of, with_likely_teeth, with_small_cracks
from gearbench.diagnosis.simulation.simulator import Simulator

SD = np.array([0.1, 0.1, 0.1, 0.01, 0.01, 0.01, 0.0, 0.0])
CRACKED = 7  # of the driven gear: its number among all teeth is 27


def test_gains_are_those_of_least_squares_beside_all_that_may_move() -> None:
    matrix = sensitivities(5)
    lines = np.array([0.08, -0.1, 0.02, 0.0, 0.0, 0.0, 0.0, 0.15]) @ matrix
    simulator = FakeSimulator(lambda p: p @ matrix, target(lines, floor=1e-3))
    first = sensitivity_of(simulator, np.zeros(8), SD)
    assert first is not None
    base = fit(simulator, np.zeros(8), SD, first, renewals=2)
    assert base is not None
    wide = np.array([0.35, 0.35])
    gains = gains_of(base, wide, matrix[6:])
    quadratic = base.sensitivity.quadratic
    weight = np.sqrt(quadratic.weights(np.zeros(len(quadratic.active))))[np.arange(LINES) % 6]

    def least(numbers: list[int], prior: np.ndarray) -> float:
        """Nats at the least squares over these unknowns under this prior, weights held."""
        columns = (matrix[numbers] * weight).T
        rest = (lines - base.lines) * weight
        rows = np.vstack([columns.real, columns.imag, np.diag(1 / prior)])
        wanted = np.concatenate([rest.real, rest.imag, -base.p[numbers] / prior])
        step = np.linalg.lstsq(rows, wanted, rcond=None)[0]
        return 0.5 * float(((rows @ step - wanted) ** 2).sum())

    without = least([0, 1, 2, 3, 4, 5], SD[:6])
    for tooth in range(2):
        gained = without - least([0, 1, 2, 3, 4, 5, 6 + tooth], np.append(SD[:6], wide[tooth]))
        step = gains[tooth]
        # A tooth that would have to gain stiffness gains nothing.
        assert step == pytest.approx(gained, rel=1e-6) or (step == 0.0 and tooth == 0)
    assert gains[1] > 10 * gains[0]


def sound_fit(simulator: Simulator, lines: NDArray[np.complex128]) -> tuple[Simulator, Optimum]:
    """The simulator with these lines for measured ones, and its fit without a soft tooth."""
    unknowns = simulator.layout.unknowns
    made = replace(simulator, target=replace(simulator.target, lines=lines), _kept={})
    sd = unknowns.prior()
    sd[unknowns[CRACK]] = 0.0
    first = sensitivity_of(made, np.zeros(unknowns.size), unknowns.prior())
    assert first is not None
    base = fit(made, np.zeros(unknowns.size), sd, first)
    assert base is not None
    return made, base


def test_the_cracked_tooth_of_a_rig_is_among_them_though_nobody_ranked_it() -> None:
    simulator = demonstration()
    unknowns, z1 = simulator.layout.unknowns, simulator.layout.model.teeth[0]
    number = z1 + CRACKED
    cracked = replace(simulator, layout=replace(simulator.layout, teeth=(number,)))
    p = np.zeros(simulator.layout.size)
    p[unknowns[CRACK].start + number] = 0.3
    lines = cracked.lines(p)
    assert lines is not None
    made, base = sound_fit(simulator, lines)
    found, again = with_likely_teeth(made, base, (3,))
    assert found.layout.teeth[0] == 3 and len(found.layout.teeth) <= LIKELY + 1
    assert found.layout.teeth[1] == number
    column = again.sensitivity.jacobian[unknowns[CRACK].start + number]
    assert np.abs(column).max() > 0.0 and unknowns[CRACK].start + number in again.sensitivity.quadratic.active
    assert again.p is base.p and again.cost == base.cost


def test_a_tooth_that_is_a_little_softer_belongs_to_the_background_as_its_records_show() -> None:
    """Three per cent of one tooth, less than a crack: fitted beside everything else, under a sound gear's prior."""
    simulator = demonstration()
    unknowns, z1 = simulator.layout.unknowns, simulator.layout.model.teeth[0]
    number = z1 + CRACKED
    at = unknowns[CRACK].start + number
    soft = replace(simulator, layout=replace(simulator.layout, teeth=(number,)))
    p = np.zeros(simulator.layout.size)
    p[at] = 0.03
    lines = soft.lines(p)
    assert lines is not None
    made, base = sound_fit(simulator, lines)
    teeth, again = with_likely_teeth(made, base, (3,))
    found = with_small_cracks(teeth, again)
    assert found.sd[at] == unknowns.prior()[at] and np.count_nonzero(found.sd[unknowns[CRACK]]) <= 2
    assert found.p[at] == pytest.approx(0.03, abs=0.004)
    assert found.evidence > again.evidence + 3.0
    # A rig without a softer tooth stays as it is.
    plain_lines = simulator.lines(np.zeros(p.size))
    assert plain_lines is not None
    sound, whole = sound_fit(simulator, plain_lines)
    plain, kept = with_likely_teeth(sound, whole, ())
    assert with_small_cracks(plain, kept) is kept
