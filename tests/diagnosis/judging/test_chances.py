"""How likely an effect is, where its size or the judged record has spoken against it."""

from __future__ import annotations

from dataclasses import replace
from math import exp, log
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.diagnosis.effects.effect import Wide
from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.judging.chances import (
    LIKELY,
    Called,
    Chances,
    chances_of,
    sentence_of_doubt,
    signs_of_called,
    unlikely,
)
from gearbench.diagnosis.odds import effect_signs
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.selection.weighing import Weighed

LINES = 900.0


def weighed(name: str, evidence: float) -> Any:
    hypothesis: Any = SimpleNamespace(name=name, effect=SimpleNamespace(name=name))
    return Weighed(hypothesis, evidence, None)


def test_an_effect_that_entered_and_is_not_named_makes_none_likely() -> None:
    backlash, friction = weighed("backlash", 824.0), weighed("friction", 1.0)
    selection = SimpleNamespace(weighed=(backlash, friction))
    decided: Any = SimpleNamespace(named=(), drift=None)

    def best(*entered: Any) -> tuple[float, ...]:
        judged: Any = SimpleNamespace(found=SimpleNamespace(selection=selection), closings={})
        return chances_of(judged, decided, POPULATION, LINES, entered).best

    assert best() == effect_signs(824.0, LINES, None)
    assert best(backlash) == effect_signs(1.0, LINES, None)


def test_what_shows_only_beside_another_effect_is_as_likely_as_it_is_worth_there() -> None:
    first, second = weighed("coupling", 300.0), weighed("pitch-error", 90.0)
    selection = SimpleNamespace(weighed=(first, weighed("pitch-error", -4.0)))
    closing = SimpleNamespace(growth=2.5, optimum=None)
    judged: Any = SimpleNamespace(
        found=SimpleNamespace(selection=selection),
        closings={"coupling": closing, "pitch-error": closing},
    )
    decided: Any = SimpleNamespace(named=(first, second), drift=None)
    named = chances_of(judged, decided, POPULATION, LINES, ()).named
    assert named["pitch-error"] == POPULATION.effect.of(effect_signs(90.0, LINES, 2.5)).value
    assert named["coupling"] == POPULATION.effect.of(effect_signs(300.0, LINES, 2.5)).value


def test_a_name_that_stands_for_a_rare_counterpart_is_as_likely_as_either() -> None:
    """Three nats more for the rare one: one in twenty of what speaks for either is for the usual one alone."""
    usual, rare, other = weighed("eccentricity", 10.0), weighed("encoder-runout", 13.0), weighed("pitch-error", 12.0)
    rare.hypothesis.gives_way_to = lambda one: one is usual.hypothesis
    other.hypothesis.gives_way_to = lambda one: False
    judged: Any = SimpleNamespace(
        found=SimpleNamespace(selection=SimpleNamespace(weighed=(rare, other, usual))),
        closings={"eccentricity": SimpleNamespace(growth=2.5, optimum=None)},
    )

    def best(*rivals: Any) -> tuple[float, ...]:
        named = replace(usual, rivals=tuple(one.hypothesis for one in rivals))
        decided: Any = SimpleNamespace(named=(named,), drift=None)
        return chances_of(judged, decided, POPULATION, LINES, ()).best

    assert best() == best(other) == effect_signs(10.0, LINES, 2.5)
    assert best(rare, other) == pytest.approx(effect_signs(10.0 + log(1.0 + exp(3.0)), LINES, 2.5))


@pytest.mark.parametrize(
    ("key", "told", "worth"),
    [("mesh-ratio", 4.0, 30.0 - log(2.0)), ("friction", 4.0, 4.0), ("friction", 180.0, 20.0 - log(2.0))],
)
def test_what_is_named_counts_as_much_as_over_a_rig_that_was_fitted_without_it(
    key: str, told: float, worth: float
) -> None:
    """Recalibration moves a number of the nominal rig anywhere at the price of its prior: what the records insist on is
    told by a rig with it where its uncertainty ends. Of an effect of its own a background's share is what it is held
    against, but slopes may promise more than a rig without it lacks."""
    one = weighed("effect", told)
    one.hypothesis.wide, one.hypothesis.choices = (Wide(key),), 2
    one.hypothesis.entries = Wide(key).entries
    groups = [group("mesh-ratio", "1", 1, 0.4, slot="x"), group("friction", "1", 1, 0.01, 0.1, slot="y")]
    unknowns = unknowns_of(groups, 50)
    best = SimpleNamespace(evidence=-70.0, sd=np.array([0.4, 0.1]))
    found = SimpleNamespace(
        selection=SimpleNamespace(weighed=(one,), entered=(one,), best=best),
        layout=SimpleNamespace(unknowns=unknowns),
    )
    held = {(0.0, 0.1): -100.0, (0.4, 0.0): -90.0}
    optimum = SimpleNamespace(evidence_under=lambda sd: held[tuple(sd)])
    closing = SimpleNamespace(growth=2.5, optimum=optimum)
    judged: Any = SimpleNamespace(found=found, closings={"effect": closing})
    decided: Any = SimpleNamespace(named=(one,), drift=None)
    assert chances_of(judged, decided, POPULATION, LINES, ()).best == effect_signs(worth, LINES, 2.5)


def test_what_is_not_twice_as_likely_at_work_as_not_is_not_named() -> None:
    """The least likely goes first: what it leaves may speak for the others."""
    one, other, sure = weighed("friction", 9.0), weighed("sensor-delay", 8.0), weighed("coupling", 99.0)
    decided: Any = SimpleNamespace(named=(one, other, sure))
    chances = Chances({"friction": 0.63, "sensor-delay": 0.41, "coupling": 0.98}, {}, ())
    assert unlikely(decided, chances) is other
    assert unlikely(SimpleNamespace(named=(sure, one)), chances) is one  # type: ignore[arg-type]
    assert unlikely(SimpleNamespace(named=(sure,)), chances) is None  # type: ignore[arg-type]
    assert unlikely(SimpleNamespace(named=(one,)), Chances({"friction": LIKELY}, {}, ())) is None  # type: ignore[arg-type]
    other.hypothesis.effect.noun = "a delay of one sensor"
    said = sentence_of_doubt(other, chances)
    assert said.startswith("A delay of one sensor would close") and said.endswith("(41 %)")


def test_a_verdict_keeps_what_speaks_for_an_effect_in_the_place_where_it_is_likeliest() -> None:
    one, two = Called("sensor-delay", 20.0, 3.0), Called("sensor-delay", 30.0, 2.0)
    named = {"sensor-delay y_driver": 0.9, "sensor-delay y_driven": 0.8, "friction": 0.4}
    called = dict(zip(named, (one, two, Called("friction", 5.0, 1.5)), strict=True))
    chances = Chances(named, called, ())
    assert signs_of_called(chances, ["friction"]) == {"nats friction": 5.0, "grows friction": 1.5}
    assert signs_of_called(chances, [name for name in named if name.startswith("sensor")]) == {
        "nats sensor-delay": 20.0, "grows sensor-delay": 3.0,
    }  # fmt: skip
