"""What a planned experiment would find: the smallest size of every effect over what a good rig has of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.diagnosis.planning.worth import words_of
from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, figure, log_ticks, save
from gearbench.words.diagnosis import number

if TYPE_CHECKING:
    from gearbench.diagnosis.planning.plan import Plan


def draw_plan(path: Path, plan: Plan) -> None:
    """A bar from what a good rig has (1) to the smallest size that is found; a mark where the best of plans would find
    it; orange: another effect explains that size as well."""
    rows = list(reversed(plan.rows))
    largest = max([2.0, *(row.over_good for row in rows if row.over_good is not None)])
    with figure(1, 1, (8.5, 1.2 + 0.27 * len(rows))) as (drawing, axes):
        for y, row in enumerate(rows):
            if row.over_good is None:
                axes.text(1.05, y, "not found by this plan", va="center", fontsize=8, color=GREY)
                continue
            axes.barh(y, row.over_good - 1.0, left=1.0, height=0.6, color=ORANGE if row.rivals else BLUE)
            axes.text(1.04 * row.over_good, y, number(row.over_good, 2), va="center", fontsize=8)
            if row.over_best is not None:
                axes.plot(row.over_good / row.over_best, y, "|", color=GREEN, markersize=11, markeredgewidth=2.0)
        axes.set_xscale("log")
        axes.set_xlim(0.9, 1.5 * largest)
        log_ticks(axes.xaxis, 0.9, 1.5 * largest)
        axes.set_yticks(range(len(rows)), [words_of(row) for row in rows], fontsize=8)
        axes.set_ylim(-0.6, len(rows) - 0.4)
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(
            "smallest size found, over a good rig's\n(green: by the best of plans; orange: another effect explains it)"
        )
        save(drawing, path)
