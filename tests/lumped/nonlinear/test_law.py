"""The mesh law's tables against the formulas that they were made from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.hat_mesh import BACKLASH, BASE_PITCH, BEND, PITCH_ROLL, TOP, force, hat, hat_law, stiffness

from gearbench.lumped import LumpedError
from gearbench.lumped.nonlinear.law import MeshLaw, approach_grid

PHASE = np.linspace(-3, 5, 801)


@pytest.fixture(scope="module")
def law() -> MeshLaw:
    return hat_law(mirror=0.3)


@pytest.mark.parametrize("delta", [1e-9, 0.7e-6, 11e-6, 40e-6, 55e-6])
def test_force_and_tangent_between_and_beyond_the_nodes(law: MeshLaw, delta: float) -> None:
    found, tangent = law.evaluate(delta, PHASE)
    if delta > TOP:  # the line through the last two nodes
        end, before = (force(one, PHASE) for one in law.approach[:-3:-1])
        slope = (end - before) / (law.approach[-1] - law.approach[-2])
        np.testing.assert_allclose(found, end + slope * (delta - TOP), rtol=1e-12)
    else:
        np.testing.assert_allclose(found, force(delta, PHASE), rtol=1e-12)
        slope = stiffness(PHASE) * (1 + 1.5 * BEND * np.sqrt(delta / TOP))
    np.testing.assert_allclose(tangent, slope, rtol=1e-12)


def test_flanks_apart_carry_nothing_and_back_flanks_are_a_mirror_image(law: MeshLaw) -> None:
    for delta in (0.0, -1e-9, -0.5 * BACKLASH, -BACKLASH):
        np.testing.assert_array_equal(law.evaluate(delta, PHASE), 0.0)
    pressed, tangent = law.evaluate(-BACKLASH - 5e-6, PHASE)
    np.testing.assert_allclose(pressed, -force(5e-6, 0.3 - PHASE), rtol=1e-12)
    np.testing.assert_allclose(tangent, law.evaluate(5e-6, 0.3 - PHASE)[1], rtol=1e-9)


def test_a_contact_that_stiffens_with_load_is_interpolated_closely() -> None:
    approach = approach_grid(TOP, 49)
    force = np.tile(4e9 * approach**1.11, (64, 1))
    law = replace(hat_law(), approach=approach, force=force, parts=force[..., None] * hat_law().share[:, None])
    delta = np.linspace(0.2e-6, TOP, 4001)
    found, tangent = law.evaluate(delta, 0.37)
    np.testing.assert_allclose(found, 4e9 * delta**1.11, rtol=2e-4, atol=1e-5 * found[-1])
    np.testing.assert_allclose(tangent, 1.11 * found / delta, rtol=2e-2)


def test_pairs_pass_from_cycle_to_cycle_without_a_step(law: MeshLaw) -> None:
    numbers, share = law.pairs(PHASE)
    np.testing.assert_allclose(share, hat(PHASE[:, None] - numbers), atol=1e-12)
    np.testing.assert_allclose(share.sum(axis=1), 1.0, rtol=1e-12)
    for pair in (-1, 0, 4):
        carried = np.where(numbers == pair, share, 0.0).sum(axis=1)
        np.testing.assert_allclose(carried, hat(PHASE - pair), atol=1e-12)


@pytest.mark.parametrize("transition", [0.0, 0.4e-3])
def test_friction_has_the_lever_of_every_pair_and_turns_at_the_pitch_point(law: MeshLaw, transition: float) -> None:
    phase = PHASE[np.abs(PHASE - np.round(PHASE)) > 1e-9]
    found = law.friction(phase, transition)
    expected = np.zeros((3, phase.size))
    for pair in range(-5, 8):
        travel = (phase - pair) * BASE_PITCH
        sign = np.sign(travel) if transition == 0.0 else np.tanh(travel / transition)
        part = hat(phase - pair) * sign
        expected += part * np.array([PITCH_ROLL[0] + travel, np.ones_like(travel), PITCH_ROLL[1] - travel])
    np.testing.assert_allclose(found, expected, atol=1e-12)
    # Just before a pair passes the pitch point the other one has vanished: all friction turns round.
    before, after = law.friction(np.array([2 - 1e-6, 2 + 1e-6]), 0.0)[1]
    assert before == pytest.approx(-1, abs=1e-5)
    assert after == pytest.approx(1, abs=1e-5)


def test_twelve_thousand_samples_take_milliseconds(law: MeshLaw) -> None:
    from time import perf_counter

    delta, phase = np.linspace(-60e-6, 30e-6, 12288), np.linspace(0, 60, 12288)
    times = []
    for _ in range(5):
        start = perf_counter()
        law.evaluate(delta, phase)
        times.append(perf_counter() - start)
    assert min(times) < 5e-3


def test_tables_that_do_not_fit_are_refused(law: MeshLaw) -> None:
    with pytest.raises(LumpedError, match="approach_grid of at least 3 nodes"):
        replace(law, approach=np.linspace(0, TOP, 9))
    with pytest.raises(LumpedError, match=r"share of a mesh law has shape \(64, 3\), not \(64, 4\)"):
        replace(law, share=law.share[:, :3])
    with pytest.raises(LumpedError, match="bending of a mesh law has shape"):
        replace(law, bending=law.bending[:, :, :1])
