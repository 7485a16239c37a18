"""The reach of the diagnosis: figure by figure met, point estimate only, or not met.

A figure is met when the unfavourable end of its 90 % interval meets the limit; a point estimate when only the figure
itself does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Reach:
    """One figure: where it stands in the table of the score, its limit, and whether it must stay below."""

    what: str
    path: tuple[str, str]
    limit: float
    at_most: bool


REACHES = (
    Reach("named effects that are true", ("due", "true"), 0.97, False),
    Reach("due effects that are found", ("due", "found"), 0.85, False),
    Reach("false alarm, named", ("none", "named"), 0.03, True),
    Reach("false alarm, flagged", ("none", "flagged"), 0.10, True),
    Reach("foreign effect blamed on one of the library", ("foreign", "blamed"), 0.03, True),
    Reach("foreign effect refused at the right place", ("foreign", "refused_at_right_place"), 0.80, False),
    Reach("parameters within their 90 % interval", ("due", "within"), 0.85, False),
    Reach("held-out gap over the oracle fit, median", ("shrinkage", "oracle"), 1.2, True),
    Reach("held-out gap within 1.5 x of the oracle fit", ("shrinkage", "oracle_within_1.5"), 0.9, False),
    Reach("held-out gap over the nominal one, median", ("shrinkage", "with_effect"), 0.25, True),
    Reach("calibration error of probabilities", ("calibration", "of_verdicts"), 0.05, True),
)


def reach_table(score: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of what, limit, value, low, high and status."""
    rows = []
    for reach in REACHES:
        figure = score[reach.path[0]][reach.path[1]]
        value = figure.get("share", figure.get("median"))
        worst = figure["high"] if reach.at_most else figure["low"]
        rows.append(
            {
                "what": reach.what,
                "limit": f"{'at most' if reach.at_most else 'at least'} {reach.limit:g}",
                "value": value,
                "low": figure["low"],
                "high": figure["high"],
                "total": figure["total"],
                "status": _status(reach, value, worst),
            }
        )
    return rows


def _status(reach: Reach, value: float | None, worst: float | None) -> str:
    def meets(number: float) -> bool:
        return number <= reach.limit if reach.at_most else number >= reach.limit

    if value is None:
        return "not run"
    if worst is not None and meets(worst):
        return "met"
    return "point estimate" if meets(value) else "not met"
