"""Which factor decides a result: variance-based sensitivity indices and main effects, each with how it was found.

first index S_i = Var(E[y|x_i]) / Var(y), total index T_i = E[Var(y|x_~i)] / Var(y) (Saltelli et al., Global Sensitivity
Analysis: The Primer, 2008). By the sample:

* grid: both exactly, for levels that are equally likely, by sums over the full factorial; nothing is drawn, so there is
  no interval;
* sobol: from correlations of Saltelli's samples, S_i = r(B, AB_i), T_i = 1 - r(A, AB_i) (Martinez' estimator: Baudin et
  al., Sensitivity Analysis of Model Output, 2016), which unlike those with products keep their meaning with few base
  points: a factor that decides alone has S = 1 exactly; 90 % intervals by the bootstrap over base points;
* lhs, and a grid in which single members failed: S_i from the variance between bins of x_i, less what chance alone puts
  between them (epsilon squared: Kelley, PNAS 21 (1935) 554), 90 % intervals by the bootstrap over members; T_i is
  not known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.study.design import Design

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Interval = tuple[float, float]

RESAMPLES = 500
LEVEL = 0.90
MOST_BINS = 8
PER_BIN = 5
NOTHING: Interval = (float("nan"), float("nan"))


@dataclass(frozen=True)
class Effect:
    """What one factor does to one result. `low`, `high`: mean result at the lowest and the highest values of the factor
    (by bins), `least`, `most`: range of that mean over all of them; indices with their intervals; `trend`: linear
    correlation with the factor, which is the standardised slope of the regression on it alone (NaN for texts)."""

    factor: str
    low: float
    high: float
    least: float
    most: float
    first: float
    first_interval: Interval
    total: float
    total_interval: Interval
    trend: float


@dataclass(frozen=True)
class Effects:
    """All factors' effects on one result, how they were found, and how many members counted."""

    result: str
    unit: str
    method: str
    members: int
    each: tuple[Effect, ...]


def effects_of(design: Design, dataset: xr.Dataset, result: str, seed: int = 0) -> Effects:
    """The effects of all factors on a result of a study's table. Without two different numbers they are NaN, as are the
    indices of a factor of which one value alone has results."""
    values = np.asarray(dataset[result].values, dtype=float)
    good = np.isfinite(values)
    groups = [_groups(design, dataset, place) for place in range(len(design.factors))]
    first, total, intervals, method, counted = _indices(design, values, good, groups, seed)
    moved = np.array([len(np.unique(group[good])) > 1 for group in groups])
    first, total = (np.where(moved, one, np.nan) for one in (first, total))
    intervals = [one if known else (NOTHING, NOTHING) for one, known in zip(intervals, moved, strict=True)]
    each = []
    for place, factor in enumerate(design.factors):
        means = _means(groups[place][good], values[good])
        known = means[np.isfinite(means)]
        ends = known if known.size else np.array([np.nan])
        numbers = np.asarray(dataset[factor.name].values[good], dtype=float) if factor.numeric else None
        each.append(
            Effect(
                factor.name,
                low=float(ends[0]),
                high=float(ends[-1]),
                least=float(ends.min()),
                most=float(ends.max()),
                first=float(first[place]),
                first_interval=intervals[place][0],
                total=float(total[place]),
                total_interval=intervals[place][1],
                trend=_trend(numbers, values[good]),
            )
        )
    return Effects(result, str(dataset[result].attrs["units"]), method, counted, tuple(each))


def _indices(
    design: Design, values: Array, good: NDArray[np.bool_], groups: Sequence[Index], seed: int
) -> tuple[Array, Array, list[tuple[Interval, Interval]], str, int]:
    """First and total indices (factors,), their intervals, words of the method, members that counted."""
    count = len(groups)
    none = [(NOTHING, NOTHING)] * count
    rng = np.random.default_rng(seed)
    if design.base:
        blocks = values.reshape(count + 2, design.base)
        whole = blocks[:, np.isfinite(blocks).all(axis=0)]
        method = f"Sobol design, {whole.shape[1]} of {design.base} base points"
        if whole.shape[1] < 2 or not np.ptp(whole[:2]):
            return np.full(count, np.nan), np.full(count, np.nan), none, method, whole.size
        first, total = saltelli(whole)
        drawn = [saltelli(whole[:, pick]) for pick in _picks(rng, whole.shape[1])]
        return first, total, _intervals(drawn, count), method, whole.size
    kept = values[good]
    if kept.size < 2 or not np.ptp(kept):
        return np.full(count, np.nan), np.full(count, np.nan), none, "nothing varies", kept.size
    grid = _whole_grid(design, values) if design.sample == "grid" else None
    if grid is not None:
        first, total = on_grid(grid)
        return first, total, none, "exact on the grid, levels equally likely", kept.size
    members = [group[good] for group in groups]

    def between(pick: Index) -> tuple[Array, Array]:
        return np.array([between_bins(g[pick], kept[pick]) for g in members]), np.full(count, np.nan)

    first, total = between(np.arange(kept.size))
    drawn = [between(pick) for pick in _picks(rng, kept.size)]
    return first, total, _intervals(drawn, count), "variance between bins, chance taken off", kept.size


