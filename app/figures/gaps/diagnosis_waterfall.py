"""The gap as a waterfall: what recalibration and each effect take off the nominal rig's, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, figure, save
from gearbench.words.diagnosis import CHANNELS, SHOWN_UNITS, effects_in_words, length, whole_band

if TYPE_CHECKING:
    from gearbench.diagnosis.verdict import Effect, Gap

PALE = 0.22  # opacity of what a step takes off


def steps_of(gap: Gap, effects: Sequence[Effect]) -> list[tuple[str, float, str]]:
    """Rows of a waterfall: words, rms gap after the step in the unit that is shown, colour.

    With several effects those that close most come first, and each leaves what the later ones still take off by energy:
    the gap that comes back when they are taken out.
    """
    scale, _ = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))
    rows = [
        ("nominal rig", scale * gap.nominal.value, ORANGE),
        ("recalibrated", scale * gap.recalibrated.value, BLUE),
    ]
    if gap.with_effect is not None:
        final = scale * gap.with_effect.value
        closed = {one.name: one.closes[gap.channel].value if gap.channel in one.closes else 0.0 for one in effects}
        ranked = sorted(effects, key=lambda one: -closed[one.name])
        for number, one in enumerate(ranked):
            later = sum(closed[other.name] ** 2 for other in ranked[number + 1 :])
            left = min(sqrt(final**2 + later), max(rows[-1][1], final))
            rows.append((f"+ {effects_in_words([one.name])}", left, GREEN))
    if gap.floor is not None:
        rows.append(("noise floor", scale * gap.floor.value, GREY))
    return rows


def draw_waterfall(path: Path, gaps: Sequence[Gap], effects: Sequence[Effect], record: str) -> None:
    """The rms gap of the first channel over the whole band, step by step; pale: what the step takes off."""
    gap = whole_band(gaps)[0]
    rows = steps_of(gap, effects)
    unit = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))[1]
    largest = max(value for _, value, _ in rows)
    with figure(1, 1, (7.0, 1.0 + 0.46 * len(rows))) as (drawing, axes):
        for number, (_, value, colour) in enumerate(rows):
            y = len(rows) - 1 - number
            axes.barh(y, value, height=0.6, color=colour)
            before = rows[number - 1][1] if number else value
            if colour != GREY and before > value:
                axes.barh(y, before - value, left=value, height=0.6, color=colour, alpha=PALE)
            axes.text(max(before, value) + 0.015 * largest, y, length(value), va="center", fontsize=10)
            if number and rows[number][2] != GREY:
                axes.plot((before, before), (y + 0.3, y + 0.7), color=GREY, linewidth=0.8)
        axes.set_yticks(range(len(rows)), [words for words, _, _ in reversed(rows)])
        axes.set_xlim(0, 1.14 * largest)
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(f"rms gap of the {CHANNELS.get(gap.channel, gap.channel)} on record {record} [{unit}]")
        save(drawing, path)
