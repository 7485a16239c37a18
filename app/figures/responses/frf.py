"""Pictures of the frequency response over the mesh cycle: magnitude, natural frequencies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, closed, explain_gaps, figure, phase_axis, save, shade
from gearbench.geometry.pair.zones import Span

Array = NDArray[np.float64]

_COLOURS = {"identified": BLUE, "exact": ORANGE, "frozen": GREEN, "linearised": GREEN}
_TITLES = {
    "identified": "Identified from the record",
    "exact": "Exact ITF of the model",
    "frozen": "Frozen coefficients (not the truth)",
    "linearised": "Linearised model, frozen at each phase",
}
NO_MODE = "no mode found here: no peak stands out"
NOTHING = "the record shows no mode in the identified band"
_PIXELS = 700  # a map needs no more rows or columns than this


def magnitude(frf: xr.Dataset) -> Array:
    """|ITF| (frequency, phase) [m/N]."""
    return np.hypot(frf["itf_re"].values, frf["itf_im"].values)


def draw_itf(path: Path, results: Mapping[str, xr.Dataset], warning: str = "") -> None:
    """|ITF| over frequency and phase, one panel a result, on one colour scale; a warning stands on it."""
    maps = {name: 1e9 * magnitude(frf) for name, frf in results.items()}
    # Beside a truth the scale is the truth's: what an identified map adds to it is error.
    trusted = [maps[name] for name in ("exact", "frozen") if name in maps] or list(maps.values())
    shown = np.concatenate([values[values > 0] for values in trusted])
    norm = LogNorm(*np.quantile(shown, (0.001, 0.9999)))
    width = 2.2 + 3.9 * len(maps)
    with figure(1, len(maps), (max(width, 6.6), 5.2), sharey=True, squeeze=False) as (drawing, axes):
        for panel, (name, values) in zip(axes[0], maps.items(), strict=True):
            frf = results[name]
            image = panel.pcolormesh(*coarse_map(frf, values), norm=norm, cmap="viridis", rasterized=True)
            panel.set_title(_TITLES.get(name, name))
            phase_axis(panel, label="mesh phase [cycles]")
            panel.grid(False)
            whole_cells(panel, frf)
        axes[0, 0].set_ylabel("frequency [Hz]")
        bar = drawing.colorbar(
            image,
            ax=axes[0, :].tolist(),
            label="|ITF| = |DTE / F| [nm/N]",
            extend="both",
            ticks=LogLocator(subs=(1, 2, 5)),
            format=FuncFormatter(lambda value, _: f"{value:g}"),
        )
        bar.ax.yaxis.set_minor_formatter(NullFormatter())
        if warning:
            _warn(drawing, warning, int(12 * max(width, 6.6)))
        save(drawing, path)


def draw_natural_frequencies(
    path: Path, results: Mapping[str, xr.Dataset], zones: Sequence[Span], label: str, warning: str = ""
) -> None:
    """Natural frequencies against mesh phase, with bands of two standard deviations where they are known, and the zones
    of fewest pairs in contact shaded."""
    with figure(size=(8.0, 4.8)) as (drawing, axes):
        shade(axes, zones, label)
        phase_axis(axes)
        for name, frf in results.items():
            for number, values in enumerate(frf["natural_frequency"].values):
                style = {"color": _COLOURS.get(name, GREY), "lw": 1.4 if name != "identified" else 0.9}
                marker = {"marker": "o", "ms": 2.6} if name == "identified" else {}
                title = _TITLES.get(name, name) if number == 0 else None
                phase, curve = closed(frf["phase"].values, values)
                axes.plot(phase, curve, **style, **marker, label=title)
                if "natural_frequency_sd" in frf:
                    _, half = closed(frf["phase"].values, 2.0 * frf["natural_frequency_sd"].values[number])
                    axes.fill_between(phase, curve - half, curve + half, color=style["color"], alpha=0.2, lw=0)
                if name == "identified" and number == 0:
                    explain_gaps(axes, phase, curve, NO_MODE)
        axes.set_ylabel("natural frequency [Hz]")
        _zoom_on_found(axes, results)
        axes.set_title("Natural frequencies over one mesh period")
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="upper center", ncols=2, frameon=True, framealpha=0.9)
        if "identified" in results and not np.isfinite(results["identified"]["natural_frequency"].values).any():
            axes.text(0.5, 0.04, NOTHING, transform=axes.transAxes, ha="center", va="bottom")
        if warning:
            _warn(drawing, warning, 100)
        save(drawing, path)


def _warn(drawing: Figure, warning: str, width: int) -> None:
    """A warning on top of a picture, in lines of about the same length."""
    lines = ceil(len(warning) / width)
    text = fill(warning, min(width, ceil(len(warning) / lines) + 8))
    drawing.suptitle(text, color="#a01010", fontsize=9.5)


def _zoom_on_found(axes: Any, results: Mapping[str, xr.Dataset]) -> None:
    """Limit the ordinate to the modes that a response shows: eigenvalues may hold ones that nothing excites."""
    shown = [frf["natural_frequency"].values for name, frf in results.items() if name in ("identified", "exact")]
    found = np.concatenate([values[np.isfinite(values)] for values in shown]) if shown else np.empty(0)
    if found.size:
        low, high = found.min(), found.max()
        margin = max(0.25 * (high - low), 0.02 * high)
        axes.set_ylim(max(low - margin, 0.0), high + 1.6 * margin)


def whole_cells(axes: Any, frf: xr.Dataset) -> None:
    """End a map at its lowest and highest frequency: the cells there reach beyond, perhaps below 0 Hz."""
    axes.set_ylim(float(frf["frequency"].values[0]), float(frf["frequency"].values[-1]))


def coarse_map(frf: xr.Dataset, values: Array) -> tuple[Array, Array, Array]:
    """Phases, frequencies and values of a map, thinned to what a picture shows: cells are not averaged."""
    rows = slice(None, None, max(1, len(values) // _PIXELS))
    columns = slice(None, None, max(1, values.shape[1] // _PIXELS))
    phase, shown = closed(frf["phase"].values[columns], values[rows, columns])
    return phase, frf["frequency"].values[rows], shown
