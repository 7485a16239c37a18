"""What entered, sifted by its size."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gearbench.diagnosis.judging import sifted


def test_what_enters_on_the_judged_record_alone_must_be_large_enough_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A crack of which sound rigs have as much, in the place of another effect that was too small."""
    entering: list[list[str]] = [["small crack"], ["run-out"]]

    def judgement(problem: Any, found: Any, held_out: Any, searched: Any, report: Any) -> Any:
        return SimpleNamespace(found=SimpleNamespace(entered=[*found.entered, *(entering.pop(0) if entering else [])]))

    def sized(found: Any) -> Any:
        kept = [one for one in found.entered if not one.startswith("small")]
        return found if kept == found.entered else SimpleNamespace(entered=kept)

    monkeypatch.setattr(sifted, "judgement", judgement)
    monkeypatch.setattr(sifted, "sized", sized)
    nothing: Any = SimpleNamespace(entered=[])
    made: Any = sifted.judged_of_size(nothing, nothing, None, ()).found
    assert made.entered == ["run-out"]
