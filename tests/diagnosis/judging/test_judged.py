"""What was selected held against a record that had no part in it, on lines made by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.fake_simulator import LINES, FakeSimulator, OfLines, chosen, noisy, of_lines, sensitivities, target

from gearbench.diagnosis.account import sentence_of_effect
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.judging import held_against as module
from gearbench.diagnosis.judging.closing import GAIN, closing_of, free_closing
from gearbench.diagnosis.judging.held_against import judged_on
from gearbench.diagnosis.judging.judged import GREATER, Judged, Sizes
from gearbench.diagnosis.selection import selection as selecting
from gearbench.diagnosis.selection.selection import Selection
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import LIMIT, PROVISIONAL

MATRIX, OTHER = sensitivities(3), sensitivities(4)  # the records of the search, and the judged one
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))
RIPPLE = Hypothesis("torque-ripple", "drive", (Wide("ripple"),))
BACKGROUND = np.array([0.08, -0.1, 0.02, 0.004, -0.005, 0.006, 0.0, 0.0])


@dataclass
class Answering(FakeSimulator):
    simulate: Any = None
    nudges: dict[str, float] = field(default_factory=dict)
    free: Any = None

    def __post_init__(self) -> None:
        self.free = self.free or self

    @property
    def anchored(self) -> bool:
        return not self.nudges

    @property
    def held_by(self) -> tuple[Any, ...]:
        return self.target.measurements

    def channels(self, p: np.ndarray, measured: Any) -> dict[str, np.ndarray]:
        return {"lines": p @ OTHER, "dte": np.zeros(8)}


def judged(
    searched: dict[int, float],
    there: dict[int, float],
    monkeypatch: pytest.MonkeyPatch,
    *,
    apart: bool = False,
    left: float = 0.05,
    free: Any = None,
    way: Any = None,
    weighed: Sequence[Hypothesis] = (FRICTION, RIPPLE),
) -> Judged:
    """Effects of these sizes in the records of the search, and in the judged one, which is waited for (`apart`); so
    much of the nominal gap is `left`; what simulates without what nudges, if it is nudged, is `free`, what does on the
    record's way, if it may matter, is `way`."""
    monkeypatch.setattr(Judged, "left", left)
    p, q = BACKGROUND.copy(), BACKGROUND.copy()
    for number, value in searched.items():
        p[number] = value
    for number, value in there.items():
        q[number] = value
    simulator = Answering(lambda one: one @ MATRIX, target(noisy(p @ MATRIX, 11)))
    if free is not None:
        simulator.nudges, simulator.free = {"base": 1.0}, free
        monkeypatch.setattr(module, "nudges_of", lambda model, conditions: {})
        monkeypatch.setattr(Simulated, "end_of", lambda found, optimum: optimum.p)
    simulator.layout.size, simulator.layout.nominal = 8, None
    selection = chosen(simulator, weighed, [np.zeros(8)], {}, apart=apart)
    assert isinstance(selection, Selection)
    held = of_lines(noisy(q @ OTHER, 12))
    monkeypatch.setattr(module, "target_of", lambda measurements, conditions, residual=None: held)
    monkeypatch.setattr(module, "noise_left", lambda case, measured, simulate: {})
    monkeypatch.setattr(module, "prepare", lambda measured, model, band: None)
    monkeypatch.setattr(module, "way_of", lambda *_: way)
    problem: Any = SimpleNamespace(model=None, conditions=[SimpleNamespace(band=1.0)])
    layout: Any = simulator.layout
    found = judged_on(problem, Simulated(layout, simulator, selection), None)  # type: ignore[arg-type]
    assert found is not None
    return found


def names(listed: Sequence[Any]) -> list[str]:
    return [one.hypothesis.name for one in listed]


def test_an_effect_that_the_judged_record_has_too_is_kept_with_what_it_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    found = judged({3: 0.4}, {3: 0.4}, monkeypatch)
    assert names(found.found.selection.entered) == ["friction"] and not found.dropped
    closing = found.closings["friction"]
    assert closing.due and closing.gain > 100 and closing.part[0] == "dte"
    # 0.4 of its sensitivities over the noise left, in the band of ten lines that shows it best.
    assert 0.4 / 0.02 < closing.growth < 2 * 0.4 / 0.02


