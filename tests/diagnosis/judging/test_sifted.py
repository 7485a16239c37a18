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
        now = entering.pop(0) if entering else []
        made: Any = SimpleNamespace(found=SimpleNamespace(entered=[*found.entered, *now]), dropped=(*now[:1],))
        made.with_dropped = lambda before: SimpleNamespace(found=made.found, dropped=(*before, *made.dropped))
        return made

    def sized(found: Any) -> Any:
        kept = [one for one in found.entered if not one.startswith("small")]
        return found if kept == found.entered else SimpleNamespace(entered=kept)

    monkeypatch.setattr(sifted, "judgement", judgement)
    monkeypatch.setattr(sifted, "sized", sized)
    nothing: Any = SimpleNamespace(entered=[])
    made: Any = sifted.judged_of_size(nothing, nothing, None, ())
    assert made.found.entered == ["run-out"]
    assert made.dropped == ("small crack", "run-out")  # by which round's judgement does not matter
