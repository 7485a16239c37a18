"""A judged record whose flanks part, with the rig's own motion and that on the record's way made by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gearbench.diagnosis.judging import along as module
from gearbench.diagnosis.judging.judged import Sizes

PROBLEM: Any = SimpleNamespace(model=None, conditions=[SimpleNamespace(band=1.0)])


def said(
    monkeypatch: pytest.MonkeyPatch, *, kept: float, final: float = 8e-6, parts: bool = True, angle: bool = True
) -> module.Along | None:
    """What is found of a rig that leaves `final` [m] by itself and `kept` [m] on the record's way, of 20 um."""
    nudged: list[Any] = []

    class Kept:
        def __init__(self, layout: Any, target: Any, simulate: Any, nudges: Any) -> None:
            nudged.append(nudges)

        def channels(self, p: str, measured: Any) -> dict[str, float]:
            assert p == "its own end" and nudged == [{"heavy": 3.0}]
            if kept < 0.0:
                raise ValueError("no such motion")
            return {"dte": kept}

    monkeypatch.setattr(module, "Simulator", Kept)
    monkeypatch.setattr(module, "prepare", lambda measured, model, band: None)
    monkeypatch.setattr(module, "nudges_of", lambda model, conditions: {"heavy": 3.0} if angle else {})
    monkeypatch.setattr(module, "parts", lambda case, measured, simulate: parts and case == ("its own end", "heavy"))
    judged: Any = SimpleNamespace(
        measured=SimpleNamespace(name="heavy"),
        sizes={"dte": Sizes(20e-6, 15e-6, 9e-6, final, 0.1e-6)},
        rms_left=lambda channel, signals: signals[channel],
        found=SimpleNamespace(
            layout=SimpleNamespace(case=lambda p, name: (p, name)),
            simulator=SimpleNamespace(target=None, simulate=None),
            selection=SimpleNamespace(best="nudged"),
            end_of=lambda best: "its own end",
        ),
    )
    return module.along(PROBLEM, judged)


def test_a_rig_that_is_right_but_goes_another_way_is_told_from_a_wrong_one(monkeypatch: pytest.MonkeyPatch) -> None:
    found = said(monkeypatch, kept=0.4e-6)
    assert found is not None and found[1:] == pytest.approx((0.4e-6, 8e-6))
    sentence = found.sentence()
    assert "heavy" in sentence and "leaves 0.400 um rms" in sentence and "in place of 8.00 um" in sentence
    # A rig that lacks something is as far off there as by itself, but for what the damper takes.
    assert said(monkeypatch, kept=4e-6) is None


def test_it_is_said_only_where_flanks_part_and_something_remains(monkeypatch: pytest.MonkeyPatch) -> None:
    assert said(monkeypatch, kept=0.4e-6, parts=False) is None
    assert said(monkeypatch, kept=0.01e-6, final=0.15e-6) is None
    # Without the driver's angle nothing keeps it there; a rig that cannot be kept costs no verdict.
    assert said(monkeypatch, kept=0.4e-6, angle=False) is None
    assert said(monkeypatch, kept=-1.0) is None
