"""Decisions on what was judged, made by hand: what is named, what is refused, and where."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.library import LIBRARY
from gearbench.diagnosis.evidence.calibration import LIMITS
from gearbench.diagnosis.output.missing import OUTSTANDING, Missing
from gearbench.diagnosis.output.verdict_of import GREATER, STRUCTURE, VISIBLE, Decided, decide_simulated

EFFECT = next(one for one in LIBRARY if one.name == "friction")
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),), effect=EFFECT)
QUIET = np.zeros(5)
HAND = replace(LIMITS, competitor_factor=1.5, competitor_offset=20.0, free=10.0)


def decided(
    worth: float | None,
    *,
    left: float = 0.05,
    remains: float = 0.05,
    share: float = 0.2,
    free: float = 0.0,
    excess: np.ndarray = QUIET,
    unsteady: np.ndarray = QUIET,
    changing: float = 0.0,
) -> Decided:
    """`worth` nats of friction (None: nothing was kept), which closes `share` of the gap; `left` of the nominal gap,
    `remains` of a channel's fluctuation in the end."""
    entered: tuple[Any, ...] = ()
    if worth is not None:
        entered = (SimpleNamespace(hypothesis=FRICTION, log_bayes_factor=worth),)
    judged: Any = SimpleNamespace(
        found=SimpleNamespace(selection=SimpleNamespace(entered=entered, weighed=entered)),
        closings={"friction": SimpleNamespace(without={})},
        share=lambda signals: share,
        left=left,
        remains=remains,
    )
    form = SimpleNamespace(hypothesis=Hypothesis("free drive", "drive", ()), log_bayes_factor=free)
    forces: Any = SimpleNamespace(best_free=form if free else None, tried=())
    missing = Missing(excess, ((0.0, 100.0),), np.ones((1, 5)))
    made = decide_simulated(judged, forces, missing, unsteady, changing, HAND)
    assert sum(made.probability.values()) == pytest.approx(1.0) and min(made.probability.values()) >= 0.0
    return made


def at(number: int, value: float) -> np.ndarray:
    return np.where(np.arange(5) == number, value, 0.0)


def test_what_was_kept_is_named_at_its_place_even_if_a_remainder_stays() -> None:
    made = decided(40.0)
    assert (made.verdict, made.place) == ("effects", "mesh") and made.probability["effect"] > 0.9
    made = decided(40.0, left=0.9, remains=5 * STRUCTURE, excess=at(0, 50.0))
    assert made.verdict == "effects" and made.probability["effect"] < 0.95
    assert decided(None).verdict == "none"


def test_the_greater_part_unexplained_is_unknown_unless_any_rig_leaves_as_much() -> None:
    much = {"left": 1.1 * GREATER, "remains": 1.1 * STRUCTURE}
    assert decided(None, **much).verdict == "unknown" and decided(None, **much).place == "none"
    assert decided(None, **much, excess=at(3, 2 * OUTSTANDING["driven-support"])).place == "driven-support"
    assert decided(None, **(much | {"left": 0.9 * GREATER})).verdict == "none"
    assert decided(None, **(much | {"remains": 0.9 * STRUCTURE})).verdict == "none"


def test_a_place_that_stands_out_is_unknown_only_over_a_visible_remainder() -> None:
    out = at(0, 1.1 * OUTSTANDING["drive"])
    made = decided(None, remains=1.1 * VISIBLE, excess=out)
    assert (made.verdict, made.place) == ("unknown", "drive")
    assert decided(None, remains=0.9 * VISIBLE, excess=out).verdict == "none"
    assert decided(None, remains=1.1 * STRUCTURE, excess=at(0, 0.9 * OUTSTANDING["drive"])).verdict == "none"


def test_probabilities_follow_the_evidence_and_the_remainder() -> None:
    sure = [decided(worth).probability["effect"] for worth in (8.5, 12.0, 30.0)]
    assert sure[0] < sure[1] < sure[2] and sure[0] < 0.7
    stands = [at(0, factor * OUTSTANDING["drive"]) for factor in (1.1, 8.0)]
    near, far = (decided(None, remains=9 * STRUCTURE, excess=one).probability["unknown"] for one in stands)
    assert 0.5 < near < far < 1.0


def test_a_form_without_a_name_outbids_only_an_effect_that_leaves_the_gap() -> None:
    assert decided(40.0, free=90.0).verdict == "unknown"
    assert decided(40.0, free=70.0).verdict == "effects"
    assert decided(40.0, share=0.8, free=900.0).verdict == "effects"
    assert decided(None, free=900.0).verdict == "none"


def test_what_changes_counts_by_its_part_of_the_gap() -> None:
    out = at(3, 1.1 * HAND.unsteady["driven-support"])
    made = decided(900.0, unsteady=out, changing=0.3)
    assert (made.verdict, made.place) == ("unknown", "driven-support") and "repetition" in made.because[0]
    assert decided(900.0, unsteady=out, changing=0.02).verdict == "effects"
    assert decided(None, unsteady=out, changing=0.02).verdict == "none"
    assert decided(None, unsteady=out, changing=0.04).place == "driven-support"
    assert decided(900.0, unsteady=out, changing=0.3, share=0.8).verdict == "effects"
