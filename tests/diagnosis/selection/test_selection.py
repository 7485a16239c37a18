"""Forward and backward selection on lines made by hand: what was put in enters, nothing else does."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.fake_simulator import ACROSS, LINES, FakeSimulator, beyond_a_hill, chosen, target
from shared.selected_lines import FRICTION, LISTED, MATRIX, RIPPLE, names, selected

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.selection import needed as needed_module
from gearbench.diagnosis.selection import selection as module
from gearbench.diagnosis.selection import weighing
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.selection import carried_on, known_within
from gearbench.diagnosis.selection.weighing import LIMIT, Weighed


def test_a_rig_with_a_good_rigs_share_of_everything_needs_nothing() -> None:
    found = selected({})
    assert names(found) == [] and found.best is found.base
    assert all(one.log_bayes_factor < LIMIT for one in found.weighed)


@pytest.mark.parametrize(("number", "value", "name"), [(3, 0.4, "friction"), (7, 0.3, "tooth-crack 1")])
def test_one_effect_enters_with_its_size(number: int, value: float, name: str) -> None:
    found = selected({number: value})
    assert names(found) == [name]
    assert found.best.p[number] == pytest.approx(value, abs=4 * found.best.std[number])
    assert found.weighed[0].hypothesis.name == name
    assert found.best.misfit < found.base.misfit - LIMIT
    # Recalibrated without it: nothing of it is left, though a good rig might have a little.
    assert found.bare.p[number] == 0.0 and found.base.p[3] != 0.0
    assert found.bare.misfit > found.best.misfit + LIMIT


def test_what_had_no_place_enters_when_another_is_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 1)
    true = np.array([0.08, -0.1, 0.02, 0.4, 0.3, -0.2, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true @ MATRIX))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None and names(found) == ["friction"]
    bare = module.only(simulator, found, [])  # type: ignore[arg-type]
    assert module.further(simulator, bare, []) is None  # type: ignore[arg-type]
    more = module.further(simulator, bare, found.entered)  # type: ignore[arg-type]
    assert more is not None and names(more) == ["torque-ripple"]
    # The friction is still in the lines.
    assert more.best.p[4:6] == pytest.approx([0.3, -0.2], abs=0.1) and not more.bare.p[4:6].any()
    # Nothing that is out is tried again, and what was worth nothing is not tried at all.
    assert module.further(simulator, bare, (*found.entered, *more.entered)) is None  # type: ignore[arg-type]
    # What enters and does not stay would be tried for ever.
    monkeypatch.setattr(module, "needed", lambda simulator, base, best, entered, report, apart: (best, ()))
    assert module.further(simulator, bare, found.entered) is None  # type: ignore[arg-type]


def test_what_had_no_place_enters_when_the_other_proves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """As much as a good rig's after all: the one that it had kept out is tried in its place."""
    monkeypatch.setattr(module, "MOST", 1)
    true = np.array([0.08, -0.1, 0.02, 0.4, 0.3, -0.2, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true @ MATRIX))
    held = module.held_against_background

    def none_of_friction(simulator: Any, base: Any, best: Any, kept: Any, report: Any, apart: bool) -> Any:
        stay = [one for one in kept if one.hypothesis is not FRICTION]
        base, best, found = held(simulator, base, best, stay, report, apart=apart)
        return base, best if stay else base, found

    monkeypatch.setattr(module, "held_against_background", none_of_friction)
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None and names(found) == ["torque-ripple"]
    assert found.best.p[4:6] == pytest.approx([0.3, -0.2], abs=0.1)


def test_two_effects_enter_the_larger_first_and_each_is_needed() -> None:
    found = selected({3: 0.5, 4: 0.2, 5: -0.15})
    assert names(found) == ["friction", "torque-ripple"]
    assert found.best.p[[3, 4, 5]] == pytest.approx([0.5, 0.2, -0.15], abs=0.03)
    assert all(one.log_bayes_factor > LIMIT for one in found.entered)


