"""Live figures of a study: what each factor moves, and every member over every factor."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, GREY, ORANGE
from gearbench.report.live import axes, live

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.study.indices import Effects

MOST_CHOICES = 40  # lines of a menu
BAR = "#bcd5e8"


def live_tornado(effects: Sequence[Effects], still: str, caption: str) -> str:
    """Range of the mean of a result over each factor, with the means at both ends; a menu of the results."""
    traces: list[dict[str, Any]] = []
    orders = []
    for result in effects[:MOST_CHOICES]:
        ranked = sorted(result.each, key=lambda one: -float(np.nan_to_num(one.most - one.least)))
        names = [_lines(one.factor) for one in ranked]
        orders.append(names[::-1])
        about = [f"S {_part(one.first)}, T {_part(one.total)}" for one in ranked]
        bar = {"type": "bar", "orientation": "h", "y": names, "base": _held([one.least for one in ranked]),
               "x": _held([one.most - one.least for one in ranked]), "text": about, "textposition": "none",
               "marker": {"color": BAR}, "hovertemplate": "%{y}<br>%{text}<extra></extra>"}  # fmt: skip
        traces.append(bar)
        for ends, symbol, colour, words in (
            ([one.low for one in ranked], "triangle-left", BLUE, "at its lowest values"),
            ([one.high for one in ranked], "triangle-right", ORANGE, "at its highest values"),
        ):
            marker = {"symbol": symbol, "color": colour, "size": 11}
            traces.append({"type": "scatter", "mode": "markers", "y": names, "x": _held(ends), "marker": marker,
                           "hovertemplate": f"mean {words}: %{{x:.5g}}<extra></extra>"})  # fmt: skip
    titles = [f"mean of {one.result}" for one in effects[:MOST_CHOICES]]
    changes = [
        {"xaxis.title.text": title, "yaxis.categoryarray": order} for title, order in zip(titles, orders, strict=True)
    ]
    layout = _menu(axes(titles[0], "", y={"categoryorder": "array", "categoryarray": orders[0]}, showlegend=False),
                   traces, 3, [one.result for one in effects[:MOST_CHOICES]], changes)  # fmt: skip
    height = 190 + 48 * min(len(effects[0].each), 12)
    return live("tornado-live", traces, layout, still, caption, height)


def live_scatter(table: xr.Dataset, factors: Sequence[str], results: Sequence[str], still: str, caption: str) -> str:
    """Every member: one result over one factor, with a menu of the pairs; the pointer says which member it is."""
    pairs = [(result, factor) for result in results for factor in factors][:MOST_CHOICES]
    traces: list[dict[str, Any]] = []
    for result, factor in pairs:
        places = table[factor].values
        values = np.asarray(table[result].values, dtype=float)
        texts = places.dtype == object
        x = [str(one).rpartition("/")[2] for one in places] if texts else _held(places)
        traces.append({"type": "scatter", "mode": "markers", "x": x, "y": _held(values),
                       "marker": {"color": BLUE, "size": 6, "opacity": 0.8},
                       "hovertemplate": "member %{pointNumber}<br>%{x} → %{y:.5g}<extra></extra>"})  # fmt: skip
        levels, means = ([], []) if texts else _means(np.asarray(places, dtype=float), values)
        line = {"color": ORANGE, "width": 1.5}
        traces.append({"type": "scatter", "mode": "lines", "x": levels, "y": means, "line": line, "hoverinfo": "skip"})
    changes = [
        {"xaxis.title.text": _titled(table, factor), "yaxis.title.text": result} for result, factor in pairs
    ]
    first = changes[0]
    layout = axes(first["xaxis.title.text"], first["yaxis.title.text"], showlegend=False)
    names = [f"{result} over {_short(factor)}" for result, factor in pairs]
    return live("scatter-live", traces, _menu(layout, traces, 2, names, changes), still, caption)


def _menu(
    layout: dict[str, Any], traces: Sequence[dict[str, Any]], each: int, names: Sequence[str],
    changes: Sequence[dict[str, Any]],
) -> dict[str, Any]:  # fmt: skip
    """The layout with a menu that shows one group of `each` traces at a time; the first is shown."""
    for number, trace in enumerate(traces):
        trace["visible"] = number < each
    if len(names) < 2:
        return layout
    buttons = [
        {"label": name, "method": "update",
         "args": [{"visible": [number // each == group for number in range(len(traces))]}, change]}
        for group, (name, change) in enumerate(zip(names, changes, strict=True))
    ]  # fmt: skip
    menu = {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom", "font": {"size": 11},
            "pad": {"b": 4}, "bordercolor": GREY}  # fmt: skip
    return layout | {"updatemenus": [menu], "margin": layout["margin"] | {"t": 72}}


def _means(places: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[list[float], list[float]]:
    """Levels of a factor and the mean result at each, where members share levels."""
    good = np.isfinite(values)
    levels = np.unique(places[good])
    if not 1 < levels.size < good.sum() or levels.size > 24:
        return [], []
    return levels.tolist(), [float(values[good & (places == level)].mean()) for level in levels]


def _held(values: Any) -> list[float | None]:
    """Numbers for JSON, with a gap where there is none."""
    return [float(one) if isfinite(one) else None for one in values]


def _part(value: float) -> str:
    return f"{max(value, 0.0):.2f}" if isfinite(value) else "unknown"


def _short(name: str) -> str:
    """A key without its tables; of several that move together the first."""
    first, *others = name.split("+")
    return first.rpartition(".")[2] + (" .." if others else "")


def _lines(name: str) -> str:
    """A key on as many lines as it needs beside an axis."""
    return "<br>".join(
        ("+ " if number else "") + ".<br>".join(part.removeprefix("rig.").rsplit(".", 1))
        for number, part in enumerate(name.split("+"))
    )


def _titled(table: xr.Dataset, factor: str) -> str:
    """A factor with its unit."""
    unit = str(table[factor].attrs["units"])
    return factor.replace("+", "<br>+ ") + (f" [{unit}]" if unit not in ("", "1") else "")
