"""How much time is said to be left: at the pace since the first piece, which compiles loops."""

from __future__ import annotations

import pytest

from gearbench.shell import progress as module
from gearbench.shell.progress import Progress


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time [s], which the test moves on."""
    clock = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: clock[0])
    return clock


def test_the_first_piece_is_no_measure_of_the_pace(now: list[float], capsys: pytest.CaptureFixture[str]) -> None:
    with Progress("job") as progress:
        progress.step("record")
        for at, fraction in ((90.0, 0.01), (96.0, 0.02), (108.0, 0.05), (112.0, 0.06), (120.0, 0.08)):
            now[0] = at
            progress(fraction)
    told = [line.rpartition(" %")[2] for line in capsys.readouterr().err.splitlines() if "left" in line]
    # From the first piece on a hundredth takes 4.3 to 4.5 s: 95 of them 428 s. At the pace since the beginning, 35 min.
    assert told == [", 7 min left", ", 7 min left", ", 7 min left"][: len(told)] and told


def test_what_a_step_is_at_is_told_now_and_then(now: list[float], capsys: pytest.CaptureFixture[str]) -> None:
    with Progress("job") as progress:
        progress.step("cause")
        for at, what in ((1.0, "friction"), (6.0, "backlash"), (7.0, "ripple"), (12.0, "delay")):
            now[0] = at
            progress.doing(what)
    told = capsys.readouterr().err.splitlines()
    assert told == ["job: cause, backlash: 6 s", "job: cause, delay: 12 s", "job: cause: done in 12.0 s"]