def test_a_fit_that_fails_costs_its_hypothesis_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    refit = weighing._refit

    def failing(simulator: object, base: object, one: Hypothesis, *rest: object) -> object:
        if one is RIPPLE:
            raise np.linalg.LinAlgError("not positive definite")
        return refit(simulator, base, one, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(weighing, "_refit", failing)
    found = selected({3: 0.5, 4: 0.2, 5: -0.15})
    assert names(found) == ["friction"]
    assert next(one for one in found.weighed if one.hypothesis is RIPPLE).optimum is None


def test_a_start_of_the_force_residuals_is_tried_even_if_the_quadratic_does_not_see_it() -> None:
    # From zero this effect does nothing to first order.
    def lines_of(p: np.ndarray) -> np.ndarray:
        return p[:3] @ MATRIX[:3] + 20 * p[3] ** 2 * MATRIX[3]

    true = np.array([0.05, 0, 0, 0.4, 0, 0, 0, 0])
    simulator = FakeSimulator(lines_of, target(lines_of(true)))
    simulator.jacobian = lambda p, sd, chosen, near=None: np.where(  # type: ignore[method-assign, assignment]
        np.arange(8)[:, None] == 3, 40 * (p[3] + 1e-3) * MATRIX, np.where(np.arange(8)[:, None] < 3, MATRIX, 0)
    )
    start = Start(FRICTION, np.array([0, 0, 0, 0.35, 0, 0, 0, 0.0]), 30.0)
    found = chosen(simulator, (FRICTION,), [np.zeros(8)], {"friction": start})
    assert found is not None and names(found) == ["friction"]
    assert found.best.p[3] == pytest.approx(0.4, abs=0.02)


def test_a_start_keeps_what_only_its_own_rig_feels() -> None:
    """What the third unknown changes shows beside the effect alone, as the loss of a coupling does: without it the
    effect's own rig is farther from the records than the background."""

    def parts(p: np.ndarray) -> np.ndarray:
        return np.array([p[0], p[1], 40 * p[3] * p[2], p[3], 0, 0, 0, 0])

    def jacobian(p: np.ndarray, sd: object, chosen: object, near: object = None) -> np.ndarray:
        return np.array([(parts(p + 1e-6 * one) - parts(p)) / 1e-6 for one in np.eye(8)]) @ MATRIX

    true = np.array([0.05, 0, 0.15, 0.4, 0, 0, 0, 0])
    simulator = FakeSimulator(lambda p: parts(p) @ MATRIX, target(parts(true) @ MATRIX))
    simulator.jacobian = jacobian  # type: ignore[method-assign, assignment]
    base = chosen(simulator, (), [np.zeros(8)], {})
    assert base is not None
    at_rest = replace(base.base, p=base.base.p * (np.arange(8) < 2))
    near = module.fit_afresh(simulator, at_rest.p, at_rest.sd, renewals=0)
    assert near is not None and 2 not in near.sensitivity.quadratic.active
    start = Start(FRICTION, np.array([0, 0, 0.14, 0.37, 0, 0, 0, 0.0]), 30.0)
    found = weighing._refit(simulator, near, FRICTION, np.zeros(len(near.sensitivity.quadratic.active)), start, 0)
    assert found is not None and found.p[2:4] == pytest.approx([0.15, 0.4], abs=0.03)


def test_structure_beyond_a_hill_is_found_by_beginning_again() -> None:
    """A little yielding across makes it worse, what the rig has makes it right: no fit gets there from rigid."""
    unknowns, lines_of = beyond_a_hill(MATRIX)
    rng = np.random.default_rng(11)
    lines = lines_of(ACROSS) + 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))
    simulator = FakeSimulator(lines_of, target(lines), layout=SimpleNamespace(unknowns=unknowns))
    found = chosen(simulator, (FRICTION,), [np.zeros(8)], {})
    assert found is not None and names(found) == ["friction"]
    assert found.best.p[[3, 4, 5]] == pytest.approx([0.4, 0.23, 0.21], abs=0.01)


def test_structure_that_the_rig_shows_around_its_mesh_is_begun_from() -> None:
    """A resonance far from where the fit begins: downhill leads the other way, what is read of the rig leads there."""
    unknowns = unknowns_of(
        [
            group("stiffness", "1", ("driver", "driven"), 0.1, slot="stiffness"),
            group("scale", "1", ("mesh",), 0.06, slot="scale"),
            group("housing-mode", "1", ("frequency",), 0.7, slot="structure", high=0.0),
            group("across", "1", ("driver", "driven"), 0.15, slot="structure", low=0.0, high=1.0),
            group("cross", "1", ("driver", "driven"), 0.1, slot="structure"),
            group("friction", "1", ("coefficient",), 0.01, 0.5, slot="friction"),
            group("crack", "1", 2, 0.02, 0.35, slot="loss", low=0.0),
        ],
        2,
    )

    def lines_of(p: np.ndarray) -> np.ndarray:
        """Uphill from 0 to -0.4, as the rig has it at -1."""
        bent = p.copy()
        bent[3] = p[3] * (p[3] + 0.8)
        return np.concatenate([bent, np.zeros(len(MATRIX))])[: len(MATRIX)] @ MATRIX

    true = np.array([0.08, -0.1, 0.02, -1.0, 0.23, 0.21, 0.0, 0.0, 0.0, 0.0, 0.0])
    lines = lines_of(true)
    simulator = FakeSimulator(lines_of, target(lines), layout=SimpleNamespace(unknowns=unknowns))

    def read(held: np.ndarray) -> np.ndarray:
        out = held.copy()
        out[[0, 1, 3]] = true[[0, 1, 3]] + 0.01
        return out

    without, found = (chosen(simulator, (), [np.zeros(11)], {}, shown=shown) for shown in (None, Shown(read)))
    assert without is not None and abs(without.base.p[3] + 1.0) > 0.3
    assert found is not None
    assert found.base.p[[0, 1, 2, 3]] == pytest.approx(true[:4], abs=0.01)