def _whole_grid(design: Design, values: Array) -> Array | None:
    """The values on the grid, one axis a factor, without the levels at which every member failed; None where others
    are missing."""
    grid = values.reshape([len(factor.levels) for factor in design.factors])
    for axis in range(grid.ndim):
        others = tuple(other for other in range(grid.ndim) if other != axis)
        grid = np.compress(np.isfinite(grid).any(axis=others), grid, axis=axis)
    return grid if np.isfinite(grid).all() else None


def saltelli(blocks: Array) -> tuple[Array, Array]:
    """First and total indices (factors,) from results (factors + 2, n) of the samples A, B, AB_1 .. AB_d."""
    centred = blocks - blocks.mean(axis=1, keepdims=True)
    scale = np.sqrt((centred**2).mean(axis=1))
    a, b, mixed = centred[0], centred[1], centred[2:]
    with np.errstate(invalid="ignore", divide="ignore"):
        first = (mixed * b).mean(axis=1) / (scale[2:] * scale[1])
        total = 1 - (mixed * a).mean(axis=1) / (scale[2:] * scale[0])
    return first, total


def on_grid(values: Array) -> tuple[Array, Array]:
    """First and total indices (factors,) of a full factorial, one axis a factor."""
    axes = range(values.ndim)
    first = [values.mean(axis=tuple(other for other in axes if other != axis)).var() for axis in axes]
    total = [values.var(axis=axis).mean() for axis in axes]
    return np.array(first) / values.var(), np.array(total) / values.var()


def between_bins(group: Index, values: Array) -> float:
    """Part of the variance of values (n,) between their groups, less what chance alone would put there; 0 at least."""
    names, inverse, count = np.unique(group, return_inverse=True, return_counts=True)
    if len(names) < 2 or len(names) >= values.size:
        return float("nan")
    means = np.bincount(inverse, weights=values) / count
    all_squares = float(((values - values.mean()) ** 2).sum())
    inside = float(((values - means[inverse]) ** 2).sum())
    if not all_squares:
        return float("nan")
    chance = (len(names) - 1) * inside / (values.size - len(names))
    return max(0.0, (all_squares - inside - chance) / all_squares)


def _groups(design: Design, dataset: xr.Dataset, place: int) -> Index:
    """The bin (members,) of each member's value, in rising order of the value: its level, or one of equal counts."""
    factor = design.factors[place]
    if factor.levels:
        order = {text: number for number, text in enumerate(factor.levels)}
        if factor.numeric:
            rising = sorted(factor.levels, key=float)
            order = {text: number for number, text in enumerate(rising)}
        return np.array([order[row[place]] for row in design.members])
    values = np.asarray(dataset[factor.name].values, dtype=float)
    bins = int(np.clip(values.size // PER_BIN, 2, MOST_BINS))
    edges = np.quantile(values, np.arange(1, bins) / bins)
    return np.searchsorted(edges, values, side="right").astype(np.int64)


def _means(group: Index, values: Array) -> Array:
    """Mean of the values of each group, in order; NaN for an empty one."""
    if not values.size:
        return np.array([])
    count = np.bincount(group)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.bincount(group, weights=values) / count)


def _trend(numbers: Array | None, values: Array) -> float:
    if numbers is None or values.size < 2 or not np.ptp(numbers) or not np.ptp(values):
        return float("nan")
    return float(np.corrcoef(numbers, values)[0, 1])


def _picks(rng: np.random.Generator, count: int) -> list[Index]:
    return [rng.integers(0, count, count) for _ in range(RESAMPLES)]


def _intervals(drawn: Sequence[tuple[Array, Array]], count: int) -> list[tuple[Interval, Interval]]:
    tails = [(1 - LEVEL) / 2, (1 + LEVEL) / 2]

    def limits(values: Array) -> Interval:
        known = values[np.isfinite(values)]
        return (float("nan"),) * 2 if known.size < RESAMPLES // 2 else tuple(map(float, np.quantile(known, tails)))  # type: ignore[return-value]

    pick: Callable[[int, int], Array] = lambda which, place: np.array([one[which][place] for one in drawn])  # noqa: E731
    return [(limits(pick(0, place)), limits(pick(1, place))) for place in range(count)]
