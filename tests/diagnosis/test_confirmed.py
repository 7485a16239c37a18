"""What finite elements say of a diagnosis: sentences, advice, and a model that cannot answer."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.measured import channels, nominal, record

from gearbench.diagnosis import confirmed as module
from gearbench.diagnosis.confirmed import advice_on, confirmed_by_elements
from gearbench.diagnosis.diagnosis import take_in
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.friction import FRICTION
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.judging.closing import Closing
from gearbench.diagnosis.judging.elements import ByElements
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.verdict import Confirmed, Effect, Probabilities, Verdict
from gearbench.diagnosis.verdict_file import parse_verdict, verdict_json
from gearbench.diagnosis.words import length

HYPOTHESIS = Hypothesis("friction", "mesh", (Wide("friction"),), effect=FRICTION)
UNIT = {"torque_driven": 1.0}
NAMED = (Effect(name="friction", probability=0.9),)


def asked(monkeypatch: pytest.MonkeyPatch, closing: Closing) -> Confirmed:
    """What is said where the gap of finite elements is 3, 2 and 1 um in all channels, and friction closes that."""
    measured = take_in([record(channels(), condition="base")], nominal()).measurements[0]
    mean = {name: values.mean(axis=0) for name, values in measured_channels(measured).items()}
    wave = np.random.default_rng(1).standard_normal(measured.phase.size)
    signals = {
        stage: {name: values + size * UNIT.get(name, 1e-6) * wave for name, values in mean.items()}
        for stage, size in (("nominal", 3.0), ("recalibrated", 2.0), ("with_effect", 1.0))
    }
    answer = ByElements({}, signals, {"friction": closing}, None, ("rig.damping.mesh_exponent",))
    monkeypatch.setattr(module, "by_elements", lambda judged, effects, report: answer)
    selection = SimpleNamespace(entered=[Weighed(HYPOTHESIS, 0.0, None)])
    layout = SimpleNamespace(nominal=nominal())
    judged: Any = SimpleNamespace(measured=measured, found=SimpleNamespace(selection=selection, layout=layout))
    return confirmed_by_elements(judged, NAMED, lambda step: None)


def test_an_effect_that_elements_need_too_is_confirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    told = asked(monkeypatch, Closing(40.0, 3.5, ("torque_driven", "operating"), {}))
    assert told.effects[0].confirmed and told.effects[0].growth == 3.5 and not advice_on(told)
    gap = told.gap[0]
    assert gap.channel == "dte" and gap.with_effect is not None
    sizes = gap.nominal.value, gap.recalibrated.value, gap.with_effect.value
    assert sizes == pytest.approx(np.array([3.0, 2.0, 1.0]) * gap.with_effect.value)
    first, second, third = told.because
    one, two, three = (length(1e6 * size) for size in sizes)
    assert f"from {one} to {two} um rms recalibrated and {three} um with what was found" in first
    assert "confirm friction between the flanks" in second and "at the mesh orders is 3.5 times as large" in second
    assert "left out there: rig.damping.mesh_exponent" in third


def test_an_effect_that_elements_do_without_stays_named_with_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    told = asked(monkeypatch, Closing(1.2, 1.04, ("dte", "excited"), {}))
    assert not told.effects[0].confirmed
    assert "do not confirm friction" in told.because[1] and "1.0 times as large" in told.because[1]
    assert advice_on(told)[0].startswith("Do not act on friction between the flanks yet")


def test_a_model_that_cannot_answer_costs_the_confirmation_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(judged: Any, effects: bool, report: Any) -> ByElements:
        raise ValueError("rig.driver.teeth = 3 is too few")

    monkeypatch.setattr(module, "by_elements", fails)
    told = confirmed_by_elements(SimpleNamespace(), NAMED, lambda step: None)  # type: ignore[arg-type]
    assert not told.gap and told.because == (
        "finite elements could not answer the records: rig.driver.teeth = 3 is too few",
    )
    assert "cannot be simulated" in confirmed_by_elements(None, NAMED, lambda step: None).because[0]


def test_what_elements_say_is_read_as_it_was_written(monkeypatch: pytest.MonkeyPatch) -> None:
    told = asked(monkeypatch, Closing(40.0, 3.5, ("torque_driven", "operating"), {}))
    verdict = Verdict(
        verdict="effects", effects=NAMED, place="mesh", confirmed=told,
        probability=Probabilities(effect=0.9, none=0.05, unknown=0.05),
    )  # fmt: skip
    text = verdict_json(verdict)
    assert parse_verdict(text) == verdict and '"nominal": [\n' in text
