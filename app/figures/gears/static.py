"""Pictures of a static analysis: transmission error over the mesh cycle, and over cycle and load (Harris map)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.figures.plotting import BLUE, GREY, ORANGE, closed, figure, phase_axis, save, shade

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.geometry.pair.zones import Span

MOST_CURVES = 12


def plot_static(result: xr.Dataset, path: Path, zones: Sequence[Span] = (), label: str = "") -> None:
    """Transmission error at every load over mesh phase, without load where known, and its peak-to-peak value over the
    load; `zones` are shaded where there is one load."""
    te = 1e6 * result["transmission_error"].values
    loads, unit = result["load"].values, result["load"].attrs["units"]
    if len(loads) == 1:  # nothing over the load
        with figure(size=(8.0, 4.5)) as (drawing, axes):
            shade(axes, zones, label)
            _curves(axes, result, te, loads, unit)
            if zones:
                axes.legend(loc="best")
            save(drawing, path)
        return
    with figure(1, 2, size=(11.0, 4.5), width_ratios=(3, 2)) as (drawing, (left, right)):
        _curves(left, result, te, loads, unit)
        order = np.argsort(loads)
        scale = 1e6 if unit == "m" else 1.0
        name = "DTE [um]" if unit == "m" else f"driver torque [{unit}]"
        if unit == "m":
            swing, label = np.ptp(result["torque"].values, axis=1), "torque, peak to peak [N m]"
        else:
            swing, label = np.ptp(te, axis=1), "TE, peak to peak [um]"
        right.plot(scale * loads[order], swing[order], "o-", color=BLUE, ms=4)
        right.set(title="Peak to peak over the load", xlabel=name, ylabel=label, ylim=(0, None))
        save(drawing, path)


def draw_harris_map(result: xr.Dataset, path: Path) -> None:
    """Transmission error less its mean under each torque, over mesh phase and torque."""
    loads, phase = result["load"].values, result["phase"].values
    order = np.argsort(loads)
    te = 1e6 * result["transmission_error"].values[order]
    swing = te - te.mean(axis=1, keepdims=True)
    period = float(round(phase[-1] + phase[1]))
    with figure(size=(8.0, 4.8)) as (drawing, axes):
        x, z = closed(phase, swing, period)
        image = axes.pcolormesh(x, loads[order], z, cmap="viridis", shading="nearest", rasterized=True)
        drawing.colorbar(image, ax=axes, label="TE less its mean [um]")
        axes.set(title="Harris map", ylabel="driver torque [N m]")
        axes.grid(visible=False)
        phase_axis(axes, period)
        save(drawing, path)


def _curves(axes: Any, result: xr.Dataset, te: np.ndarray, loads: np.ndarray, unit: str) -> None:
    """One curve a load, light to dark."""
    phase = result["phase"].values
    period = float(round(phase[-1] + phase[1])) if len(phase) > 1 else 1.0
    drawn = np.unique(np.linspace(0, len(loads) - 1, min(MOST_CURVES, len(loads))).round().astype(int))
    for number, i in enumerate(drawn):
        strength = 0.35 + 0.65 * (number + 1) / len(drawn)
        text = f"{loads[i] * 1e6:.4g} um" if unit == "m" else f"{loads[i]:.4g} {unit}"
        axes.plot(*closed(phase, te[i], period), color=BLUE, alpha=strength, lw=1.2)
        axes.annotate(text, (period, te[i, 0]), xytext=(3, 0), textcoords="offset points", fontsize=7, color=GREY)
    if "transmission_error_unloaded" in result:
        without = 1e6 * result["transmission_error_unloaded"].values
        axes.plot(*closed(phase, without, period), color=ORANGE, lw=1.2, label="without load")
        axes.legend(loc="best")
    axes.set(title="Static transmission error", ylabel="TE [um]")
    phase_axis(axes, period)
