"""Forward and backward selection on lines made by hand: what was put in enters, nothing else does."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from shared.fake_simulator import ACROSS, LINES, FakeSimulator, beyond_a_hill, chosen, sensitivities, target, unknowns

from gearbench.diagnosis.effects.effect import Hypothesis, Wide, twins_of
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.fit import Optimum, Sensitivity, fit, fit_afresh, sensitivity_of
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.selection import needed as needed_module
from gearbench.diagnosis.selection import selection as module
from gearbench.diagnosis.selection import weighing
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.rivals import compared, is_like, rivals_of, unentered, usual_of
from gearbench.diagnosis.selection.selection import Selection, carried_on, evidence_without, known_within, taken_out
from gearbench.diagnosis.selection.weighing import LIMIT, Weighed
from gearbench.diagnosis.simulation.quadratic import quadratic_of

MATRIX = sensitivities(3)
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))
RIPPLE = Hypothesis("torque-ripple", "drive", (Wide("ripple"),))
CRACKS = tuple(Hypothesis(f"tooth-crack {i}", "mesh", (Wide("crack", i),), choices=2) for i in range(2))
LISTED = (FRICTION, RIPPLE, *CRACKS)


def selected(true: dict[int, float], starts: dict[str, Start] | None = None) -> Selection:
    p = np.array([0.08, -0.1, 0.02, 0.004, -0.005, 0.006, 0.0, 0.0])
    for number, value in true.items():
        p[number] = value
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(noisy(p @ MATRIX)))
    found = chosen(simulator, LISTED, [np.zeros(8)], starts or {})
    assert found is not None
    return found


def noisy(lines: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(11)
    return lines + 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))


def names(found: Selection) -> list[str]:
    return [one.hypothesis.name for one in found.entered]


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


def test_what_explains_the_records_as_well_is_a_rival_and_leaves_with_the_one_that_is_named() -> None:
    """Two teeth whose cracks do the same: each alone explains it, and a good rig's share of the other is no reason to
    find that the background alone closes the gap."""
    alike = MATRIX.copy()
    alike[7] = alike[6]
    true = np.array([0.08, -0.1, 0.02, 0.0, 0.0, 0.0, 0.3, 0.0])
    simulator = FakeSimulator(lambda q: q @ alike, target(true @ alike))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None
    (one,) = found.entered
    assert {one.hypothesis.name, *(other.name for other in one.rivals)} == {"tooth-crack 0", "tooth-crack 1"}
    assert found.bare.p[6] == found.bare.p[7] == 0.0
    assert not any(other.rivals for other in selected({7: 0.3}).entered)
    # Of the two the usual one is named, whichever explains a little more.
    for number, other in (0, 1), (1, 0):
        rare = {number: (("crack",), 1.0)}
        listed = (FRICTION, RIPPLE, *(replace(CRACKS[one], usual=rare.get(one)) for one in range(2)))
        named = chosen(simulator, listed, [np.zeros(8)], {})
        assert named is not None and names(named) == [f"tooth-crack {other}"]


def test_a_rival_that_entered_too_stays_where_the_other_is_taken_out() -> None:
    """Two that were alike when the first entered, both of which the records call for: neither is in the other's
    place, as it would be if only one had entered."""
    true = np.array([0.08, -0.1, 0.02, 0.4, 0.3, -0.2, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true @ MATRIX))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None and sorted(names(found)) == ["friction", "torque-ripple"]
    both = {one.hypothesis.name: one for one in found.entered}
    friction = replace(both["friction"], rivals=(RIPPLE,))
    for entered, stays in ((friction, both["torque-ripple"]), True), ((friction,), False):
        selection = replace(found, entered=entered)
        rest = taken_out(simulator, selection, friction)
        assert rest.p[3] == 0.0 and (np.abs(rest.p[4:6]) > 0.1).all() == stays
        held = evidence_without(simulator.layout.unknowns, selection, friction, rest)
        sd = selection.best.sd.copy()
        sd[3:6] = (0.0, *sd[4:6]) if stays else 0.0
        assert held == rest.evidence_under(sd)
        assert unentered(friction, entered).causes == ((FRICTION,) if stays else (FRICTION, RIPPLE))


def test_no_other_effect_beyond_a_good_rigs_takes_the_place_of_what_is_left_out() -> None:
    """Ripple that does almost what friction does: twelve of its deviations would explain most of the friction."""
    alike = MATRIX.copy()
    alike[4] = alike[3] + 0.05 * alike[4]
    true = np.array([0.08, -0.1, 0.02, 0.12, 0.0, 0.0, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ alike, target(true @ alike))
    found = chosen(simulator, LISTED, [np.zeros(8)], {})
    assert found is not None and names(found) == ["friction"]
    assert found.bare.p[3] == 0.0 and abs(found.bare.p[4]) <= max(4.0 * 0.01, abs(found.base.p[4]))
    assert found.bare.misfit > found.best.misfit + 400.0


def test_of_gears_with_as_many_teeth_the_other_is_a_rival_unless_far_behind() -> None:
    optimum = selected({3: 0.4}).best
    winner = Weighed(replace(FRICTION, on=("driver",)), 100.0, optimum)
    for nats, twins, rivals in (80.0, ("friction",), 1), (70.0, ("friction",), 0), (80.0, (), 0), (98.0, (), 1):
        other = Weighed(replace(RIPPLE, on=("driven",), twins=twins), nats, optimum)
        assert len(rivals_of(winner, [winner, other])) == rivals
    assert twins_of({"driver": "one", "driven": "two"}, "driver", (30, 30)) == ("two",)
    assert twins_of({"driver": "one", "driven": "two"}, "driver", (30, 31)) == ()


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


def test_a_rare_effect_gives_way_to_a_usual_one_that_explains_nearly_as_much() -> None:
    optimum = selected({3: 0.4}).best
    rare = Weighed(replace(FRICTION, usual=(("ripple",), -0.5)), 100.0, optimum)
    assert usual_of((rare, Weighed(RIPPLE, 80.0, None))) is rare
    for nats, named in (80.0, "torque-ripple"), (70.0, "friction"):
        found = usual_of((rare, Weighed(CRACKS[0], 99.0, optimum), Weighed(RIPPLE, nats, optimum)))
        assert found is not None and found.hypothesis.name == named
    assert usual_of(()) is None
    # Beside the usual one the rare one is not weighed again.
    assert is_like(rare.hypothesis, RIPPLE) and not is_like(RIPPLE, rare.hypothesis) and is_like(RIPPLE, RIPPLE)
    assert not is_like(rare.hypothesis, CRACKS[0])


def test_the_usual_one_is_fitted_from_where_the_rare_one_got() -> None:
    """A second tooth whose crack does half of what the first one's does; its own fit had stopped short."""
    alike = MATRIX.copy()
    alike[7] = 0.5 * alike[6]
    simulator = FakeSimulator(lambda q: q @ alike, target(0.2 * alike[6] + 0.08 * alike[0]))
    simulator.jacobian = lambda p, sd, chosen, near=None: alike  # type: ignore[method-assign, assignment]
    found = chosen(simulator, (CRACKS[0],), [np.zeros(8)], {})
    assert found is not None and names(found) == ["tooth-crack 0"]
    first = Weighed(replace(CRACKS[0], usual=(("crack",), 2.0)), 1e6, found.best)
    one, other = compared(simulator, found.base, [first, Weighed(CRACKS[1], 2.0, None)])
    assert one.optimum is found.best and other.hypothesis.name == "tooth-crack 1"
    assert other.optimum is not None and other.optimum.p[6] == pytest.approx(0.0, abs=0.02)
    assert other.optimum.p[7] == pytest.approx(0.4, abs=0.05) and other.log_bayes_factor > LIMIT
    # And a rare one from where the usual one got that is ahead; nothing is handed over to what is no counterpart.
    usual = replace(first, hypothesis=CRACKS[0])
    rare = Weighed(replace(CRACKS[1], usual=(("crack",), 0.5)), 2.0, None)
    turned = compared(simulator, found.base, [usual, rare])[1]
    assert turned.optimum is not None and turned.optimum.p[6:] == pytest.approx([0.0, 0.4], abs=0.05)
    plain = [usual, Weighed(CRACKS[1], 2.0, None)]
    assert compared(simulator, found.base, plain) == plain


