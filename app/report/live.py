"""Figures to zoom and to ask, in a page that opens offline: plotly draws them, a still picture stands in for it.

A page with live figures is made by `live_page`, which puts plotly's script into it once. Figures are given in plotly's
own terms (traces and a layout as dictionaries), so that plotly itself, which takes a second to load, is not imported:
only the script that lies in its package is read.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.report.html import page

Array = NDArray[np.float64]

FONT = '"DejaVu Sans", "Segoe UI", Verdana, Helvetica, Arial, sans-serif'
MOST = 20_000  # points of a curve that a browser moves without delay


def live_page(title: str, body: Sequence[str]) -> str:
    """A whole page like `html.page`, whose live figures are drawn."""
    plotly = (files("plotly") / "package_data" / "plotly.min.js").read_text(encoding="utf-8")
    ours = (files("gearbench.report") / "live.js").read_text(encoding="utf-8")
    return page(title, [*body, f"<script>\n{plotly}\n</script>", f"<script>\n{ours}</script>"])


def live(
    name: str, traces: Sequence[Mapping[str, Any]], layout: Mapping[str, Any], still: str, caption: str,
    height: int = 400,
) -> str:  # fmt: skip
    """A live figure. `name`: unique in the page; `traces`, `layout`: plotly's, as `curve` and `axes` make them;
    `still`: the same as a picture (`html.drawing`, `html.image`), for paper and pages without script; `height` [px]."""
    data = {"kind": "plain", "traces": list(traces), "layout": dict(layout)}
    return _figure(name, data, [f'<div class="plot" style="height:{height}px"></div>'], still, caption)


@dataclass(frozen=True)
class Quantity:
    """What an axis or a bar of colours shows, and its unit (empty: a plain number)."""

    words: str
    unit: str

    @property
    def title(self) -> str:
        """As it stands on an axis."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words


@dataclass(frozen=True)
class Sheet:
    """One of the results of a map: its name, its rows' y (n,), values (n, m), and the colour of its curves."""

    name: str
    y: Array
    values: Array
    colour: str


def live_map(
    name: str, quantities: tuple[Quantity, Quantity, Quantity], x: Array, sheets: Sequence[Sheet], still: str,
    caption: str, *, start: tuple[float, float], limits: tuple[float, float] | None = None, logarithmic: bool = True,
) -> str:  # fmt: skip
    """A map over x (m,) and y with a cursor that shows the curves of every sheet through its place along both axes.

    `quantities`: those of x, y and the values; `start`: where the cursor stands at first; `limits`: of the colours
    (absent: of all values); `logarithmic`: colours and curves on a logarithmic scale, values must then not be negative.
    """
    along, across, quantity = quantities
    shown = [np.log10(np.maximum(one.values, 1e-300)) if logarithmic else one.values for one in sheets]
    low, high = limits or (min(float(np.nanmin(one.values)) for one in sheets), _largest(sheets))
    if logarithmic:
        low, high = float(np.log10(max(low, 1e-300))), float(np.log10(high))
    span = {"zmin": low, "zmax": high, "zauto": False, "colorscale": "Viridis", "type": "heatmap"}
    bar = {"title": {"text": quantity.unit}, "thickness": 14, **(_decades(low, high) if logarithmic else {})}
    hover = f"{along.words} %{{x:.4g}} {along.unit}<br>{across.words} %{{y:.5g}} {across.unit}<extra></extra>"
    scale = log_axis(10**low, 10**high) if logarithmic else {}
    data = {
        "kind": "map",
        "logarithmic": logarithmic,
        "x": _packed(x),
        "unit_x": along.unit,
        "unit_y": across.unit,
        "start": [float(start[0]), float(start[1])],
        "sheets": [
            {"y": _packed(one.y), "values": _packed(values)}
            for one, values in zip(sheets, shown, strict=True)
        ],
        "maps": [
            span | {"name": one.name, "visible": n == 0, "colorbar": bar, "hovertemplate": hover}
            for n, one in enumerate(sheets)
        ],
        "curves": [
            {"type": "scatter", "mode": "lines", "name": one.name, "line": {"color": one.colour, "width": 1.5}}
            for one in sheets
        ],
        "layout": axes(along.title, across.title) | _choice(sheets),
        "layout_y": axes(across.title, quantity.title, y=scale),
        "layout_x": axes(along.title, quantity.title, y=scale),
    }
    plots = [
        '<div class="plot" style="height:440px"></div>',
        f'<div class="sliders">{_slider(along)}{_slider(across)}</div>',
        '<div class="pair"><div class="plot" style="height:300px"></div>'
        '<div class="plot" style="height:300px"></div></div>',
    ]
    return _figure(name, data, plots, still, caption)


