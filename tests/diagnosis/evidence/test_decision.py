"""Decisions on searches made by hand: what is named, what is refused, and where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.library import LIBRARY
from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.decision import Decision, decide
from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.search import Search, Tried
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import Unsteady
from gearbench.rig.contract import Place

HAND = replace(
    LIMITS,
    effect=5.0,
    size=2.0,
    rival=0.5,
    free=10.0,
    competitor_factor=1.5,
    competitor_offset=20.0,
    silent=dict(zip(PLACES, (100.0, 200.0, 300.0, 400.0, 500.0), strict=True)),
    unsteady=dict(zip(PLACES, (10.0, 20.0, 30.0, 40.0, 50.0), strict=True)),
)
ONE = np.ones(1)
FIT = Fit(ONE, ONE, np.eye(1), np.eye(1), ONE, (), 0.0, 0.0, 1)
QUIET = np.zeros(5)


EFFECTS = {one.name: replace(one, limit=30.0 if one.limit else None) for one in LIBRARY}


def effect(name: str, factor: float, *, place: Place = "mesh", fitted: bool = True, size: float = 5.0) -> Tried:
    return Tried(Hypothesis(name, place, (), effect=EFFECTS[name]), factor, FIT if fitted else None, size)


def free(place: Place, factor: float) -> Tried:
    return Tried(Hypothesis(f"free {place}", place, ()), factor, FIT, 0.0)


def decided(
    *tried: Tried, silent: np.ndarray = QUIET, unsteady: np.ndarray = QUIET, limits: Limits = HAND
) -> Decision:
    found = Search(FIT, tuple(sorted(tried, key=lambda one: -one.log_bayes_factor)))
    decision = decide(found, silent, Unsteady(unsteady, unsteady), limits)
    assert decision.sign >= 0.0 and (decision.sign > 1.0) == (decision.verdict == "unknown")
    assert (decision.winner is not None) == (decision.verdict == "effects")
    return decision


def at(number: int, value: float) -> np.ndarray:
    return np.where(np.arange(5) == number, value, 0.0)


def test_the_effect_with_most_evidence_is_named_at_its_place() -> None:
    weak, strong = effect("friction", 8.0), effect("coupling", 12.0, place="drive")
    found = decided(weak, strong, free("mesh", 3.0))
    assert (found.verdict, found.place) == ("effects", "drive")
    assert found.winner is strong


@pytest.mark.parametrize(
    "tried",
    [
        (),
        (effect("friction", 4.9),),
        (effect("friction", 50.0, fitted=False),),  # predicted, but not worth a fit
        (effect("friction", 50.0, size=1.5),),  # no larger than a background
        (effect("pitch-error", 29.0),),  # has a limit of its own
        (free("mesh", 9.0),),
    ],
)
def test_no_effect_without_enough_of_it(tried: tuple[Tried, ...]) -> None:
    found = decided(*tried)
    assert (found.verdict, found.place) == ("none", "none")


def test_an_effect_below_its_own_limit_gives_way_to_one_above() -> None:
    found = decided(effect("pitch-error", 29.0), effect("friction", 15.0))
    assert found.winner is not None and found.winner.hypothesis.effect is EFFECTS["friction"]
    found = decided(effect("pitch-error", 31.0), effect("friction", 6.0))
    assert found.winner is not None and found.winner.hypothesis.effect is EFFECTS["pitch-error"]


def test_a_large_rival_without_clearance_silences_a_weak_effect() -> None:
    assert decided(effect("pitch-error", 29.0), effect("friction", 14.0)).verdict == "none"
    small = effect("pitch-error", 29.0, size=1.9)
    assert decided(small, effect("friction", 14.0)).verdict == "effects"


def test_a_free_form_that_explains_clearly_more_refutes_an_effect() -> None:
    # 1.5 * 20 + 20 = 50
    assert decided(effect("friction", 20.0), free("drive", 49.0)).verdict == "effects"
    found = decided(effect("friction", 20.0), free("drive", 51.0))
    assert (found.verdict, found.place) == ("unknown", "drive")
    # Without an effect its own limit counts.
    assert decided(effect("friction", 1.0), free("driven-support", 11.0)).place == "driven-support"
    assert decided(effect("friction", 1.0), free("driven-support", 9.0)).verdict == "none"


@pytest.mark.parametrize(
    ("number", "place"), list(enumerate(("drive", "driver-support", "load", "driven-support", "mesh")))
)
def test_a_force_beyond_its_limit_is_an_unknown_cause_there(number: int, place: str) -> None:
    strong = effect("friction", 60.0)
    limit = HAND.silent[place]
    found = decided(strong, silent=at(number, 1.1 * limit))
    assert (found.verdict, found.place) == ("unknown", place)
    assert decided(strong, silent=at(number, 0.9 * limit)).verdict == "effects"
    found = decided(effect("friction", 1e4), unsteady=at(number, 1.1 * HAND.unsteady[place]))
    assert (found.verdict, found.place) == ("unknown", place)
    assert decided(strong, unsteady=at(number, 0.9 * HAND.unsteady[place])).verdict == "effects"


def test_an_effect_that_explains_more_than_is_left_stays() -> None:
    assert decided(effect("friction", 700.0), silent=at(4, 600.0)).verdict == "effects"


def test_the_place_furthest_beyond_its_limit_gives_the_place() -> None:
    silent = at(0, 150.0) + at(4, 600.0)  # 1.5 and 1.2 times the limits
    assert decided(silent=silent).place == "drive"
    assert decided(unsteady=at(0, 15.0) + at(4, 90.0)).place == "mesh"


def test_limits_in_use_are_positive_and_reasons_are_sentences() -> None:
    assert min(LIMITS.effect, LIMITS.free, *LIMITS.silent.values(), *LIMITS.unsteady.values()) > 0
    assert "drive" in decided(silent=at(0, 1e5)).because
    assert "changes" in decided(unsteady=at(0, 1e5)).because
