"""Probabilities from known cases: against counts, a grid of the posterior, and what they must not claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearbench.diagnosis.odds import (
    MARGIN,
    WIDTHS,
    Calibration,
    Known,
    Odds,
    calibrated,
    called_signs,
    candidate_rows,
    effect_signs,
    fitted,
    nothing_known,
    unknown_signs,
)
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.verdict import Candidate, Effect, Probabilities, Verdict

BLANK = replace(POPULATION, effect=nothing_known(WIDTHS["effect"]), unknown=nothing_known(WIDTHS["unknown"]))
SIGNS = {"lines": 400.0, "unknown": 0.4, "left": 0.3, "remains": 0.04, "changing": 0.001, "over drive": 0.4}


def known(kind: str, *, named: str = "", evidence: float = 1.0, effects: tuple[str, ...] = (), **signs: float) -> Known:
    """A diagnosis with one candidate, "friction", of so many nats, and what it names."""
    called = called_signs(named, evidence, 3.0) if named else {}
    verdict = Verdict(
        verdict="effects" if named else "none",
        probability=Probabilities(effect=0.2, none=0.7, unknown=0.1),
        effects=(Effect(name=named, probability=0.9, grows=3.0),) if named else (),
        candidates=(Candidate(effects=(), log_evidence=0.0), Candidate(effects=("friction",), log_evidence=evidence)),
        place="mesh" if named else "none",
        signs=SIGNS | called | signs,
    )
    return Known(verdict, kind, effects)


def test_before_any_rig_everything_is_as_likely_as_not_and_nothing_is_sure() -> None:
    chance = BLANK.effect.of(effect_signs(50.0, 400.0, 3.0))
    assert chance.value == 0.5 and chance.low < 0.01 and chance.high > 0.99


def test_many_cases_without_signs_give_their_share() -> None:
    true = [True] * 900 + [False] * 100
    found = fitted(nothing_known((10.0,)), np.ones((1000, 1)), true)
    assert found.of((1.0,)).value == pytest.approx(0.9, abs=1e-3)
    low, high = 0.9 - 1.645 * 0.0095, 0.9 + 1.645 * 0.0095  # the binomial's normal interval
    assert (found.of((1.0,)).low, found.of((1.0,)).high) == pytest.approx((low, high), abs=2e-3)
    assert (found.cases, found.true) == (1000, 900)


def test_the_mode_is_that_of_the_posterior_on_a_grid() -> None:
    rng = np.random.default_rng(3)
    x = np.stack([np.ones(30), rng.normal(size=30)], axis=1)
    true = rng.random(30) < 1 / (1 + np.exp(-(0.5 + 2.0 * x[:, 1])))
    found = fitted(nothing_known((1.5, 1.0)), x, list(true))
    a, b = np.meshgrid(np.linspace(-3, 3, 601), np.linspace(-3, 3, 601), indexing="ij")
    logits = a[..., None] + b[..., None] * x[:, 1]
    cost = (np.logaddexp(0.0, logits) - true * logits).sum(axis=-1) + 0.5 * ((a / 1.5) ** 2 + b**2)
    best = np.unravel_index(np.argmin(cost), cost.shape)
    assert found.weights == pytest.approx((a[best], b[best]), abs=0.006)
    # And the prior counts: another mean moves the mode towards it.
    moved = fitted(Odds((3.0, 0.0), ((0.01, 0.0), (0.0, 1.0))), x, list(true))
    assert moved.weights[0] > 2.5


def test_evidence_counts_by_the_number_of_lines() -> None:
    assert effect_signs(20.0, 400.0, None) == effect_signs(40.0, 800.0, None)
    assert effect_signs(-20.0, 400.0, None)[1] == -effect_signs(20.0, 400.0, None)[1]
    assert unknown_signs(0.0) == unknown_signs(1e-9)


def test_what_is_named_counts_by_what_it_closes_and_nothing_less_than_nothing() -> None:
    assert effect_signs(0.0, 400.0, np.e) == (1.0, 0.0, 1.0, pytest.approx(1.0))
    assert effect_signs(0.0, 400.0, 0.2) == effect_signs(0.0, 400.0, 1.0) == (1.0, 0.0, 1.0, 0.0)
    assert effect_signs(0.0, 400.0, None) == (1.0, 0.0, 0.0, 0.0)


def test_probabilities_learn_from_truth_rigs_and_add_up() -> None:
    cases = [known("effect", named="friction", evidence=60.0, effects=("friction",)) for _ in range(6)]
    cases += [known("none", evidence=-3.0) for _ in range(6)] + [known("foreign", unknown=3.0) for _ in range(6)]
    made = calibrated(BLANK, cases)
    assert (made.source, made.rigs) == ("this rig", 18)
    strong = made.probabilities(effect_signs(60.0, 400.0, 3.0), 0.4)
    sound = made.probabilities(effect_signs(-3.0, 400.0, None), 0.4)
    strange = made.probabilities(effect_signs(-3.0, 400.0, None), 3.0)
    for one in (strong, sound, strange):
        assert sum(one.values()) == pytest.approx(1.0) and min(one.values()) > 0.0
    assert strong["effect"] > 0.85 and sound["none"] > 0.7 and strange["unknown"] > 0.7
    # Six rigs of each kind cannot make anything certain.
    assert strong["effect"] < 0.995


def test_limits_of_a_rig_are_what_its_sound_rigs_leave() -> None:
    sound = [known("none", remains=0.2, changing=0.04), known("none", remains=0.1, **{"over drive": 2.0})]
    made = calibrated(BLANK, [*sound, known("foreign", remains=0.9, changing=0.5)])
    assert made.structure == pytest.approx(MARGIN * 0.2) and made.changing == pytest.approx(MARGIN * 0.04)
    assert made.outstanding == pytest.approx({"drive": MARGIN * 2.0})
    # Few rigs do not lower a limit by more than half, and without a sound one it stays.
    elsewhere = [known("none", remains=0.9, searched=0.2), known("none", remains=0.3, searched=0.0)]
    assert calibrated(BLANK, elsewhere).structure == pytest.approx(MARGIN * 0.2)
    calm = calibrated(BLANK, [known("none", remains=0.0, changing=0.0, **{"over drive": 0.0})])
    assert (calm.structure, calm.changing) == (0.5 * BLANK.structure, 0.5 * BLANK.changing)
    assert calm.outstanding == {"drive": 0.5}
    assert calibrated(BLANK, [known("foreign", remains=0.9)]).structure == BLANK.structure


def test_no_sign_speaks_against_what_it_is_a_sign_of() -> None:
    rng = np.random.default_rng(11)
    x = np.stack([np.ones(60), rng.normal(size=60), rng.random(60)], axis=1)
    true = list(rng.random(60) < 1 / (1 + np.exp(-(1.0 + x[:, 1] - 3.0 * x[:, 2]))))
    found = fitted(nothing_known((2.0, 2.0, 2.0)), x, true)
    assert found.weights[2] == 0.0
    # What has no weight may as well not be there.
    without = fitted(nothing_known((2.0, 2.0)), x[:, :2], true)
    assert found.weights[:2] == pytest.approx(without.weights, abs=1e-5)
    # Where it speaks for it, it has its weight: the same cases turned round.
    turned = fitted(nothing_known((2.0, 2.0, 2.0)), x * [1.0, 1.0, -1.0], true)
    assert turned.weights[2] > 1.0


def test_what_the_record_calls_for_counts_by_its_own_evidence_named_or_not() -> None:
    told = known("effect", evidence=1.0, effects=("friction",), **called_signs("friction", 40.0, 5.0))
    assert candidate_rows(told) == [(effect_signs(40.0, 400.0, 5.0), True)]
    # A drift is no candidate of the search, but is called for.
    drift = known("effect", effects=("temperature-drift",), **called_signs("temperature-drift", 30.0, 2.0))
    assert (effect_signs(30.0, 400.0, 2.0), True) in candidate_rows(drift)


@pytest.mark.parametrize("truth, classes, right", [
    ("eccentricity", (), True),
    ("encoder-runout", (), False),
    ("encoder-runout", (("eccentricity", "encoder-runout"),), True),
    ("encoder-runout", (("pitch-error", "encoder-runout"),), False),
    ("friction", (("eccentricity", "encoder-runout"),), False),
])  # fmt: skip
def test_a_name_is_true_where_the_true_one_is_not_told_from_it(
    truth: str, classes: tuple[tuple[str, ...], ...], right: bool
) -> None:
    one = known("effect", named="eccentricity", evidence=30.0, effects=(truth,))
    verdict = one.verdict.model_copy(update={"indistinguishable": classes})
    rows = dict(zip(("friction", "eccentricity"), candidate_rows(one._replace(verdict=verdict)), strict=True))
    assert rows["eccentricity"] == (effect_signs(30.0, 400.0, 3.0), right)
    # What is named as well is no other name of it.
    both = verdict.model_copy(update={"effects": (*verdict.effects, Effect(name="encoder-runout", probability=0.9))})
    beside = dict(zip(("friction", "eccentricity"), candidate_rows(one._replace(verdict=both)), strict=True))
    assert beside["eccentricity"][1] == (truth == "eccentricity")


def test_what_was_named_wrongly_teaches_doubt() -> None:
    right = [known("effect", named="friction", evidence=60.0, effects=("friction",)) for _ in range(4)]
    wrong = [known("none", named="friction", evidence=60.0) for _ in range(4)]
    signs = effect_signs(60.0, 400.0, 3.0)

    def after(cases: list[Known]) -> Calibration:
        return calibrated(BLANK, cases)

    assert after(right).effect.of(signs).value > 0.8
    assert after([*right, *wrong]).effect.of(signs).value == pytest.approx(0.5, abs=0.02)