def test_a_fit_that_stopped_while_it_promised_to_overtake_is_gone_on_with() -> None:
    found = selected({6: 0.3})
    true = found.weighed[0]
    assert true.hypothesis.name == "tooth-crack 0" and true.optimum is not None
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true.optimum.lines))

    def among(promised: float) -> Weighed:
        stopped = replace(found.base, sd=true.optimum.sd, left=found.base.left + promised)  # type: ignore[union-attr]
        ahead = Weighed(FRICTION, 60.0, None)
        return next(
            one
            for one in compared(simulator, found.base, [ahead, Weighed(true.hypothesis, 1.0, stopped)])
            if one.hypothesis == true.hypothesis
        )

    over = among(100.0)
    assert over.optimum is not None and over.optimum.p[6] == pytest.approx(0.3, abs=0.05)
    assert over.log_bayes_factor > 60.0
    # What would not reach the one ahead, or promises little, stays where it is.
    assert among(50.0).log_bayes_factor == 1.0
    assert among(60.0).log_bayes_factor > 1.0


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


def test_a_beginning_that_means_deny_does_not_hide_one_that_they_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(0.4 * MATRIX[3]))
    base = fit_afresh(simulator, np.zeros(8), prior_of(simulator, unknowns().prior()), renewals=1)  # type: ignore[arg-type]
    assert base is not None
    late = base.p.copy()
    late[3] = 0.3

    def begun(simulator: object, base: Optimum, one: Hypothesis, begin: np.ndarray) -> Optimum:
        return replace(base, p=begin, sd=one.widened(unknowns(), base.sd), evidence=base.evidence + 20.0)

    monkeypatch.setattr(weighing, "called_for", lambda simulator, base, one: late)
    monkeypatch.setattr(weighing, "begun_late", begun)
    monkeypatch.setattr(weighing, "denied_by_means", lambda simulator, one, optimum: optimum.p[3] > 0.35)
    (found,) = weighing.weigh(simulator, base, (FRICTION,), {})  # type: ignore[arg-type]
    assert found.optimum is not None and found.optimum.p[3] == 0.3 and found.log_bayes_factor == pytest.approx(20.0)


