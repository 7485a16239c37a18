"""Smallest sizes read off the information: against the quadratic's own optimum, and what leaving out does."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from shared.fake_simulator import LINES, sensitivities, target, unknowns

from gearbench.diagnosis.detection.information import Blocks, Known, Without
from gearbench.diagnosis.detection.opened import Changed
from gearbench.diagnosis.detection.smallest import (
    View,
    _Judge,
    apart_from,
    direction,
    largest,
    rivals_at,
    smallest,
    wide_prior,
)
from gearbench.diagnosis.effects.backlash import KEY
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.friction import FRICTION
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.effects.tooth_crack import TOOTH_CRACK
from gearbench.diagnosis.effects.torque_ripple import TORQUE_RIPPLE
from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.judging.closing import DUE, GAIN
from gearbench.diagnosis.selection.rivals import ALIKE, NEARLY
from gearbench.diagnosis.selection.weighing import LIMIT
from gearbench.diagnosis.simulation.quadratic import quadratic_of

NO_MODEL = cast(Any, None)
HYPOTHESES = (*FRICTION.hypotheses(NO_MODEL), *TORQUE_RIPPLE.hypotheses(NO_MODEL))


def known(matrix: np.ndarray, floor: float = 1e-2) -> Known:
    """Six blocks, two of them of record `fast`; the judged record has the same derivatives."""
    where = target(np.zeros(LINES, dtype=complex), floor)
    named = tuple(replace(one, record="fast") if n > 3 else one for n, one in enumerate(where.blocks))
    where = replace(where, blocks=named)
    blocks = Blocks(quadratic_of(where, where.lines, matrix, np.arange(8)))
    narrow = unknowns().prior()
    narrow[unknowns()[CRACK]] = 0.0
    return Known(unknowns(), np.arange(8), narrow, blocks, blocks)


def test_evidence_is_that_of_the_two_optima() -> None:
    """Near nothing the cost is a square: there the log Bayes factor is the one of the fits themselves."""
    one = known(sensitivities(), floor=1e4)
    view, bounds = View(one, HYPOTHESES), unknowns().bounds()
    base = one.search.quadratic
    for number, hypothesis in enumerate(HYPOTHESES):
        size = 0.02
        lines = size * direction(one, hypothesis) @ sensitivities()
        quadratic = base.moved(lines)
        evidence = []
        for prior in (one.narrow, wide_prior(one, hypothesis)):
            _, cost, information = quadratic.best(np.zeros(8), prior, bounds)
            evidence.append(quadratic.evidence(cost, information, prior))
        noise = view.evidence(number, 0.0)[number] + 0.5 * np.linalg.slogdet(
            np.eye(8) + one.search.information(Without(), 1.0, 0.0) * np.outer(*[wide_prior(one, hypothesis)] * 2)
        )[1] - 0.5 * np.linalg.slogdet(
            np.eye(8) + one.search.information(Without(), 1.0, 0.0) * np.outer(one.narrow, one.narrow)
        )[1]  # fmt: skip
        assert view.evidence(number, size)[number] - noise == pytest.approx(evidence[1] - evidence[0], rel=1e-3)


def test_what_is_named_is_named_at_any_larger_size() -> None:
    view = View(known(sensitivities()), HYPOTHESES)
    for number in range(len(HYPOTHESES)):
        found = smallest(view, number)
        assert found is not None and found < largest(view.known, HYPOTHESES[number])
        assert view.evidence(number, found)[number] >= LIMIT
        assert apart_from(view, number, found) == pytest.approx(found)
        assert rivals_at(view, number, found) == ()


def test_what_both_causes_explain_counts_for_the_usual_one() -> None:
    """As where effects are selected: the rest that tells a rare one from it is faint beside that."""
    matrix = sensitivities()
    matrix[4] = matrix[3] + 0.25 * matrix[4]
    listed = (replace(HYPOTHESES[0], usual=(("ripple",), -0.5)), HYPOTHESES[1])
    near, bounds, size = known(matrix, floor=1e4), unknowns().bounds(), 0.02
    moved = near.search.quadratic.moved(size * direction(near, listed[0]) @ matrix)
    neither = near.narrow.copy()
    neither[[*listed[0].entries(unknowns()), *listed[1].entries(unknowns())]] = 0.0
    costs = [moved.best(np.zeros(8), sd, bounds)[1] for sd in (neither, near.narrow)]
    assert 0.5 * size**2 * View(near, listed).shared[0, 1] == pytest.approx(costs[0] - costs[1], rel=1e-3)
    # Of two usual causes neither takes the other's place.
    crack = TOOTH_CRACK.hypotheses(cast(Any, SimpleNamespace(teeth=(1, 1))))[:1]
    more = View(near, (replace(listed[0], usual=(("ripple", CRACK), -0.5)), listed[1], *crack))
    assert more.shared[0, 1] == more.shared[0, 2]
    view, there = View(known(matrix), listed), 0.6
    own, usual = view.evidence(0, there)
    assert usual < NEARLY * own and rivals_at(view, 0, there) == (1,)
    shared = 0.5 * there**2 * view.shared[0, 1]
    assert usual + shared > ALIKE * (own + shared)
    view.__dict__["shared"] = {(0, 1): 0.0}
    assert rivals_at(view, 0, there) == ()


def test_a_record_of_its_own_makes_up_for_what_the_search_lacks() -> None:
    """As it does where effects are selected: fewer nats enter, and those that lack are gained where nothing was
    fitted. Few lines judge, so that it is their nats that decide."""
    one = known(0.02 * sensitivities())
    quadratic = one.judged.quadratic
    few = replace(quadratic.target, counts=0.5 * quadratic.target.counts)
    one = replace(one, judged=Blocks(replace(quadratic, target=few)))
    view = View(replace(one, apart=True), HYPOTHESES)
    for number in range(len(HYPOTHESES)):
        within, found = smallest(View(one, HYPOTHESES), number), smallest(view, number)
        assert within is not None and found is not None and found < within
        evidence, judged = view.evidence(number, found)[number], _Judge(view, number)
        gain = float(np.sum(few.counts * np.log1p(judged.energies * found**2 / judged.floors)))
        assert evidence < LIMIT and gain + evidence == pytest.approx(GAIN + LIMIT, rel=1e-6)


def test_the_judged_gap_grows_by_a_tenth_from_what_the_rig_leaves_there() -> None:
    """Which is a tenth of the level below which no model counts as right. So many lines tell that nothing else decides;
    the effect adds its energy to what is left."""
    rest = 0.5 * np.exp(1j * np.arange(LINES))
    found, seen = known(sensitivities(), floor=1e-9), known(sensitivities(), floor=25.0).judged.quadratic
    many = replace(seen.target, counts=1e5 * seen.target.counts)
    judged = Blocks(replace(seen.moved(rest), target=many))
    view = View(replace(found, judged=judged), HYPOTHESES)
    for number in range(len(HYPOTHESES)):
        size = smallest(view, number)
        assert size is not None
        more = _Judge(view, number).energies * size**2
        grown = np.sqrt(1.0 + np.array([more.sum() / 6, *more]) / 0.25)
        assert grown.max() == pytest.approx(DUE, rel=1e-6)


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_a_backlash_grows_the_gap_from_what_the_rig_leaves_there(noise: float) -> None:
    """By simulation, with the same rule; the gap is no less than the noise."""
    listed = unknowns_of([group(KEY, "m", ("more",), 4e-6, 8e-5, slot="backlash")], 2)
    where = replace(target(np.zeros(LINES, dtype=complex), 1e-2), noise=np.full(6, noise**2))
    simulator: Any = SimpleNamespace(
        target=where, layout=SimpleNamespace(unknowns=listed), lines=lambda p: p[0] * np.ones(LINES, dtype=complex)
    )
    changed = Changed(simulator, np.zeros(1), where.floors + 1e-6)
    assert changed.growth(2e-3) == pytest.approx(sqrt(1.0 + 4e-6 / max(1e-6, noise**2)), rel=1e-6)


def test_fewer_records_and_more_noise_find_less() -> None:
    one = known(0.02 * sensitivities())
    whole = View(one, HYPOTHESES)
    less = replace(whole, without=Without(record="fast"))
    assert np.all(np.linalg.eigvalsh(whole.information - less.information) > -1e-9)
    kept = sum(one.search.information(Without(record=name), 1.0, 0.0) for name in ("base", "fast"))
    assert kept == pytest.approx(whole.information)
    for number in range(len(HYPOTHESES)):
        sizes = [smallest(view, number) for view in (replace(whole, sharper=100.0), whole, less)]
        assert None not in sizes and sizes == sorted(sizes, key=lambda size: size or np.inf)
        assert less.std(number)[3] > whole.std(number)[3]


def test_records_that_do_not_show_it_find_nothing() -> None:
    blind = sensitivities()
    blind[3] = 0.0
    assert smallest(View(known(blind), HYPOTHESES), 0) is None
    # Nor where nothing of it is among what they show.
    one, shown = known(blind), np.delete(np.arange(8), 3)
    seen = Blocks(quadratic_of(one.search.target, one.search.target.lines, blind, shown))
    assert smallest(View(replace(one, active=shown, search=seen, judged=seen, apart=True), HYPOTHESES), 0) is None


def test_effects_with_the_same_trace_are_rivals() -> None:
    """A crack that does what friction does, but for a trace of its own a hundred times smaller."""
    alike, tooth = sensitivities(), unknowns()[CRACK].start
    alike[tooth] = alike[3] + 1e-2 * alike[tooth]
    crack = Hypothesis("tooth-crack 0", "mesh", (Wide(CRACK, 0),), effect=TOOTH_CRACK)
    view = View(known(alike), (HYPOTHESES[0], crack))
    found = smallest(view, 0)
    assert found is not None and rivals_at(view, 0, found) == (1,)
    apart = apart_from(view, 0, found)
    assert apart is not None and apart > found and rivals_at(view, 0, apart) == ()
    assert apart_from(View(known(sensitivities()), (HYPOTHESES[0], crack)), 0, found) == pytest.approx(found)
