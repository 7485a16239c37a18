"""Where the gap is: shares by place, channel, band, class, phase, condition and tooth, beside two floors."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.figures.plotting import BLUE, GREY, ORANGE, figure, save
from gearbench.words.diagnosis import SHORT_CHANNELS

if TYPE_CHECKING:
    from gearbench.diagnosis.verdict import Share

# Titles of the panels, in their order; teeth get a panel of their own below.
PANELS = {
    "place": "Place, beyond recalibration",
    "channel": "Channel",
    "band": "Band",
    "class": "Kind of spectral line",
    "phase": "Mesh phase",
    "condition": "Condition",
}
COLUMNS = 3
# Bars of a panel; the smaller rest is drawn as one.
MOST = 8
# Teeth that are told by their numbers, and each how many-th one is where there are more.
MOST_TEETH, EVERY = 48, (1, 2, 5, 10, 20)
# How far floors may reach beyond the largest bar before the axis cuts them.
FLOOR_REACH = 1.6


def draw_where(path: Path, shares: Sequence[Share]) -> None:
    """All kinds of shares that there are, in one picture."""
    kinds = [kind for kind in PANELS if any(share.kind == kind for share in shares)]
    teeth = [share for share in shares if share.kind == "tooth"]
    rows = -(-len(kinds) // COLUMNS)
    heights = [1.0] * rows + ([0.9] if teeth else [])
    with figure(1, 1, (11.0, 2.5 * sum(heights) + 0.3)) as (drawing, first):
        first.remove()
        grid = drawing.add_gridspec(len(heights), COLUMNS, height_ratios=heights)
        for number, kind in enumerate(kinds):
            axes = drawing.add_subplot(grid[number // COLUMNS, number % COLUMNS])
            _bars(axes, PANELS[kind], [share for share in shares if share.kind == kind])
        if teeth:
            _teeth(drawing.add_subplot(grid[-1, :]), teeth)
        _legend(drawing, shares)
        save(drawing, path)


def _bars(axes: Any, title: str, shares: list[Share]) -> None:
    shown = sorted(shares, key=lambda share: -share.share)[:MOST]
    if title in (PANELS["band"], PANELS["phase"], PANELS["condition"]) and len(shares) <= MOST:
        shown = shares  # these have an order of their own
    rest = 100 * (sum(share.share for share in shares) - sum(share.share for share in shown))
    names = [_short(share) for share in shown] + (["the rest"] if len(shown) < len(shares) else [])
    values = [100 * share.share for share in shown] + ([rest] if len(shown) < len(shares) else [])
    position = np.arange(len(names))[::-1]
    axes.barh(position, values, height=0.62, color=BLUE)
    edge = _edge(values, shown)
    for y, share in zip(position, shown, strict=False):
        _marks(axes, y, share, edge, upright=False)
    axes.set_yticks(position, names)
    axes.set_xlim(0, edge)
    axes.set_xlabel("share [%]")
    axes.set_title(title)
    axes.grid(visible=False, axis="y")


def _teeth(axes: Any, shares: list[Share]) -> None:
    """Bars tooth by tooth, the driver's left of the driven gear's."""
    position = np.arange(len(shares), dtype=float)
    gears = [share.name.rsplit(" ", 1)[0] for share in shares]
    position += np.cumsum([0, *(2 * (one != two) for one, two in pairwise(gears))])
    values = [100 * share.share for share in shares]
    axes.bar(position, values, width=0.7, color=BLUE)
    edge = _edge(values, shares)
    for x, share in zip(position, shares, strict=True):
        _marks(axes, x, share, edge, upright=True)
    teeth = [share.name.rsplit(" ", 1)[-1] for share in shares]
    every = next((step for step in EVERY if len(teeth) <= step * MOST_TEETH), EVERY[-1])
    axes.set_xticks(position, [tooth if int(tooth) % every == 0 else "" for tooth in teeth])
    axes.tick_params(axis="x", labelsize=8)
    axes.set_ylim(0, edge)
    axes.set_ylabel("share [%]")
    axes.set_title("Tooth: " + ", then ".join(dict.fromkeys(gears)))
    axes.margins(x=0.01)
    axes.grid(visible=False, axis="x")


def _edge(values: Sequence[float], shares: Sequence[Share]) -> float:
    """End of the axis [%]: all bars, and floors that do not dwarf them."""
    edge = 1.12 * max(values, default=0.0) or 1.0
    floors = [value for share in shares for value in (share.floor_noise, share.floor_nominal) if value is not None]
    return max([edge, *(105 * floor for floor in floors if 105 * floor <= FLOOR_REACH * edge)])


def _marks(axes: Any, at: float, share: Share, edge: float, *, upright: bool) -> None:
    """A line across the bar for each floor; beyond the axis it stands at its end, dashed."""
    for value, colour in ((share.floor_noise, GREY), (share.floor_nominal, ORANGE)):
        if value is None:
            continue
        level, style = (100 * value, "-") if 100 * value <= edge else (0.995 * edge, ":")
        draw = axes.hlines if upright else axes.vlines
        draw(level, at - 0.4, at + 0.4, color=colour, linewidth=2.0, linestyle=style)


def _legend(drawing: Any, shares: Sequence[Share]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(color=BLUE, label="share of the gap of the nominal rig")]
    if any(share.floor_noise is not None for share in shares):
        handles.append(Line2D([], [], color=GREY, linewidth=2, label="measurement noise explains"))
    if any(share.floor_nominal is not None for share in shares):
        handles.append(
            Line2D([], [], color=ORANGE, linewidth=2, label="nominal uncertainties explain (dotted: beyond the axis)")
        )
    drawing.legend(handles=handles, loc="outside lower center", ncols=3)


def _short(share: Share) -> str:
    return SHORT_CHANNELS.get(share.name, share.name) if share.kind == "channel" else share.name
