"""What keeps a rig on the way of a record whose flanks part, and what is said of one that goes another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gearbench.diagnosis.judging import along as module
from gearbench.diagnosis.simulation.simulator import Simulator


def way(monkeypatch: pytest.MonkeyPatch, *, parts: bool = True, angle: bool = True) -> Simulator | None:
    """What keeps the rig that was found on the way of the record `heavy`."""
    monkeypatch.setattr(module, "nudges_of", lambda model, conditions: {"heavy": 3.0} if angle else {})
    monkeypatch.setattr(module, "parts", lambda case, measured, simulate: parts and case == ("found", "heavy"))
    found: Any = SimpleNamespace(
        layout=SimpleNamespace(case=lambda p, name: (p, name)),
        simulator=SimpleNamespace(target=None, simulate=None),
        selection=SimpleNamespace(best=SimpleNamespace(p="found")),
    )
    measured: Any = SimpleNamespace(name="heavy")
    return module.way_of(found, None, None, measured)  # type: ignore[arg-type]


def test_there_is_a_way_only_where_flanks_part_and_the_driver_s_angle_tells_it(monkeypatch: pytest.MonkeyPatch) -> None:
    one = way(monkeypatch)
    assert one is not None and one.nudges == {"heavy": 3.0}
    assert way(monkeypatch, parts=False) is None and way(monkeypatch, angle=False) is None


def test_both_gaps_are_said() -> None:
    sentence = module.Along("heavy", 0.4e-6, 8e-6).sentence()
    assert "heavy" in sentence and "leaves 0.400 um rms" in sentence and "in place of 8.00 um" in sentence
