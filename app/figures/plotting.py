"""What all pictures share: one style, a canvas without a screen, files that do not depend on the day."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from gearbench.files import write_whole

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
    write_whole(path, lambda temporary: drawing.savefig(temporary, metadata=undated))


def shade(axes: Any, spans: Sequence[tuple[float, float]], label: str) -> None:
    """Shade spans of the abscissa; the first one carries the label."""
    for number, (start, stop) in enumerate(spans):
        axes.axvspan(start, stop, color=SINGLE_ZONE, lw=0, zorder=0, label=label if number == 0 else None)
