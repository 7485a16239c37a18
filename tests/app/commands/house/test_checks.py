"""Rows of the validation table: pass, fail, not-run, and what is said with them."""

from __future__ import annotations

import pytest

from gearbench.commands.house.checks import Check, Got, NotRun, run


@pytest.mark.parametrize(("got", "least", "outcome"), [(2.0, False, "pass"), (2.1, False, "fail"), (1.9, True, "fail")])
@pytest.mark.parametrize("note", ["", "of 9 cases"])
def test_what_is_got_is_held_against_the_reach(got: float, least: bool, outcome: str, note: str) -> None:
    measured = Got(got, note) if note else got
    (result,) = run([Check("name", "what", 2.0, "s", lambda: measured, least=least)])
    assert (result.got, result.outcome, result.note) == (got, outcome, note)


def test_what_cannot_run_says_why() -> None:
    def measure() -> float:
        raise NotRun("no such program")

    (result,) = run([Check("name", "what", 2.0, "s", measure)])
    assert (result.got, result.outcome, result.note) == (None, "not-run", "no such program")
