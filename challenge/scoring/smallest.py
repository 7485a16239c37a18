"""Effects at work beside the smallest that their records would have named, as the verdicts state it.

A verdict says of each effect from which size on it would have been named (`detectable`), and how well the records alone
know that size: the bound of Cramer (1946) and Rao (1945). What was missed below the one owes nothing to the search, and
below a few of the other nothing to any search.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from gearbench.challenge.scoring.due import owed
from gearbench.challenge.scoring.outcomes import Outcome

HIDDEN = 3.0  # standard deviations that the records alone do not tell from nothing

Table = dict[str, Any]


class Beside(NamedTuple):
    """A true parameter beside the smallest (None: none) that would have been named, the bound of its standard deviation
    and what a good rig has."""

    parameter: str
    unit: str
    true: float
    smallest: float | None
    std: float
    good: float

    @property
    def large(self) -> bool:
        """Whether it is at least the smallest: further away from a good rig, be that more or less."""
        if self.smallest is None:
            return False
        return (self.true - self.smallest) * (self.smallest - self.good) >= 0.0

    @property
    def hidden(self) -> bool:
        """Whether the records alone do not tell it from nothing."""
        return abs(self.true) < HIDDEN * self.std


def beside(outcome: Outcome, effect: str) -> Beside | None:
    """A true effect beside the smallest of its kind that would have been named, of several ways to name it by that by
    which it would have been; None where the verdict does not tell."""
    true = outcome.answer.parameters.get(effect, {})
    found = None
    for told in (outcome.verdict or {}).get("detectable", ()):
        parameters = told["parameters"] if told["name"] == effect else {}
        for name, given in parameters.items():
            if name not in true or true[name]["unit"] != given["unit"]:
                continue
            one = Beside(name, given["unit"], float(true[name]["value"]), given["value"], given["std"], given["good"])
            if found is None or (one.large and not found.large):
                found = one
    return found


def smallest_table(outcomes: Sequence[Outcome]) -> Table:
    """Of the effects of the library that were at work: rows of those that were missed; how many of these and of the
    named ones are smaller than what would have been named, and how many missed ones no search could have told."""
    rows: list[Table] = []
    named: list[Beside] = []
    for outcome in outcomes:
        if outcome.answer.kind != "effect" or outcome.verdict is None:
            continue
        due, names = owed(outcome), outcome.named
        for effect in outcome.answer.effects:
            one = beside(outcome, effect)
            if not outcome.found(effect):
                rows.append({"case": outcome.name, "effect": effect, "due": effect in due, **_plain(one)})
            elif one is not None and effect in names:
                named.append(one)
    told = [row for row in rows if row["parameter"] is not None]
    return {
        "missed": rows,
        "told": len(told),
        "small": sum(not row["large"] for row in told),
        "hidden": sum(row["hidden"] for row in told),
        "named": len(named),
        "named_small": sum(not one.large for one in named),
    }


def _plain(one: Beside | None) -> Mapping[str, Any]:
    if one is None:
        return dict.fromkeys((*Beside._fields, "large", "hidden"))
    return {**one._asdict(), "large": one.large, "hidden": one.hidden}
