"""Pictures of a speed sweep: DTE, dynamic factor and contact loss against speed, and the orders as a waterfall."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.figures.plotting import BLUE, GREY, ORANGE, figure, save

if TYPE_CHECKING:
    import xarray as xr

SHOWN = 4.5  # mesh orders in the waterfall: whole peaks, nothing is left of the next one
FLOOR = 1e-3  # of the largest amplitude
# What is drawn over speed: variable, factor to the unit of the axis, label of the axis.
ROWS = (
    ("dte_rms", 1e6, "DTE, rms [um]"),
    ("dynamic_factor", 1.0, "largest mesh force / static"),
    ("contact_loss", 100.0, "teeth apart [% of time]"),
)


def plot_sweep(result: xr.Dataset, path: Path) -> None:
    """Rms of the DTE, dynamic factor beside ISO's and contact loss, upwards and downwards, over the driver's speed."""
    rpm = result["speed"].values * 30 / pi
    with figure(3, 1, size=(8.5, 9.0), sharex=True) as (drawing, axes):
        for one, (name, scale, label) in zip(axes, ROWS, strict=True):
            for direction, colour, style in (("up", BLUE, "-"), ("down", ORANGE, "--")):
                values = scale * result[name].sel(direction=direction).values
                one.plot(rpm, values, style, color=colour, lw=1.4, marker="o", ms=2.5, label=f"speed {direction}")
            one.set(ylabel=label, ylim=(0, None))
        axes[1].plot(rpm, result["iso_dynamic_factor"].values, color=GREY, lw=1.2, label="ISO 6336-1 Method B, K_v")
        axes[1].legend(loc="best")
        axes[0].set(title=f"{result.attrs['title']}, {result.attrs['torque_mean']:g} N m on the driver")
        axes[2].set(xlabel="driver speed [1/min]")
        save(drawing, path)


def plot_waterfall(result: xr.Dataset, path: Path) -> None:
    """Amplitudes of the DTE over mesh order and speed, upwards."""
    rpm, order = result["speed"].values * 30 / pi, result["order"].values
    shown = (order > 0) & (order <= SHOWN)
    amplitude = 1e6 * result["dte_amplitude"].sel(direction="up").values[:, shown]
    top = float(amplitude.max())
    level = np.log10(np.maximum(amplitude, FLOOR * top))
    step = np.ptp(rpm) / max(len(rpm) - 1, 1) or 1.0
    with figure(size=(8.5, 6.0)) as (drawing, axes):
        # Every speed stands on its own line; a decade is twice as high as two speeds are apart.
        for line, speed in zip(level[::-1], rpm[::-1], strict=True):
            height = speed + 2 * step * (line - np.log10(FLOOR * top))
            axes.fill_between(order[shown], speed, height, color="white", lw=0)
            axes.plot(order[shown], height, color=BLUE, lw=0.8)
        axes.set(
            xlabel="mesh order",
            ylabel="driver speed [1/min]",
            title=f"DTE at rising speed: each line stands on {FLOOR * top:.2g} um, a decade is two lines' spacing",
        )
        axes.grid(visible=False)
        save(drawing, path)