def test_effects_are_weighed_by_derivatives_taken_where_the_background_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that its fit carried along may not know of the effect at all, however close it is."""
    lines = np.array([0.08, -0.1, 0.02, 0.4, 0.0, 0.0, 0.0, 0.0]) @ MATRIX
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(noisy(lines)))
    monkeypatch.setattr(module, "is_close", lambda simulator, found: True)
    base = fit_afresh(simulator, np.zeros(8), prior_of(simulator, unknowns().prior()), renewals=1)  # type: ignore[arg-type]
    assert base is not None
    blind = MATRIX.copy()
    blind[3] = 0.0
    quadratic = quadratic_of(simulator.target, simulator.target.lines - base.lines, blind, np.delete(np.arange(8), 3))
    stale = replace(base, sensitivity=Sensitivity(blind, quadratic))
    found = module.select(simulator, stale, LISTED, {})  # type: ignore[arg-type]
    assert names(found) == ["friction"]


def test_what_a_background_had_still_to_gain_is_no_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Weighed over a fit that stopped on its way, whatever is fitted on beside it seems to be at work."""
    sound = np.array([0.08, -0.1, 0.02, 0.004, -0.005, 0.006, 0.0, 0.0]) @ MATRIX
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(noisy(sound)))
    monkeypatch.setattr(module, "is_close", lambda simulator, found: True)
    sd, begin = prior_of(simulator, unknowns().prior()), np.zeros(8)  # type: ignore[arg-type]
    first = sensitivity_of(simulator, begin, sd)  # type: ignore[arg-type]
    stopped = fit(simulator, begin, 1e-3 * sd, first)  # type: ignore[arg-type]
    assert stopped is not None
    stopped = replace(stopped, sd=sd, left=20.0)
    found = module.select(simulator, stopped, LISTED, {})  # type: ignore[arg-type]
    assert names(found) == [] and found.base.cost < stopped.cost - 20.0


def test_what_was_refused_has_not_the_place_of_its_rare_counterpart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 1)
    found = selected({3: 0.4})
    rare = Weighed(replace(CRACKS[0], usual=(("friction",), 1.0)), 30.0, found.best)
    listed = replace(found, weighed=(*found.entered, rare))
    tried: list[str] = []

    def forward(simulator: object, best: Optimum, beside: object, hypotheses: Any, *_: Any, **__: Any) -> Any:
        tried.extend(one.name for one in hypotheses)
        return best, list(cast(Any, beside)), []

    monkeypatch.setattr(module, "_forward", forward)
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(0.4 * MATRIX[3]))
    bare = module.only(simulator, listed, [])  # type: ignore[arg-type]
    assert module.further(simulator, bare, found.entered) is None and tried == ["tooth-crack 0"]  # type: ignore[arg-type]
    # Beside the usual one that entered it has nothing to add.
    tried.clear()
    assert module.further(simulator, listed, (Weighed(RIPPLE, 9.0, found.best),)) is None and not tried  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("usual", "rare", "apart", "name"),
    [(7.7, 10.0, False, "friction"), (3.9, 6.6, True, "friction"), (8.1, 10.0, False, "torque-ripple"),
     (7.0, 7.7, False, None)],
)  # fmt: skip
def test_where_a_usual_cause_lacks_evidence_its_rare_counterpart_enters(
    monkeypatch: pytest.MonkeyPatch, usual: float, rare: float, apart: bool, name: str | None
) -> None:
    """Each alone has what the other has not: not to enter at all would lose both."""
    optimum = selected({3: 0.4}).best
    weighed = [Weighed(replace(FRICTION, usual=(("ripple",), -0.5)), rare, optimum), Weighed(RIPPLE, usual, optimum)]
    entered = module._entering_first(unknowns(), weighed, apart)
    assert (entered.hypothesis.name if entered else None) == name
    assert module._entering_first(unknowns(), [], apart) is None


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
