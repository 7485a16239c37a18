"""A sample of a large block's lines stands for all of them: mean squares, derivatives, and a tone beside noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.simulated_lines import demonstration, jacobian_at

import gearbench.diagnosis.simulation.jacobian as in_pieces
import gearbench.diagnosis.simulation.target as targets
from gearbench.diagnosis.simulation.sampled import MOST, STRONGEST, sampled
from gearbench.diagnosis.simulation.simulator import Simulator

MANY = 9000
FEW, ALONE = 8, 2  # lines of a block, and of these told by themselves, in a record that is thinned


def noise(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.standard_normal(MANY) + 1j * rng.standard_normal(MANY))


def test_the_mean_square_of_the_sample_is_that_of_all() -> None:
    """Of 200 residuals that the sample does not know: without bias, within what so few independent lines allow."""
    at, gains = sampled(np.abs(noise(0)) ** 2)
    assert at.size == gains.size == MOST and (np.diff(at) > 0).all()
    assert (gains**2).sum() == pytest.approx(MANY)
    over = []
    for seed in range(1, 201):
        residual = noise(seed)
        over.append((np.abs(residual[at] * gains) ** 2).sum() / (np.abs(residual) ** 2).sum())
    # Of the energy of a complex normal line the standard deviation is its mean.
    deviation = 1.0 / np.sqrt(MOST - STRONGEST)
    assert np.mean(over) == pytest.approx(1.0, abs=4 * deviation / np.sqrt(200))
    assert np.std(over) == pytest.approx(deviation, rel=0.25)


def test_a_tone_is_told_by_itself() -> None:
    lines = noise(3)
    lines[[17, 4321, 8999]] = 300.0
    at, gains = sampled(np.abs(lines) ** 2)
    kept = np.isin(at, [17, 4321, 8999])
    assert kept.sum() == 3 and (gains[kept] == 1.0).all()


def test_a_few_lines_are_all_told() -> None:
    at, gains = sampled(np.ones(MOST))
    assert (at == np.arange(MOST)).all() and (gains == 1.0).all()


@pytest.fixture(scope="module")
def whole() -> Simulator:
    """The demonstration, whose record has some hundred lines of no shaft in a band."""
    return demonstration()


@pytest.fixture(scope="module")
def thinned(whole: Simulator) -> Simulator:
    """The same with few lines of each such block."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(targets, "sampled", lambda energies: sampled(energies, FEW, ALONE))
        return demonstration()


def others(simulator: Simulator) -> np.ndarray:
    return np.array([block.kind == targets.OTHER for block in simulator.target.blocks])


def test_a_thinned_record_costs_what_the_whole_does(whole: Simulator, thinned: Simulator) -> None:
    one, few = whole.target, thinned.target
    assert few.blocks == one.blocks and few.lines.size < 0.8 * one.lines.size
    for name in ("floors", "noise", "counts", "sizes"):
        assert np.array_equal(getattr(few, name), getattr(one, name)), name
    energies, sampled_ones = one.energies(one.lines), few.energies(few.lines)
    assert np.allclose(sampled_ones[~others(whole)], energies[~others(whole)], rtol=1e-12)
    over = sampled_ones[others(whole)] / energies[others(whole)]
    assert over.mean() == pytest.approx(1.0, abs=4.0 / np.sqrt((FEW - ALONE) * over.size))


def test_what_is_simulated_stands_for_as_many_lines_as_what_is_measured(whole: Simulator, thinned: Simulator) -> None:
    """A record that is its own simulation leaves nothing; a torque sensor's gain moves its lines by themselves."""
    p, unknowns = np.zeros(thinned.layout.size), thinned.layout.unknowns
    kept = np.concatenate([
        np.isin(bins, few)
        for (_, _, bins), (_, _, few) in zip(whole.target.plan, thinned.target.plan, strict=True)
    ])
    here, all_here = thinned.lines(p), whole.lines(p)
    assert here is not None and all_here is not None
    assert np.allclose(here, all_here[kept] * thinned.target.gains, rtol=1e-12)
    derivatives = jacobian_at(whole, p)[:, kept] * thinned.target.gains
    assert np.allclose(jacobian_at(thinned, p), derivatives, rtol=1e-9, atol=1e-12 * np.abs(derivatives).max())
    assert unknowns.size == len(derivatives)


def test_part_of_the_lines_keep_what_they_stand_for(thinned: Simulator) -> None:
    target = thinned.target
    inside = others(thinned)[target.of_line]
    part = target.of_lines(inside)
    assert np.array_equal(part.gains, target.gains[inside]) and (part.gains > 1.0).any()
    assert np.allclose(part.energies(part.lines), target.energies(target.lines)[others(thinned)])
    assert [one.stop - one.start for one in part.runs] == np.bincount(part.of_line).tolist()
    both = targets.joined(target, part)
    assert np.array_equal(both.gains, np.concatenate([target.gains, part.gains]))


def test_unknowns_answer_the_same_a_few_at_a_time(whole: Simulator, monkeypatch: pytest.MonkeyPatch) -> None:
    p = np.zeros(whole.layout.size)
    at_once = jacobian_at(whole, p)
    monkeypatch.setattr(in_pieces, "AT_ONCE", 0)
    few = jacobian_at(replace(whole, _kept={}), p)
    assert np.allclose(few, at_once, rtol=1e-4, atol=1e-6 * np.abs(at_once).max())
    assert (np.abs(few).max(axis=1) > 0.0).tolist() == (np.abs(at_once).max(axis=1) > 0.0).tolist()
