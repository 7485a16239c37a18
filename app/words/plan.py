"""What `check --diagnosis` says: a row for each effect and place, and sentences about the plan."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

from gearbench.diagnosis.planning.worth import words_of
from gearbench.words.diagnosis import SHOWN_UNITS, effects_in_words, number, percent, size_in_words

if TYPE_CHECKING:
    from gearbench.diagnosis.planning.plan import Plan
    from gearbench.diagnosis.planning.row import Row

HEAD = ("effect", "size told by", "found from", "±", "good rig", "beside it")


def plan_lines(plan: Plan) -> list[str]:
    """Lines of text for a person."""
    judged = f", judged on {plan.judged}" if plan.judged else ", no record held out"
    found = f"diagnosis from {', '.join(plan.records)}"
    if plan.parting:
        found += f" (flanks part in {', '.join(plan.parting)})"
    cells = [HEAD, *(_cells(row) for row in plan.rows)]
    width = [max(len(line[column]) for line in cells) for column in range(len(HEAD))]
    return [
        f"{found}{judged}; {percent(plan.left)} of every level is taken to stay unexplained",
        *(_line(line, width) for line in cells),
        *(f"advice: {sentence}" for sentence in plan.advice),
    ]


def _line(cells: tuple[str, ...], width: list[int]) -> str:
    """Words to the left, numbers to the right."""
    words = [cell.ljust(wide) for cell, wide in zip(cells[:2], width[:2], strict=True)]
    numbers = [cell.rjust(wide) for cell, wide in zip(cells[2:5], width[2:5], strict=True)]
    return "  " + "  ".join([*words, *numbers, cells[5]]).rstrip()


def _cells(row: Row) -> tuple[str, ...]:
    scale, unit = SHOWN_UNITS.get(row.unit, (1.0, row.unit))
    named = size_in_words(row.effect, row.parameter, row.on, unit)
    found, std, beside = "-", "", "not found"
    if row.found is not None:
        found, std, beside = number(scale * row.found), number(scale * row.std, 2), _beside(row, scale)
    return words_of(row), named, found, std, number(scale * row.good), beside


def _beside(row: Row, scale: float) -> str:
    """What else explains the smallest size."""
    if not row.rivals:
        return ""
    words = effects_in_words(row.rivals)
    if row.apart is None:
        return f"not told from {words}"
    return f"told from {words} from {number(scale * row.apart)}"


def plan_data(plan: Plan) -> dict[str, Any]:
    """The same for JSON; what is infinite (a record without which an effect is not found) is null."""
    tree: dict[str, Any] = asdict(plan)
    for row in tree["rows"]:
        for cost in row["costs"].values():
            cost["std"] = cost["std"] if isfinite(cost["std"]) else None
    return tree
