"""What a rig with no more of an effect than a good one explains as well does not need it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shared.fake_simulator import FakeSimulator, noisy, sensitivities, target, unknowns

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.profile_error import FLANKS
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.selection import needed as module
from gearbench.diagnosis.selection.needed import CLEAR, FAR, beside, far_of, held_against_background, needed, size_of
from gearbench.diagnosis.selection.weighing import LIMIT, PROVISIONAL, Weighed
from gearbench.diagnosis.simulation.jacobian import FOLLOWED
from gearbench.diagnosis.simulation.quadratic import prior_cost

MATRIX = sensitivities(3)
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))
RIPPLE = Hypothesis("torque-ripple", "drive", (Wide("ripple"),))


def rig(friction: float, *ripple: float) -> FakeSimulator:
    """Ripple that it has is seen 300 times as clearly."""
    p = np.array([0.08, -0.1, 0.02, friction, *(ripple or (0.0, 0.0)), 0.0, 0.0])
    of = np.diag([1.0, 1.0, 1.0, 1.0, *([300.0] * 2 if ripple else [1.0] * 2), 1.0, 1.0]) @ MATRIX
    return FakeSimulator(lambda q: q @ of, target(noisy(p @ of)))


def fitted(simulator: FakeSimulator, *wide: Hypothesis) -> Optimum:
    sd = prior_of(simulator, unknowns().prior())  # type: ignore[arg-type]
    for one in wide:
        sd = one.widened(unknowns(), sd)
    found = fit_afresh(simulator, np.zeros(8), sd, renewals=4)  # type: ignore[arg-type]
    assert found is not None
    return found


def held(simulator: FakeSimulator, base: Optimum, best: Optimum, *entered: Weighed) -> tuple[Optimum, list[str]]:
    _, found, stay = held_against_background(simulator, base, best, entered, apart=False)  # type: ignore[arg-type]
    return found, [one.hypothesis.name for one in stay]


def test_a_rig_without_an_effect_that_is_fitted_further_is_not_better_for_it() -> None:
    """The fit with friction stopped before the numbers around it had moved; that without any goes to its end."""
    simulator = rig(0.06)
    base, best = fitted(simulator), fitted(simulator, FRICTION)
    p = np.where(np.arange(8) == 3, best.p, 0.0)
    near = fit_afresh(simulator, p, best.sd, renewals=0)  # type: ignore[arg-type]
    assert near is not None
    lines = simulator.lines(p)
    cost = simulator.target.cost(simulator.target.lines - lines) + prior_cost(p, best.sd)
    stopped = replace(near, p=p, lines=lines, cost=cost, misfit=cost - prior_cost(p, best.sd),
                      evidence=near.evidence - (cost - near.cost))  # fmt: skip
    worth = best.evidence - base.evidence
    assert worth > PROVISIONAL and stopped.misfit > base.misfit + worth
    found, stay = held(simulator, base, stopped, Weighed(FRICTION, worth, best))
    assert stay == ["friction"] and found.evidence == pytest.approx(best.evidence, abs=0.5)


def test_what_no_record_feels_of_an_effect_does_not_make_it_needed() -> None:
    """Flanks that stand back behind all contact cost a prior that a rig without them would pay for nothing."""
    of = np.where(np.arange(8)[:, None] == 5, 0.0, MATRIX)
    p = np.array([0.08, -0.1, 0.02, 0.0, 0.03, 0.0, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ of, target(noisy(p @ of)))
    best = fitted(simulator, RIPPLE)
    assert 5 not in best.sensitivity.quadratic.active
    far = replace(best, p=np.where(np.arange(8) == 5, 10.0 * best.sd, best.p))
    one = Weighed(RIPPLE, 3.0, best)
    plain, beside_it = (module._promised(simulator, at, one) for at in (best, far))  # type: ignore[arg-type]
    assert beside_it.log_bayes_factor == pytest.approx(plain.log_bayes_factor, abs=1e-9)
    assert plain.log_bayes_factor != one.log_bayes_factor


def test_what_entered_because_a_fit_was_on_its_way_leaves() -> None:
    """The background's fit stopped at the nominal rig; beside friction, of which there is none, it went on."""
    simulator = rig(0.0)
    base, best = fitted(simulator), fitted(simulator, FRICTION)
    stopped = replace(base, p=np.zeros(8), evidence=base.evidence - 30.0)
    entered = Weighed(FRICTION, best.evidence - stopped.evidence, best)
    assert LIMIT < entered.log_bayes_factor < CLEAR
    again, found, stay = held_against_background(
        simulator, stopped, best, (entered,), apart=False  # type: ignore[arg-type]
    )
    assert stay == () and found.evidence == pytest.approx(base.evidence, abs=0.1)
    # What was found on the way is the background's.
    assert again.evidence == found.evidence
    clear = replace(entered, log_bayes_factor=CLEAR)
    assert held(simulator, stopped, best, clear) == (best, ["friction"])


