"""Decisions on selections made by hand: what is named, what is refused, and where."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.fake_simulator import LINES, target, unknowns

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.library import LIBRARY
from gearbench.diagnosis.evidence.calibration import LIMITS
from gearbench.diagnosis.output.verdict_of import Decided, decide_simulated

EFFECT = next(one for one in LIBRARY if one.name == "friction")
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),), effect=EFFECT)
QUIET = np.zeros(5)
HAND = replace(LIMITS, competitor_factor=1.5, competitor_offset=20.0, free=10.0)
MEASURED = np.ones(LINES, dtype=complex)


def decided(
    worth: float | None,
    *,
    without: float = 0.5,
    left: float = 0.05,
    size: float = 0.4,
    free: float = 0.0,
    silent: np.ndarray = QUIET,
    unsteady: np.ndarray = QUIET,
) -> Decided:
    """`worth` nats of friction (None: nothing entered); `without` and `left` of the fluctuation without and with it."""
    p = np.zeros(unknowns().size)
    p[3] = size
    base: Any = SimpleNamespace(lines=MEASURED * (1 - without))
    best: Any = SimpleNamespace(lines=MEASURED * (1 - left), p=p, sd=np.full(8, 0.5))
    entered: tuple[Any, ...] = ()
    if worth is not None:
        entered = (SimpleNamespace(hypothesis=FRICTION, log_bayes_factor=worth),)
    selection = SimpleNamespace(base=base, best=best if entered else base, entered=entered, weighed=entered)
    found: Any = SimpleNamespace(
        selection=selection,
        layout=SimpleNamespace(unknowns=unknowns()),
        simulator=SimpleNamespace(target=target(MEASURED)),
        std=np.full(8, 1e-3),
    )
    form = SimpleNamespace(hypothesis=Hypothesis("free drive", "drive", ()), log_bayes_factor=free)
    forces: Any = SimpleNamespace(best_free=form if free else None, tried=())
    made = decide_simulated(found, forces, silent, unsteady, HAND)
    assert sum(made.probability.values()) == pytest.approx(1.0) and min(made.probability.values()) >= 0.0
    return made


def at(number: int, value: float) -> np.ndarray:
    return np.where(np.arange(5) == number, value, 0.0)


def test_what_entered_is_named_at_its_place_unless_a_good_rig_has_as_much() -> None:
    made = decided(40.0)
    assert (made.verdict, made.place) == ("effect", "mesh") and made.probability["effect"] > 0.9
    assert decided(40.0, size=0.015).verdict == "none"
    assert decided(None, without=0.05).verdict == "none"


def test_probabilities_follow_the_evidence() -> None:
    sure = [decided(worth).probability["effect"] for worth in (8.5, 12.0, 30.0)]
    assert sure[0] < sure[1] < sure[2] and sure[0] < 0.7
    near, far = (decided(None, without=0.5, silent=at(0, value)).probability["unknown"] for value in (160.0, 1600.0))
    assert 0.5 < near < far < 1.0


def test_a_form_without_a_name_outbids_only_an_effect_that_leaves_the_gap() -> None:
    assert decided(40.0, without=0.5, left=0.4, free=90.0).verdict == "unknown"
    assert decided(40.0, without=0.5, left=0.4, free=70.0).verdict == "effect"
    assert decided(40.0, without=0.5, left=0.05, free=900.0).verdict == "effect"
    assert decided(None, without=0.5, free=11.0).place == "drive"
    assert decided(None, without=0.17, free=900.0).verdict == "none"  # a rig's structure leaves as much


def test_audits_refuse_what_changes_and_what_remains() -> None:
    limit = HAND.unsteady["driven-support"]
    made = decided(900.0, unsteady=at(3, 1.1 * limit))
    assert (made.verdict, made.place) == ("unknown", "driven-support") and "repetition" in made.because
    limit = HAND.silent["drive"]
    assert decided(None, without=0.5, silent=at(0, 1.1 * limit)).place == "drive"
    assert decided(None, without=0.5, silent=at(0, 0.9 * limit)).verdict == "none"
    assert decided(None, without=0.05, silent=at(0, 1.1 * limit)).verdict == "none"
    assert decided(40.0, silent=at(0, 1e4)).verdict == "effect"