def test_an_effect_that_leaves_the_judged_record_as_it_was_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    found = judged({3: 0.4, 4: 0.3, 5: -0.2}, {3: 0.4}, monkeypatch)
    assert names(found.dropped) == ["torque-ripple"]
    assert names(found.found.selection.entered) == ["friction"]
    # It goes back to what a good rig may have, and what is kept keeps its size.
    best = found.found.selection.best.p
    assert abs(best[4]) < 0.05 and best[3] == pytest.approx(0.4, abs=0.05)
    none = judged({4: 0.3, 5: -0.2}, {}, monkeypatch)
    assert not none.found.selection.entered and none.found.selection.best is none.found.selection.base


def test_what_was_dropped_before_is_remembered_unless_it_is_kept_now(monkeypatch: pytest.MonkeyPatch) -> None:
    first = judged({3: 0.4, 4: 0.3, 5: -0.2}, {3: 0.4}, monkeypatch)
    again = judged({3: 0.4}, {3: 0.4}, monkeypatch)
    assert names(again.with_dropped(first.dropped).dropped) == ["torque-ripple"]
    assert names(first.with_dropped(first.dropped).dropped) == ["torque-ripple"]
    assert not again.with_dropped(again.found.selection.entered).dropped


@pytest.mark.parametrize(("grown", "named"), [(1.2, ["support"]), (1.05, [])])
def test_a_number_of_the_nominal_rig_must_make_a_difference_to_the_whole(
    grown: float, named: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Judged, "grown", lambda judged, without: grown)
    stiffer = Hypothesis("support", "driver-support", (Wide("stiffness", 0, 0.7),))
    found = judged({0: 0.9}, {0: 0.9}, monkeypatch, weighed=(stiffer,))
    assert names(found.found.selection.entered) == named
    # What a rig has of its own is judged by any part of the gap.
    assert names(judged({3: 0.4}, {3: 0.4}, monkeypatch).found.selection.entered) == ["friction"]