def test_what_is_there_stays_and_is_worth_what_a_fit_without_it_lacks() -> None:
    simulator = rig(0.3, 0.2, 0.0)
    best = fitted(simulator, FRICTION, RIPPLE)
    entered = (Weighed(FRICTION, 20.0, best), Weighed(RIPPLE, 10.0, best))
    _, found, stay = held_against_background(
        simulator, fitted(simulator), best, entered, apart=False  # type: ignore[arg-type]
    )
    assert found is best and [one.hypothesis.name for one in stay] == ["friction", "torque-ripple"]
    without = fitted(simulator, RIPPLE)
    assert stay[0].log_bayes_factor == pytest.approx(best.evidence - without.evidence, rel=0.05)


def test_the_least_is_what_has_least_beyond_its_own_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A number of the nominal rig enters from fewer nats: it does not keep in what has more, but too few for itself."""
    simulator = rig(0.4)
    number = Hypothesis("support-stiffness", "mesh", (Wide("stiffness"),))
    best, base = fitted(simulator, FRICTION, number), fitted(simulator, number)
    nats = {"support-stiffness": 3.5, "friction": 3.9}
    monkeypatch.setattr(
        module, "_promised", lambda simulator, best, one: replace(one, log_bayes_factor=nats[one.hypothesis.name])
    )
    monkeypatch.setattr(module, "_worth", lambda one, best, without: nats[one.hypothesis.name])
    entered = [Weighed(number, 9.0, best), Weighed(FRICTION, 9.0, best)]
    found, stay = needed(simulator, base, best, entered, apart=False)  # type: ignore[arg-type]
    assert [one.hypothesis.name for one in stay] == ["support-stiffness"]
    # It is the rig without the other, too.
    assert found is not best and found.sd[3] == base.sd[3]


def test_of_two_that_stand_in_for_each_other_one_stays() -> None:
    """Beside the other each is needless; without both the gap is open."""
    alike = MATRIX.copy()
    alike[4] = alike[3]
    simulator = FakeSimulator(lambda q: q @ alike, target(0.3 * alike[3]))
    base, best = fitted(simulator), fitted(simulator, FRICTION, RIPPLE)
    entered = [Weighed(one, 200.0, best) for one in (FRICTION, RIPPLE)]
    found, stay = needed(simulator, base, best, entered, apart=False)  # type: ignore[arg-type]
    (one,) = stay
    assert found.evidence > base.evidence + LIMIT and one.log_bayes_factor > LIMIT
    other = {"friction": 4, "torque-ripple": 3}[one.hypothesis.name]
    assert abs(found.p[other]) < 4 * base.sd[other] < 0.3 and found.sd[other] == base.sd[other]


def test_what_only_the_quadratic_can_do_without_stays() -> None:
    """A number that moves the lines as friction does, but no further than a sixth of it."""

    def lines_of(p: np.ndarray) -> np.ndarray:
        return np.where(np.arange(8) == 0, 0.0, p) @ MATRIX + 0.05 * np.tanh(p[0] / 0.05) * MATRIX[3]

    alike = MATRIX.copy()
    alike[0] = alike[3]
    simulator = FakeSimulator(lines_of, target(lines_of(np.array([0, 0, 0, 0.3, 0.2, -0.2, 0, 0]))))
    simulator.jacobian = lambda p, sd, chosen, near=None: alike  # type: ignore[method-assign, assignment]
    base, best = fitted(simulator), fitted(simulator, FRICTION, RIPPLE)
    entered = [Weighed(one, 200.0, best) for one in (FRICTION, RIPPLE)]
    assert best.p[3] == pytest.approx(0.3, abs=0.05)
    found, stay = needed(simulator, base, best, entered, apart=False)  # type: ignore[arg-type]
    assert found is best and {one.hypothesis.name for one in stay} == {"friction", "torque-ripple"}
    assert min(one.log_bayes_factor for one in stay) > LIMIT


def test_a_rig_without_an_effect_stays_as_far_from_the_nominal_one_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """A number five of its standard deviations off is none of the effect that goes."""
    true = np.array([0.5, -0.1, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0])
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(true @ MATRIX))
    best, base = fitted(simulator, FRICTION), fitted(simulator)
    assert best.p[0] > 3.0 * best.sd[0]
    begun: list[np.ndarray] = []
    monkeypatch.setattr(module, "fit", lambda simulator, p, *rest: begun.append(p))
    beside(simulator, base, best, ())  # type: ignore[arg-type]
    np.testing.assert_allclose(begun[0], best.p, atol=0.02)


@pytest.mark.parametrize(("deviations", "stays"), [(3.7, False), (4.5, True)])
def test_what_the_background_explains_as_well_must_be_far_larger(deviations: float, stays: bool) -> None:
    """Lines that leave no doubt: the prior alone speaks, and a good rig may have a little more than its share."""
    size = 0.01 * deviations
    simulator = rig(0.0, size, size)
    best = fitted(simulator, RIPPLE)
    assert best.p[4:6] == pytest.approx([size, size], rel=0.01)
    base = fitted(simulator)
    assert base.misfit - best.misfit < 1.0 and best.evidence - base.evidence > PROVISIONAL
    _, found, stay = held_against_background(
        simulator, base, best, (Weighed(RIPPLE, 10.0, best),), apart=True  # type: ignore[arg-type]
    )
    assert [one.hypothesis.name for one in stay] == (["torque-ripple"] if stays else [])
    assert (found is best) == stays


@pytest.mark.parametrize("count", [2, 8, 24, 100])
def test_many_numbers_need_not_be_as_far_each(count: int) -> None:
    """Of rigs with twice a good one's share of everything, so many have as much: by draws."""
    drawn = 2.0 * np.random.default_rng(count).standard_normal((20000, count))
    part = float((np.sqrt((drawn**2).mean(axis=1)) > far_of(count)).mean())
    assert part == pytest.approx(0.03, abs=0.005)
    assert far_of(count) < far_of(1) == FAR


