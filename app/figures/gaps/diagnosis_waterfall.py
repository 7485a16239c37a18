"""The gap as a waterfall: what recalibration and each effect take off the nominal rig's, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, figure, save
from gearbench.words.diagnosis import CHANNELS, SHOWN_UNITS, effects_in_words, length, whole_band

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    from gearbench.diagnosis.verdict import Effect, Gap

PALE = 0.22  # opacity of what a step takes off
MORE = 1.1  # times the gap before a step, that must come back without its effect to be drawn
GAP, MARGIN = 0.015, 0.02  # of the largest bar, before what is told beside one; of the axis, behind that


class Step(NamedTuple):
    """A row of a waterfall: words, rms gap after the step in the unit that is shown, colour, and the gap that comes
    back where this effect alone is taken out, if a good rig's share of others hid that from the step (else None)."""

    words: str
    left: float
    colour: str
    without: float | None = None


def steps_of(gap: Gap, effects: Sequence[Effect]) -> list[Step]:
    """Rows of a waterfall.

    With several effects those that close most come first, and each leaves what the later ones still take off by energy:
    the gap that comes back when they are taken out.
    """
    scale, _ = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))
    rows = [
        Step("nominal rig", scale * gap.nominal.value, ORANGE),
        Step("recalibrated", scale * gap.recalibrated.value, BLUE),
    ]
    if gap.with_effect is not None:
        final = scale * gap.with_effect.value
        closed = {one.name: one.closes[gap.channel].value if gap.channel in one.closes else 0.0 for one in effects}
        ranked = sorted(effects, key=lambda one: -closed[one.name])
        for number, one in enumerate(ranked):
            later = sum(closed[other.name] ** 2 for other in ranked[number + 1 :])
            before = rows[-1].left
            left, without = min(sqrt(final**2 + later), max(before, final)), hypot(final, closed[one.name])
            hidden = without if without > MORE * max(before, left) else None
            rows.append(Step(f"+ {effects_in_words([one.name])}", left, GREEN, hidden))
    if gap.floor is not None:
        rows.append(Step("noise floor", scale * gap.floor.value, GREY))
    return rows


def draw_waterfall(path: Path, gaps: Sequence[Gap], effects: Sequence[Effect], record: str) -> None:
    """The rms gap of the first channel over the whole band, step by step; pale: what the step takes off; dashed: what
    comes back without that effect alone, where the recalibrated rig had shares of others in its place."""
    gap = whole_band(gaps)[0]
    rows = steps_of(gap, effects)
    unit = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))[1]
    largest = max(max(one.left, one.without or 0.0) for one in rows)
    beside: list[Text] = []
    with figure(1, 1, (7.0, 1.0 + 0.46 * len(rows))) as (drawing, axes):
        for number, one in enumerate(rows):
            y, value = len(rows) - 1 - number, one.left
            axes.barh(y, value, height=0.6, color=one.colour)
            before = rows[number - 1].left if number and one.colour != GREY else value
            if before > value:
                axes.barh(y, before - value, left=value, height=0.6, color=one.colour, alpha=PALE)
            told, end = length(value), max(before, value)
            if one.without is not None:
                axes.barh(y, one.without, height=0.6, fill=False, edgecolor=one.colour, linestyle="--")
                told, end = f"{told}; {length(one.without)} without it", one.without
            beside.append(axes.text(end + GAP * largest, y, told, va="center", fontsize=10, in_layout=False))
            if number and one.colour != GREY:
                axes.plot((before, before), (y + 0.3, y + 0.7), color=GREY, linewidth=0.8)
        axes.set_yticks(range(len(rows)), [one.words for one in reversed(rows)])
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(f"rms gap of the {CHANNELS.get(gap.channel, gap.channel)} on record {record} [{unit}]")
        axes.set_xlim(0, _reach(drawing, axes, beside))
        save(drawing, path)


def _reach(drawing: Figure, axes: Axes, beside: Sequence[Text]) -> float:
    """End of an axis that begins at nothing and has room for what is told `beside` its bars, whatever the words before
    the axis leave of the picture."""
    drawing.draw_without_rendering()
    whole = float(axes.get_window_extent().width)
    parts = ((one.get_position()[0], one.get_window_extent().width / whole) for one in beside)
    return max(float(at) / max(1.0 - MARGIN - part, MARGIN) for at, part in parts)