def test_what_had_no_place_beside_what_closes_nothing_is_kept_instead(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(selecting, "MOST", 1)
    found = judged({3: 0.4, 4: 0.3, 5: -0.2}, {4: 0.3, 5: -0.2}, monkeypatch)
    assert names(found.dropped) == ["friction"]
    assert names(found.found.selection.entered) == ["torque-ripple"]


class Alike(Answering):
    """Whatever the unknowns, as simulations are that go their own way."""

    def channels(self, p: np.ndarray, measured: Any) -> dict[str, np.ndarray]:
        return super().channels(np.zeros(8), measured)


def simulating(kind: type[Answering]) -> Answering:
    return kind(lambda one: one @ MATRIX, target(np.zeros(LINES, complex)))


def test_what_nudged_simulations_show_is_due_if_free_ones_show_it_too(monkeypatch: pytest.MonkeyPatch) -> None:
    same, alike = simulating(Answering), simulating(Alike)
    assert names(judged({3: 0.4}, {3: 0.4}, monkeypatch, free=same).found.selection.entered) == ["friction"]
    found = judged({3: 0.4}, {3: 0.4}, monkeypatch, free=alike)
    assert names(found.dropped) == ["friction"]


@pytest.mark.parametrize(("there", "named"), [(0.4, ["friction"]), (0.0, [])])
def test_a_rig_that_only_goes_another_way_is_judged_along_the_record_s(
    there: float, named: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(Judged, "strays_from", lambda judged, kept: not asked.append(kept) and strays)
    along, alike, strays = simulating(Answering), simulating(Alike), True
    found = judged({3: 0.4}, {3: there}, monkeypatch, free=alike, way=along)
    assert names(found.found.selection.entered) == named and asked
    assert found.answer is found.kept and found.kept is not None
    if named:
        closing = found.closings["friction"]
        assert closing.due and closing.own is not None
        # The gap is told of its own motion, what the effect closes along the record's.
        assert closing.own["lines"] == pytest.approx(0.0) and np.abs(closing.without["lines"]).max() > 0.01
    # One that is as far off along the record's way is judged as it goes.
    strays = False
    found = judged({3: 0.4}, {3: there}, monkeypatch, free=alike, way=along)
    assert names(found.dropped) == ["friction"] and found.kept is None and found.answer is found.signals


def test_a_rig_that_cannot_be_kept_on_the_record_s_way_is_judged_as_it_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    class Nowhere(Answering):
        """No rig can be kept there."""

        def channels(self, p: np.ndarray, measured: Any) -> dict[str, np.ndarray]:
            raise ValueError("no such motion")

    found = judged({3: 0.4}, {3: 0.4}, monkeypatch, free=simulating(Answering), way=simulating(Nowhere))
    assert names(found.found.selection.entered) == ["friction"] and found.kept is None


def test_what_is_left_of_the_records_of_the_search_is_that_of_their_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    found = judged({3: 0.4}, {3: 0.4}, monkeypatch)
    lines, best = found.found.simulator.target.lines, found.found.selection.best.lines
    assert found.searched == pytest.approx(np.linalg.norm(lines - best) / np.linalg.norm(lines))
    target_of_search: Any = found.found.simulator.target
    object.__setattr__(target_of_search, "noise", target_of_search.energies(lines - best))
    again = replace(found)
    assert again.searched == 0.0
    # As much as is left there is noise of the search; here the judged record's channels leave more, or less.
    size = Sizes(fluctuation=1.0, nominal=1.0, plain=1.0, final=0.5, noise=0.3)
    much, less = ({"dte": replace(size, final=final)} for final in (0.5, 0.3 + 1e-12))
    noise = float(np.linalg.norm(lines - best) / np.linalg.norm(lines))
    for sizes, hidden in ((much, noise), (less, 0.0), ({"y_driver": size}, 0.0)):
        again = replace(found)
        object.__setattr__(again, "sizes", sizes)
        assert again.hidden == pytest.approx(hidden, abs=1e-5)


def test_what_weak_evidence_lacks_is_made_up_for_on_the_judged_record(monkeypatch: pytest.MonkeyPatch) -> None:
    weak = {3: 0.045}  # of a good rig 0.01: widening its prior is worth ten nats and costs four
    assert not judged(weak, weak, monkeypatch).found.selection.entered
    found = judged(weak, weak, monkeypatch, apart=True)
    (one,) = found.found.selection.entered
    assert PROVISIONAL < one.log_bayes_factor < LIMIT and one.lacking == LIMIT - one.log_bayes_factor
    closing = found.closings["friction"]
    assert closing.due and not replace(closing, gain=GAIN + 0.5 * one.lacking).due
    none = judged(weak, {}, monkeypatch, apart=True)
    assert names(none.dropped) == ["friction"] and not none.found.selection.entered
    # In a rig of which the greater part is not explained it is nothing to go by.
    assert names(judged(weak, weak, monkeypatch, apart=True, left=1.1 * GREATER).dropped) == ["friction"]
    assert not judged({3: 0.4}, {3: 0.4}, monkeypatch, apart=True, left=1.1 * GREATER).dropped


def test_a_record_of_the_search_makes_up_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    weak = {3: 0.045}
    plain = judged(weak, weak, monkeypatch, apart=True)
    simulator: Any = plain.found.simulator
    object.__setattr__(simulator.target, "measurements", (plain.measured,))
    problem: Any = SimpleNamespace(model=None, conditions=[SimpleNamespace(band=1.0)])
    again = judged_on(problem, plain.found, plain.measured)
    assert again is not None and names(again.dropped) == ["friction"]


def test_effects_that_take_turns_are_judged_once_each(monkeypatch: pytest.MonkeyPatch) -> None:
    both = {3: 0.5, 4: 0.2, 5: -0.15}
    (friction, ripple), turns = judged(both, both, monkeypatch).found.selection.entered, list[str]()

    def other(simulator: Any, selection: Selection, *_: Any, **__: Any) -> Selection:
        taken = ripple if names(selection.entered) == ["friction"] else friction
        assert len(turns) < 5
        turns.append(taken.hypothesis.name)
        return replace(selection, entered=(taken,))

    monkeypatch.setattr(module, "further", other)
    found = judged(both, both, monkeypatch)
    assert turns == ["friction", "torque-ripple", "friction"]
    assert names(found.found.selection.entered) == ["torque-ripple"]


def test_each_of_two_effects_is_taken_out_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    found = judged({3: 0.5, 4: 0.2, 5: -0.15}, {3: 0.5, 4: 0.2, 5: -0.15}, monkeypatch)
    assert set(names(found.found.selection.entered)) == {"friction", "torque-ripple"}
    friction, ripple = found.closings["friction"], found.closings["torque-ripple"]
    assert friction.growth / ripple.growth == pytest.approx(0.5 / 0.25, rel=0.4)


class Blind(Answering):
    """A judged record that does not feel friction, and one whose flanks part, which the fit leaves out."""

    def channels(self, p: np.ndarray, measured: Any) -> dict[str, np.ndarray]:
        return {"lines": p @ SEEN_BY[measured.name], "dte": np.zeros(8)}


SEEN_BY = {"held-out": np.where(np.arange(8)[:, None] == 3, 0.0, OTHER), "light": sensitivities(9)}
# A part of what the effect does elsewhere, that makes the gap grow by less than it must.
FAINT = 0.011 * OTHER[3]
HELD, LIGHT = (SimpleNamespace(name=name) for name in SEEN_BY)


@pytest.mark.parametrize("faint", [False, True])
@pytest.mark.parametrize(("light", "named"), [(0.4, ["friction"]), (0.0, [])])
def test_what_the_judged_record_does_not_feel_is_told_by_one_whose_flanks_part(
    light: float, named: list[str], faint: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(SEEN_BY, "held-out", SEEN_BY["held-out"] + faint * (np.arange(8)[:, None] == 3) * FAINT)
    p, q = BACKGROUND.copy(), BACKGROUND.copy()
    p[3], q[3] = 0.4, light
    simulator = Blind(lambda one: one @ MATRIX, target(noisy(p @ MATRIX, 11)))
    simulator.layout.size, simulator.layout.nominal = 8, None
    selection = chosen(simulator, (FRICTION, RIPPLE), [np.zeros(8)], {}, apart=True)
    assert selection is not None and names(selection.entered) == ["friction"]

    def of_record(measurements: Sequence[Any], conditions: Sequence[Any], residual: Any = None) -> OfLines:
        return of_lines(noisy(q @ SEEN_BY[measurements[0].name], 12), measurements=tuple(measurements))

    monkeypatch.setattr(module, "target_of", of_record)
    monkeypatch.setattr(module, "noise_left", lambda case, measured, simulate: {})
    monkeypatch.setattr(module, "prepare", lambda measured, model, band: None)
    monkeypatch.setattr(module, "way_of", lambda *_: None)
    problem: Any = SimpleNamespace(model=None, conditions=[SimpleNamespace(band=1.0)])
    layout: Any = simulator.layout
    whole: Any = Simulated(layout, simulator, selection)  # type: ignore[arg-type]
    held, rough = HELD, LIGHT
    assert names(judged_on(problem, whole, held).found.selection.entered) == []  # type: ignore[arg-type, union-attr]
    found = judged_on(problem, whole, held, (rough,))  # type: ignore[arg-type]
    assert found is not None and names(found.found.selection.entered) == named
    if named:
        closing = found.closings["friction"]
        assert closing.record == "light" and closing.growth > 0.4 / 0.02
        assert "on record light" in sentence_of_effect("friction", closing, 0.0)


def test_free_simulations_must_close_a_tenth_of_the_whole_gap() -> None:
    """A part is closer by chance: here that of ten lines of thirty, while the others are off as far as before."""
    held = of_lines(noisy(BACKGROUND @ OTHER, 12))
    far = np.where(held.of_line == 0, 0.0, 5.0)
    one, other = held.lines + far + 1.0, held.lines + far + np.where(held.of_line == 0, 0.1, 1.0)
    part = closing_of(held, {"lines": one}, {"lines": other})
    whole = free_closing(held, {"lines": one}, {"lines": other})
    assert part.due and part.growth > 5.0
    assert not whole.due and whole.gain == part.gain
    near = {"lines": held.lines + 0.1}
    assert free_closing(held, {"lines": held.lines + 1.0}, near).due


def test_a_rig_at_its_noise_owes_a_tenth_of_that() -> None:
    """What is left of a record holds its noise already."""
    held = of_lines(noisy(BACKGROUND @ OTHER, 12))
    held = replace(held, noise=np.full(len(held.floors), 0.02**2))
    noise = np.sqrt(held.noise)[held.of_line]
    for growth, due in (1.2, True), (1.05, False):
        closing = free_closing(held, {"lines": held.lines + growth * noise}, {"lines": held.lines + noise})
        assert closing.growth == pytest.approx(growth, rel=1e-6) and closing.due == due