@pytest.mark.parametrize(("deviations", "stays"), [(2.2, False), (3.0, True)])
def test_a_ripple_in_many_orders_that_no_good_rig_has_is_one(deviations: float, stays: bool) -> None:
    """As above, for an effect of twenty-four numbers."""
    listed = unknowns_of([group("ripple", "1", 24, 0.01, 0.5, slot="torque")], 2)
    size = 0.01 * deviations * np.where(np.arange(24) % 2, -1.0, 1.0)
    at = SimpleNamespace(p=size, misfit=0.0)
    ripple = Hypothesis("torque-ripple", "drive", (Wide("ripple"),))
    assert module._is_background(listed, ripple, at, SimpleNamespace(misfit=3.0)) != stays  # type: ignore[arg-type]


def test_flanks_that_stand_back_everywhere_have_no_error_of_form() -> None:
    here = unknowns_of([group(FLANKS, "m", ("even", *"abcd"), 0.2, 1.2, slot="excess")], 2)
    flanks = Hypothesis("profile-error flanks", "mesh", (Wide(FLANKS),))
    form = np.array([-3.0, -0.4, 0.0, 0.4, -0.4])
    assert size_of(here, flanks, form) == pytest.approx(np.sqrt(0.6) * 2.0)
    told = np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    assert size_of(here, flanks, form, told) == pytest.approx(2.0)


def test_a_driven_angle_that_is_early_is_no_delay() -> None:
    here = unknowns_of([group(FOLLOWED, "s", ("delay",), 2e-6, slot="delay")], 2)
    late = Hypothesis("sensor-delay angle_driven", "sensor", (Wide(FOLLOWED),))
    assert size_of(here, late, np.array([8e-6])) == pytest.approx(4.0)
    assert size_of(here, late, np.array([-8e-6])) == 0.0


def test_what_was_held_counts_in_the_evidence_as_where_it_is_not() -> None:
    """Laplace by hand: half the logarithm of the determinant of the posterior's precision over the prior's."""
    simulator = rig(0.06)
    free = prior_of(simulator, unknowns().prior())  # type: ignore[arg-type]
    held = np.where(np.arange(8) < 3, free, 0.0)
    found = fit_afresh(simulator, np.zeros(8), held, renewals=4)  # type: ignore[arg-type]
    assert found is not None and found.evidence_under(held) == pytest.approx(found.evidence)
    near = found.sensitivity.quadratic
    for prior in (free, 0.5 * held):
        wide = prior[near.active] > 0.0
        information = near.information(np.zeros(len(near.active)))[np.ix_(wide, wide)]
        sd = prior[near.active][wide]
        half = 0.5 * (np.linalg.slogdet(information + np.diag(sd**-2.0))[1] + 2 * np.log(sd).sum())
        cost = found.misfit + 0.5 * float(((found.p[near.active][wide] / sd) ** 2).sum())
        assert found.evidence_under(prior) == pytest.approx(-cost - half)
    assert found.evidence_under(free) < found.evidence - 1.0