def curve(x: ArrayLike, y: ArrayLike, name: str, colour: str, **more: Any) -> dict[str, Any]:
    """A line for `live`: points (n,), NaN as a gap; `more`: further keys of a plotly scatter trace."""
    line = {"color": colour, "width": 1.5} | more.pop("line", {})
    values = {"x": _spec(x), "y": _spec(y), "name": name, "line": line}
    return {"type": "scatter", "mode": "lines", **values, **more}


def axes(
    x_title: str, y_title: str, x: Mapping[str, Any] | None = None, y: Mapping[str, Any] | None = None, **more: Any
) -> dict[str, Any]:
    """A layout in the style of the pages; `x`, `y`: further keys of plotly's axes, `more`: of its layout."""
    axis = {
        "gridcolor": "#e3e6ea", "linecolor": "#6b6b6b", "showline": True, "zeroline": False, "ticks": "outside",
        "automargin": True, "exponentformat": "power",
    }  # fmt: skip
    top = 56 if more.get("showlegend", True) else 32
    return {
        "font": {"family": FONT, "size": 12, "color": "#1d2126"},
        "margin": {"l": 56, "r": 12, "t": top, "b": 48},
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "hovermode": "closest",
        "autosize": True,
        "showlegend": True,
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        "xaxis": axis | {"title": {"text": x_title}} | dict(x or {}),
        "yaxis": axis | {"title": {"text": y_title}} | dict(y or {}),
        **more,
    }


def log_axis(low: float, high: float) -> dict[str, Any]:
    """Keys of a logarithmic axis for values from `low` to `high`: ticks at every digit, at 1, 2, 5, or at decades."""
    return {"type": "log", "dtick": "D1" if high < 10 * low else "D2" if high < 1e3 * low else 1}


def thinned(values: Array, most: int = MOST) -> tuple[NDArray[np.int64], Array]:
    """Indices and values of at most about `most` of the values (n,): of each stretch the least and the largest, so
    that no peak is lost."""
    if values.size <= most:
        return np.arange(values.size), values
    length = -(-2 * values.size // most)
    starts = np.arange(0, values.size, length)
    stretches = [values[start : start + length] for start in starts]
    ends = [sorted({int(np.argmin(one)), int(np.argmax(one))}) for one in stretches]
    index = np.array([start + at for start, two in zip(starts, ends, strict=True) for at in two])
    return index, values[index]


def _figure(name: str, data: Mapping[str, Any], plots: Sequence[str], still: str, caption: str) -> str:
    # "</" could end the element that holds the data.
    held = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
    label = escape(caption, quote=True)
    drawn = "\n".join(plots)
    return (
        f'<figure class="live" id="{name}" aria-label="{label}">\n<div class="plots">{drawn}</div>\n'
        f'<div class="still">{still}</div>\n<figcaption>{escape(caption)}</figcaption>\n'
        f'<script type="application/json">{held}</script>\n</figure>'
    )


def _slider(axis: Quantity) -> str:
    return (
        f'<label>{escape(axis.words)} <input type="range" min="0" step="1" value="0">'
        f" <output></output></label>"
    )


def _choice(sheets: Sequence[Sheet]) -> dict[str, Any]:
    """Buttons above the map, one a sheet."""
    if len(sheets) < 2:
        return {"showlegend": False}
    buttons = [
        {"label": one.name, "method": "restyle", "args": [{"visible": [m == n for m in range(len(sheets))]}]}
        for n, one in enumerate(sheets)
    ]
    menu = {"type": "buttons", "direction": "right", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"}
    menu |= {"buttons": buttons, "pad": {"b": 2}, "font": {"size": 11}}
    return {"showlegend": False, "updatemenus": [menu], "margin": {"l": 56, "r": 12, "t": 72, "b": 48}}


def _largest(sheets: Sequence[Sheet]) -> float:
    return max(float(np.nanmax(one.values)) for one in sheets)


def _decades(low: float, high: float) -> dict[str, Any]:
    """Ticks of a logarithmic bar of colours: more digits of each decade where there are few, else decades alone."""
    steps = (1, 2, 3, 4, 5, 6, 8) if high - low < 1 else (1, 2, 5) if high - low < 3 else (1,)
    powers = range(int(np.floor(low)), int(np.ceil(high)) + 1)
    ticks = [step * 10.0**power for power in powers for step in steps]
    inside = [tick for tick in ticks if low <= np.log10(tick) <= high]
    return {"tickvals": [float(np.log10(tick)) for tick in inside], "ticktext": [f"{tick:g}" for tick in inside]}


def _packed(values: ArrayLike) -> str:
    """Numbers as base64 of single precision, least significant byte first."""
    return b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def _spec(values: ArrayLike) -> dict[str, Any]:
    """Numbers as plotly takes them in packed form."""
    return {"dtype": "f4", "bdata": _packed(values)}