@pytest.mark.parametrize("left", [(), ("torque-ripple",)])
def test_nothing_of_what_proves_needless_is_left(monkeypatch: pytest.MonkeyPatch, left: tuple[str, ...]) -> None:
    """Of two that entered those not `left` go back to a good rig's share, of which their size is many."""

    worth, promised = needed_module._worth, needed_module._promised

    def of(one: Weighed, value: float) -> float:
        return value if one.hypothesis.name in left else 0.0

    def held(simulator: Any, best: Any, one: Weighed) -> Weighed:
        found = promised(simulator, best, one)
        return replace(found, log_bayes_factor=of(one, found.log_bayes_factor))

    monkeypatch.setattr(needed_module, "_promised", held)
    monkeypatch.setattr(needed_module, "_worth", lambda one, *optima: of(one, worth(one, *optima)))
    found = selected({3: 0.4, 4: 0.3, 5: -0.2})
    assert names(found) == list(left)
    assert (found.best is found.base) == (not left)
    assert found.best.sd[3] == found.base.sd[3] and abs(found.best.p[3]) < 0.1
    if left:
        assert found.best.p[4:6] == pytest.approx([0.3, -0.2], abs=0.1)


def test_no_rig_at_the_start_is_no_selection() -> None:
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(MATRIX[0]), largest=0.1)
    assert chosen(simulator, LISTED, [np.ones(8)], {}) is None


def test_a_number_known_to_a_third_or_worse_may_be_nothing() -> None:
    low, high = known_within(np.array([0.1, 0.4]))
    assert np.exp(low[0]) == pytest.approx(0.7) and np.exp(low[1]) < 0.01
    np.testing.assert_allclose(high, [0.3, 1.2])


def test_what_further_records_call_for_enters_beside_what_is_there() -> None:
    p = np.array([0.08, -0.1, 0.02, 0.4, 0.3, -0.2, 0.0, 0.0])
    few = MATRIX.copy()
    few[3] = 0.0  # what the first records do not feel
    rng = np.random.default_rng(11)
    noise = 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))
    first = FakeSimulator(lambda q: q @ few, target(p @ few + noise))
    begun = chosen(first, LISTED, [np.zeros(8)], {})
    assert begun is not None and names(begun) == ["torque-ripple"]
    whole: Any = FakeSimulator(lambda q: q @ MATRIX, target(p @ MATRIX + noise))
    found = carried_on(whole, begun, LISTED)
    assert found is not None and sorted(names(found)) == ["friction", "torque-ripple"]
    assert found.best.p[3:6] == pytest.approx(p[3:6], abs=0.05)
    assert found.base.misfit > found.best.misfit + LIMIT and found.bare.p[3] == 0.0
    # One that they do not bear out leaves again.
    sound = np.where(np.arange(8) == 4, 0.0, np.where(np.arange(8) == 5, 0.0, p))
    other: Any = FakeSimulator(lambda q: q @ MATRIX, target(sound @ MATRIX + noise))
    found = carried_on(other, begun, LISTED)
    assert found is not None and names(found) == ["friction"]


@pytest.mark.parametrize(("close", "alike", "times"), [(True, True, 1), (False, True, 0), (False, False, 1)])
def test_structure_that_was_sought_beside_the_same_answer_is_sought_no_more(
    close: bool, alike: bool, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the base is close to the records none was sought beside it."""
    sought = []
    monkeypatch.setattr(module, "restructured", lambda here, best, *more: sought.append(best) or best)
    monkeypatch.setattr(module, "is_close", lambda here, found: close)
    monkeypatch.setattr(module, "answers_alike", lambda here, before, after: alike)
    assert names(selected({3: 0.4})) == ["friction"] and len(sought) == times
