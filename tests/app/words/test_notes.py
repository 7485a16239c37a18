"""A note of a record or a model is one line, whatever stops it holds."""

from __future__ import annotations

import pytest

from gearbench.bench.record.remarks import joined
from gearbench.words.limits import left_out
from gearbench.words.summary import warnings_of

NOTES = ("the motion does not repeat: it strikes; nothing else is known", "teeth part; they meet again")


def test_notes_with_semicolons_stay_whole() -> None:
    numbers = {
        "identification": {"record_needed": 0.0, "joint_period": 1.0, "expected_error": 0.0, "harmonics": 1},
        "realisations": 1,
        "record_warnings": joined(NOTES[0], None, NOTES[1]),
    }
    assert warnings_of(numbers) == list(NOTES)
    assert left_out("reduced", joined(*NOTES) or "")[-2:] == list(NOTES)


@pytest.mark.parametrize("notes", [(), (None, None)])
def test_nothing_to_say_is_no_attribute(notes: tuple[None, ...]) -> None:
    assert joined(*notes) is None
