"""What all pictures share: one style, a canvas without a screen, files that do not depend on the day."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from gearbench.files import write_whole

Array = NDArray[np.float64]

PHASE = "mesh phase [cycles]; 0: contact at the pitch point"
BLUE, ORANGE, GREEN, GREY = "#0b5c9e", "#d1600a", "#2d7d46", "#6b6b6b"
SINGLE_ZONE = "#f3e3c3"

_STYLE: dict[Any, Any] = {
    "figure.dpi": 130,
    "savefig.dpi": 130,
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "svg.hashsalt": "gearbench",
    "svg.fonttype": "none",
}


def style() -> dict[Any, Any]:
    """Settings of the common style, for figures that are laid out by hand."""
    return dict(_STYLE)


@contextmanager
def figure(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (8.0, 4.5), **options: Any
) -> Iterator[tuple[Figure, Any]]:
    """A figure without pyplot, and its axes, in the common style."""
    with rc_context(_STYLE):
        drawing = Figure(figsize=size, layout="constrained")
        yield drawing, drawing.subplots(rows, columns, **options)


def save(drawing: Figure, path: Path) -> None:
    """Write a picture in the format of the suffix, without a date: the same picture gives the same file."""
    undated = {"Date": None} if path.suffix == ".svg" else {"Software": None}
    write_whole(path, lambda temporary: _print(drawing, temporary, undated))


def _print(drawing: Figure, path: Path, metadata: dict[str, None]) -> None:
    """`savefig` at the figure's own resolution, without the trial drawing that it makes first and throws away."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    if path.suffix == ".png":
        FigureCanvasAgg(drawing).print_png(path, metadata=metadata)
    elif path.suffix == ".svg":
        FigureCanvasSVG(drawing).print_svg(path, metadata=metadata)
    else:
        drawing.savefig(path, metadata=metadata)


def log_ticks(axis: Any, low: float, high: float, text: Callable[[float], str] = "{:g}".format) -> None:
    """Ticks of a logarithmic axis whose range is low to high: at 1, 2 and 5 of each decade where these are few, all
    written alike (matplotlib writes those between decades as powers)."""
    axis.set_major_locator(LogLocator(10, (1.0, 2.0, 5.0) if high < 200 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: text(value)))
    axis.set_minor_formatter(NullFormatter())


def closed(phase: Array, values: Array, period: float = 1.0) -> tuple[Array, Array]:
    """Rising phases (n,) of one period from about 0 on and values (..., n), continued to cover both its ends."""
    first = -1 if phase[0] > 0.0 else len(phase)  # the last one, a period earlier, where they begin after 0
    return (
        np.concatenate((phase[first:] - period, phase, phase[:1] + period)),
        np.concatenate((values[..., first:], values, values[..., :1]), axis=-1),
    )


def phase_axis(axes: Any, period: float = 1.0, label: str = PHASE) -> None:
    """Mesh phase as abscissa: from 0 to the end of the period, with a tick at both and round numbers between."""
    axes.set_xlim(0.0, period)
    step = 0.2 if period <= 1.0 else next(s for e in range(9) for s in (10**e, 2 * 10**e, 5 * 10**e) if 8 * s >= period)
    between = np.arange(0.0, period - step / 2, step)
    axes.set_xticks([*between, period])
    axes.set_xlabel(label)


def explain_gaps(axes: Any, phase: Array, values: Array, words: str) -> None:
    """Say on a curve that breaks off why: `words` at its longest gap, where some of `values` (n,) are NaN."""
    missing = ~np.isfinite(values)
    if not missing.any() or missing.all():
        return
    edges = np.flatnonzero(np.diff(np.concatenate(([False], missing, [False])).astype(int)))
    starts, stops = edges[::2], edges[1::2] - 1
    for start, stop in zip(starts, stops, strict=True):
        axes.axvspan(
            phase[max(start - 1, 0)], phase[min(stop + 1, len(phase) - 1)],
            facecolor="none", edgecolor="#bbbbbb", hatch="///", lw=0.0, zorder=0,
        )  # fmt: skip
    longest = int(np.argmax(stops - starts))
    middle = 0.5 * (phase[starts[longest]] + phase[stops[longest]])
    low, high = axes.get_xlim()
    place = (middle - low) / (high - low)
    side = "left" if place < 0.15 else "right" if place > 0.85 else "center"
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
    axes.text(middle, 0.04, words, transform=axes.get_xaxis_transform(), ha=side, va="bottom", fontsize=8, bbox=box)


def shade(axes: Any, spans: Sequence[tuple[float, float]], label: str) -> None:
    """Shade spans of the abscissa; the first one carries the label."""
    for number, (start, stop) in enumerate(spans):
        axes.axvspan(start, stop, color=SINGLE_ZONE, lw=0, zorder=0, label=label if number == 0 else None)
