"""Pictures of a study: what each factor moves (tornado), and every member over every factor (scatter)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.figures.plotting import BLUE, GREY, ORANGE, figure, save

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.study.indices import Effects

MOST_RESULTS, MOST_FACTORS = 4, 6
MOST_NAMES = 12  # texts on an axis


def draw_tornado(table: xr.Dataset, effects: Sequence[Effects], path: Path) -> None:
    """Of each result: the range of its mean over each factor, with the means at both ends; factors by their range."""
    shown = effects[:MOST_RESULTS]
    factors = min(len(shown[0].each), 12)
    with figure(len(shown), 1, size=(8.5, (0.9 + 0.42 * factors) * len(shown) + 0.5), squeeze=False) as (drawing, axes):
        for one, result in zip(axes[:, 0], shown, strict=True):
            _tornado(one, result, factors, _label(table, result.result))
        handles, labels = axes[0, 0].get_legend_handles_labels()
        drawing.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
        save(drawing, path)


def _tornado(axes: Any, effects: Effects, count: int, label: str) -> None:
    ranked = sorted(effects.each, key=lambda one: -np.nan_to_num(one.most - one.least))[:count]
    for place, one in enumerate(ranked):
        axes.barh(
            place, one.most - one.least, left=one.least, height=0.62, color="#bcd5e8", lw=0,
            label="range of the mean over the factor" if not place else None,
        )  # fmt: skip
        for value, marker, colour, words in (
            (one.low, "<", BLUE, "mean at its lowest values"),
            (one.high, ">", ORANGE, "mean at its highest values"),
        ):
            axes.plot(value, place, marker, color=colour, ms=7, label=words if not place else None)
        if np.isfinite(one.first):
            total = f", T {max(one.total, 0):.2f}" if np.isfinite(one.total) else ""
            words = f"S {max(one.first, 0):.2f}{total}"
            axes.annotate(
                words, (1.01, place), xycoords=("axes fraction", "data"), va="center", fontsize=8, color=GREY,
                annotation_clip=False,
            )  # fmt: skip
    axes.set_yticks(range(len(ranked)), [_two_lines(one.factor) for one in ranked], fontsize=8)
    axes.set_ylim(len(ranked) - 0.5, -0.5)
    ends = np.array([end for one in ranked for end in (one.least, one.most)])
    if np.isfinite(ends).any():
        room = 0.04 * (np.nanmax(ends) - np.nanmin(ends)) or 1e-3 * abs(np.nanmax(ends)) or 1.0
        axes.set_xlim(np.nanmin(ends) - room, np.nanmax(ends) + room)
    axes.ticklabel_format(axis="x", useOffset=False)
    axes.set_xlabel(label)
    axes.set_title(f"{effects.method}; S: first index, T: total index", fontsize=8, color=GREY, loc="left")


def draw_scatter(table: xr.Dataset, path: Path) -> None:
    """Every member: results (rows) over factors (columns), and how often each value occurs (right)."""
    results = [name for name, held in table.data_vars.items() if held.attrs.get("role") == "result"][:MOST_RESULTS]
    factors = [name for name, held in table.data_vars.items() if held.attrs.get("role") == "factor"][:MOST_FACTORS]
    rows, columns = len(results), len(factors) + 1
    ratios = [1.0] * len(factors) + [0.45]
    size = (min(3.2 + 3.0 * len(factors), 16.0), 2.7 * rows + 0.6)
    with figure(rows, columns, size=size, squeeze=False, sharey="row", width_ratios=ratios) as (drawing, axes):
        for row, result in enumerate(results):
            values = np.asarray(table[result].values, dtype=float)
            good = np.isfinite(values)
            for column, factor in enumerate(factors):
                one = axes[row, column]
                joined = len(factors) == 1 and not str(factor).endswith("seed")
                _points(one, table[factor].values, values, joined)
                one.set_xlabel(_factor_label(table, str(factor)) if row == rows - 1 else "")
                _failed(one, table[factor].values, good, show=row == 0 and column == 0)
            axes[row, 0].set_ylabel(fill(_label(table, str(result)), 34), fontsize=9)
            axes[row, 0].ticklabel_format(axis="y", useOffset=False)
            last = axes[row, -1]
            if good.any():
                bins = min(24, max(5, int(good.sum() ** 0.5)))
                last.hist(values[good], bins=bins, orientation="horizontal", color=GREY)
            last.set_xlabel("members" if row == rows - 1 else "")
        save(drawing, path)


def _points(axes: Any, factor: Any, values: Any, joined: bool) -> None:
    """Members as dots; of a single factor joined by a line, of several with the mean of each level."""
    good = np.isfinite(values)
    if factor.dtype == object:
        names = list(dict.fromkeys(map(str, factor)))
        places = np.array([names.index(str(one)) for one in factor])
        axes.set_xlim(-0.5, len(names) - 0.5)
        if len(names) <= MOST_NAMES:
            axes.set_xticks(range(len(names)), [name.rpartition("/")[2] for name in names], fontsize=8)
    else:
        places = factor
    rising = np.argsort(places[good], kind="stable")
    distinct = len(np.unique(places[good])) == good.sum()
    style = "o-" if joined and distinct and factor.dtype != object else "o"
    many = good.sum() > 300
    axes.plot(
        places[good][rising], values[good][rising], style, color=BLUE, ms=2.0 if many else 3.5, lw=1.0,
        alpha=0.5 if many else 0.85, mew=0,
    )  # fmt: skip
    levels = np.unique(places[good])
    if 1 < len(levels) <= MOST_NAMES and len(levels) < good.sum():
        means = [values[good][places[good] == level].mean() for level in levels]
        axes.plot(levels, means, "-", color=ORANGE, lw=1.4, label="mean")


def _failed(axes: Any, factor: Any, good: Any, show: bool) -> None:
    """Members without a result, on the lower edge."""
    if good.all() or factor.dtype == object:
        return
    places = factor[~good]
    axes.plot(
        places, np.full(len(places), 0.02), "x", color=ORANGE, ms=6, transform=axes.get_xaxis_transform(),
        label="failed", clip_on=False,
    )  # fmt: skip
    if show:
        axes.legend(loc="best", fontsize=8)


def _label(table: xr.Dataset, name: str) -> str:
    """What a result is, with its unit."""
    about = table[name].attrs
    unit = about["units"]
    return str(about["long_name"]) + (f" [{unit}]" if unit not in ("", "1") else "")


def _factor_label(table: xr.Dataset, name: str) -> str:
    unit = str(table[name].attrs["units"])
    return _two_lines(name) + (f" [{unit}]" if unit not in ("", "1") else "")


def _two_lines(name: str) -> str:
    """A long key (or two that move together) on as many lines as it needs."""
    return name.replace("+", "\n+ ")
