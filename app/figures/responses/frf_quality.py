"""Pictures of how far a frequency response goes: uncertainty, branches with bands, coherence, orders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, figure, log_ticks, phase_axis, save
from gearbench.figures.responses.frf import coarse_map, magnitude, whole_cells

Array = NDArray[np.float64]

_COLOURS = (BLUE, ORANGE, GREEN, "#8a3f8f", GREY)
BRANCHES = len(_COLOURS)
_BAND = 2.0  # standard deviations
_MOST_ORDERS = 6.5  # mesh orders


def draw_uncertainty(path: Path, frf: xr.Dataset) -> None:
    """|ITF| beside its standard deviation, in parts of it, over frequency and mesh phase."""
    size = magnitude(frf)
    relative = np.sqrt(frf["itf_var"].values) / np.maximum(size, 1e-3 * size.max())
    with figure(1, 2, (11.0, 5.0), sharey=True) as (drawing, axes):
        for panel, values, title, norm, label in (
            (axes[0], 1e9 * size, "Response", LogNorm(*np.quantile(1e9 * size, (0.001, 0.9999))), "|ITF| [nm/N]"),
            (axes[1], relative, "Its standard deviation", LogNorm(1e-3, 1.0), "standard deviation / |ITF|"),
        ):
            image = panel.pcolormesh(*coarse_map(frf, values), norm=norm, cmap="viridis", rasterized=True)
            panel.set_title(title)
            phase_axis(panel, label="mesh phase [cycles]")
            panel.grid(False)
            whole_cells(panel, frf)
            shown, percent = (FuncFormatter(lambda value, _, f=f: f(value)) for f in (_plain, _percent))
            bar = drawing.colorbar(image, ax=panel, label=label, extend="both", ticks=LogLocator(subs=(1, 2, 5)),
                                   format=shown if panel is axes[0] else percent)  # fmt: skip
            bar.ax.yaxis.set_minor_formatter(NullFormatter())
        axes[0].set_ylabel("frequency [Hz]")
        save(drawing, path)


def _plain(value: float) -> str:
    return f"{value:g}"


def _percent(value: float) -> str:
    return f"{100 * value:g} %"


def draw_branches(path: Path, frf: xr.Dataset) -> None:
    """|G_l| of the strongest branches over frequency, with bands of two standard deviations."""
    size = 1e9 * np.hypot(frf["htf_re"].values, frf["htf_im"].values)
    spread = 1e9 * np.sqrt(frf["htf_var"].values)
    strongest = np.argsort(-np.sum(size**2, axis=1))[:BRANCHES]
    with figure(size=(9.0, 5.0)) as (drawing, axes):
        for colour, row in zip(_COLOURS, strongest, strict=False):
            values, band = size[row], _BAND * spread[row]
            floor = 1e-3 * size.max()
            name = f"l = {int(frf['harmonic'].values[row]):+d}" if frf["harmonic"].values[row] else "l = 0"
            axes.plot(frf["frequency"].values, values, color=colour, lw=1.1, label=name)
            low, high = np.maximum(values - band, floor), np.maximum(values + band, floor)
            axes.fill_between(frf["frequency"].values, low, high, color=colour, alpha=0.2, lw=0)
        axes.set_yscale("log")
        axes.set_ylim(1e-3 * size.max(), 1.5 * (size + _BAND * spread)[strongest].max())
        log_ticks(axes.yaxis, *axes.get_ylim())
        axes.set_xlim(float(frf["frequency"].values[0]), float(frf["frequency"].values[-1]))
        axes.set_xlabel("frequency of the force [Hz]")
        axes.set_ylabel("|G_l| [nm/N]")
        axes.set_title(f"Branches of the HTF, the {len(strongest)} strongest; bands: two standard deviations")
        axes.legend(loc="best", frameon=True, framealpha=0.9)
        save(drawing, path)


def draw_quality(path: Path, frf: xr.Dataset) -> None:
    """What of the response the result leaves unexplained (1 - multiple coherence), and the variance, over frequency."""
    frequency = frf["frequency"].values
    left = np.sqrt(1.0 - frf["coherence"].values)
    power = np.mean(magnitude(frf) ** 2, axis=1)
    spread = np.sqrt(np.mean(frf["itf_var"].values, axis=1) / np.maximum(power, np.finfo(float).tiny))
    with figure(size=(9.0, 4.4)) as (drawing, axes):
        axes.plot(frequency, 100 * left, color=ORANGE, lw=1.0, label="residual over response of the lines around")
        axes.plot(frequency, 100 * spread, color=BLUE, lw=1.0, label="standard deviation of the ITF over the ITF")
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        log_ticks(axes.yaxis, low, high, "{:g} %".format)
        axes.set_xlim(frequency[0], frequency[-1])
        axes.set_xlabel("frequency [Hz]")
        axes.set_ylabel("relative rms")
        error = 100 * float(frf.attrs.get("expected_error", np.nan))
        axes.set_title(f"Expected error of the ITF, all in all: {error:.2g} %")
        axes.legend(loc="best", frameon=True, framealpha=0.9)
        save(drawing, path)


def draw_orders(path: Path, orders: xr.DataArray, teeth: int | None) -> None:
    """Amplitudes of the DTE by shaft order (`order_spectrum`), with the mesh orders marked."""
    mesh = float(teeth or 1)
    shown = (orders["order"].values > 0) & (orders["order"].values <= _MOST_ORDERS * mesh)
    order, size = orders["order"].values[shown], 1e9 * orders.values[shown]
    low = max(float(np.quantile(size, 0.02)), 1e-6 * float(size.max()))
    with figure(size=(9.0, 4.4)) as (drawing, axes):
        axes.vlines(order, 0.5 * low, np.maximum(size, 0.5 * low), color=BLUE, lw=0.8)
        ticks = mesh * np.arange(1, int(_MOST_ORDERS) + 1)
        on = np.array([int(np.argmin(np.abs(order - tick))) for tick in ticks[ticks <= order[-1]]])
        axes.plot(order[on], size[on], "o", color=ORANGE, ms=5, label="mesh orders 1, 2, ..")
        axes.set_yscale("log")
        axes.set_ylim(0.5 * low, 2.0 * size.max())
        log_ticks(axes.yaxis, *axes.get_ylim())
        axes.set_xlim(0.0, order[-1])
        of = "driver's shaft" if orders.attrs["reference"] == "driver" else "mesh"
        axes.set_xlabel(f"order of the {of}")
        axes.set_ylabel("amplitude of the DTE [nm]")
        axes.set_title(f"Orders of the DTE, mean of {orders.attrs['realisations']} realisation(s)")
        axes.legend(loc="upper right", frameon=True, framealpha=0.9)
        save(drawing, path)
