"""The valley around an optimum: curves over one key, contours over two, cuts through the lowest point over more."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, figure, save

if TYPE_CHECKING:
    from gearbench.optimisation import Optimum

COLOURS = (BLUE, GREEN, GREY, "#8a4fa3", "#b08a1e", "#3aa0a0")
LEVELS = 12


def draw_valley(found: Optimum, path: Path) -> None:
    """The result over the keys, the lowest point marked."""
    keys = len(found.names)
    if keys == 2:
        with figure(size=(7.6, 5.6)) as (drawing, axes):
            _contours(drawing, axes, found)
            save(drawing, path)
        return
    with figure(1, keys, size=(8.5 if keys == 1 else 4.2 * keys, 4.8), squeeze=False, sharey=True) as (drawing, axes):
        for place, one in enumerate(axes[0]):
            _curves(one, found, place)
        axes[0, 0].set_ylabel(_label(found))
        axes[0, 0].legend(loc="best", fontsize=8)
        save(drawing, path)


def _curves(axes: Any, found: Optimum, key: int) -> None:
    """Each load and their worst or mean along one key, the others at their best."""
    points, best = found.valley.points, np.array(found.best)
    others = np.delete(np.arange(points.shape[1]), key)
    near = np.all(np.abs(points[:, others] - best[others]) <= 1e-9 * np.abs(best[others]), axis=1)
    rows = np.flatnonzero(near)[np.argsort(points[near, key], kind="stable")]
    places = points[rows, key]
    if len(found.loads) > 1:
        for number, load in enumerate(found.loads):
            colour = COLOURS[number % len(COLOURS)]
            axes.plot(places, found.valley.values[rows, number], "-", lw=1.2, color=colour, label=f"{load:g} N m")
    aim = np.where(np.isfinite(found.valley.aim), found.valley.aim, np.nan)
    label = found.over if len(found.loads) > 1 else f"{found.loads[0]:g} N m"
    axes.plot(places, aim[rows], "o-", color=ORANGE, lw=2.0, ms=3, label=label, zorder=3)
    words = f"least: {found.value:.3g} at {best[key]:.4g}"
    axes.plot(best[key], found.value, "*", color="black", ms=12, zorder=4, label=words)
    axes.axvspan(*found.flat[key], color="#f3e3c3", lw=0, zorder=0, label="within 10 % of the least")
    if found.names[key].endswith("tip_relief_um"):
        for number, (load, relief) in enumerate(zip(found.loads, found.textbook, strict=True)):
            if found.bounds[key][0] <= relief <= found.bounds[key][1]:
                colour = COLOURS[number % len(COLOURS)] if len(found.loads) > 1 else GREY
                axes.axvline(relief, color=colour, ls=":", lw=1.2, label=f"textbook at {load:g} N m")
    axes.set_xlabel(found.names[key].replace("+", "\n+ "))
    axes.set_ylim(0, 1.06 * axes.get_ylim()[1])


def _contours(drawing: Any, axes: Any, found: Optimum) -> None:
    """The worst or mean over the even look at both keys."""
    rows = slice(found.valley.scanned)
    points, aim = found.valley.points[rows], found.valley.aim[rows]
    first, second = (np.unique(points[:, key]) for key in (0, 1))
    grid = np.full((len(second), len(first)), np.nan)
    grid[np.searchsorted(second, points[:, 1]), np.searchsorted(first, points[:, 0])] = np.where(
        np.isfinite(aim), aim, np.nan
    )
    filled = axes.contourf(first, second, np.ma.masked_invalid(grid), levels=LEVELS, cmap="viridis_r")
    drawing.colorbar(filled, ax=axes, label=_label(found))
    visited = found.valley.points[found.valley.scanned :]
    axes.plot(visited[:, 0], visited[:, 1], ".", color="white", ms=3, alpha=0.8, label="search and cuts")
    words = f"least: {found.value:.3g} at {found.best[0]:.4g}, {found.best[1]:.4g}"
    axes.plot(*found.best, "*", color=ORANGE, mec="black", ms=15, label=words)
    if all(name.endswith("tip_relief_um") for name in found.names):
        for load, relief in zip(found.loads, found.textbook, strict=True):
            if relief <= min(bound[1] for bound in found.bounds):
                axes.plot(relief, relief, "D", color="white", mec="black", ms=6)
                words = f"textbook, {load:g} N m"
                axes.annotate(words, (relief, relief), (6, -10), textcoords="offset points", fontsize=8)
    axes.set_xlabel(found.names[0].replace("+", "\n+ "))
    axes.set_ylabel(found.names[1].replace("+", "\n+ "))
    axes.grid(visible=False)
    named = axes.get_legend_handles_labels()
    drawing.legend(*named, loc="outside upper center", ncols=2, fontsize=9, facecolor="#bbbbbb", frameon=True)


def _label(found: Optimum) -> str:
    over = f", {found.over} over the loads" if len(found.loads) > 1 and len(found.names) == 2 else ""
    unit = f" [{found.column.unit}]" if found.column.unit not in ("", "1") else ""
    return f"{found.column.words}{over}{unit}"
