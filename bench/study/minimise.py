"""The lowest point of a result over a few keys within bounds, at several loads, without derivatives; and how flat the
valley around it is.

First a coarse look at everything, so that the search begins in the deepest valley that shows; then Brent's bounded
method (one key) or Nelder and Mead's with bounds (several), both scipy's. Nothing is drawn by chance: the same question
gets the same answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import qmc

from gearbench.bench.errors import BenchError

Array = NDArray[np.float64]
Over = Literal["worst", "mean"]
Evaluate = Callable[[tuple[float, ...]], Array]

SCAN = (17, 9)  # points a key of the first look: at one key, at two
SOBOL_POINTS = 32  # a key, at three and more
HALVINGS = 3  # of the spacing in which an edge of the valley lies
SLICE = 9  # points of a cut through the lowest point
CLOSE = 1e-3  # of the range of a key: where the search ends
ROUNDS = 60  # of Nelder and Mead, a key
FLAT = 0.10  # the valley reaches as far as the result stays within this part of its lowest value
MOST_KEYS = 6


@dataclass(frozen=True)
class Valley:
    """`points` (n, keys) that were computed, in order, and results (n, loads) there, NaN where there is none; `best`:
    the row of the lowest; `scanned`: how many of the first rows are the even look; `flat`: for each key the interval
    around the lowest point in which the aim is within FLAT of it, and whether that interval ends at a bound."""

    points: Array
    values: Array
    aim: Array
    best: int
    scanned: int
    flat: tuple[tuple[float, float], ...]


@dataclass
class _Trail:
    """All evaluations, each made once; points in units of their ranges."""

    evaluate: Evaluate
    low: Array
    high: Array
    over: Over
    ahead: Callable[[Sequence[tuple[float, ...]]], None]
    seen: dict[tuple[float, ...], Array] = field(default_factory=dict)

    def point(self, part: Sequence[float] | Array) -> tuple[float, ...]:
        """A point given by its parts (0..1) of the ranges."""
        place = self.low + np.clip(np.asarray(part, dtype=float), 0.0, 1.0) * (self.high - self.low)
        return tuple(float(f"{one:.10g}") for one in place)

    def at(self, part: Sequence[float] | Array) -> float:
        """The aim at a point given by its parts of the ranges; infinite where there is no result."""
        key = self.point(part)
        if key not in self.seen:
            self.seen[key] = self.evaluate(key)
        return aim_of(self.seen[key], self.over)

    def all(self, parts: Sequence[Array] | Array) -> list[float]:
        """The aims at several points, which may be computed side by side."""
        self.ahead([key for key in map(self.point, parts) if key not in self.seen])
        return [self.at(part) for part in parts]


def aim_of(values: Array, over: Over) -> float:
    """The number to be made small out of results (loads,); infinite if one is missing."""
    if not np.isfinite(values).all():
        return inf
    return float(values.max() if over == "worst" else values.mean())


def minimise(
    evaluate: Evaluate,
    bounds: Sequence[tuple[float, float]],
    over: Over = "worst",
    ahead: Callable[[Sequence[tuple[float, ...]]], None] | None = None,
) -> Valley:
    """The lowest aim within bounds (keys,) of `evaluate(point) -> (loads,)`, which gives NaN where it cannot.
    `ahead(points)` is told of several that will be asked for next, whatever their results.

    Raises BenchError when the first look finds no point with a result.
    """
    if not 1 <= len(bounds) <= MOST_KEYS:
        raise BenchError(f"{len(bounds)} keys vary: at least 1 and at most {MOST_KEYS} can be searched together")
    low, high = (np.array(ends) for ends in zip(*bounds, strict=True))
    look = _look(len(bounds))
    trail = _Trail(evaluate, low, high, over, ahead or (lambda points: None))
    aims = trail.all(look)
    if not np.isfinite(aims).any():
        raise BenchError("no point of the first look at the range has a result")
    scanned = len(trail.seen)
    start = look[int(np.argmin(aims))]
    if len(bounds) == 1:
        step = 1 / (SCAN[0] - 1)
        within = (max(0.0, start[0] - step), min(1.0, start[0] + step))
        minimize_scalar(lambda x: trail.at([x]), bounds=within, method="bounded", options={"xatol": CLOSE})
    else:
        _nelder_mead(trail, start)
    flat = _flat(trail, len(bounds))
    points, values = np.array(list(trail.seen)), np.array(list(trail.seen.values()))
    aim = np.array([aim_of(one, over) for one in values])
    return Valley(points, values, aim, int(np.argmin(aim)), scanned, flat)


def about_points(keys: int) -> int:
    """How many points a search over so many keys takes, roughly."""
    return len(_look(keys)) + 12 + 40 * (keys - 1)


def _look(keys: int) -> Array:
    """Points (n, keys) of the first look, in parts of the ranges."""
    if keys > len(SCAN):
        return np.asarray(qmc.Sobol(keys, scramble=False).random(1 << (SOBOL_POINTS * keys - 1).bit_length()))
    return np.array(list(product(np.linspace(0.0, 1.0, SCAN[keys - 1]), repeat=keys)))


def _nelder_mead(trail: _Trail, start: Array) -> None:
    keys = len(start)
    size = 0.5 / (SCAN[1] - 1)
    corners = [start]
    for key in range(keys):
        corner = start.copy()
        corner[key] += size if start[key] + size <= 1.0 else -size
        corners.append(corner)
    options = {"initial_simplex": np.array(corners), "xatol": CLOSE, "fatol": inf, "maxfev": ROUNDS * keys}
    # A point without a result has to be merely bad: infinities would make the simplex's arithmetic fail.
    worst = 10 * max(one for one in map(lambda v: aim_of(v, trail.over), trail.seen.values()) if one < inf)
    within = [(0.0, 1.0)] * keys
    minimize(lambda part: min(trail.at(part), worst), start, method="Nelder-Mead", bounds=within, options=options)


def _flat(trail: _Trail, keys: int) -> tuple[tuple[float, float], ...]:
    """How far the valley reaches along each key, through its lowest point."""
    best = min(trail.seen, key=lambda point: aim_of(trail.seen[point], trail.over))
    part = (np.array(best) - trail.low) / (trail.high - trail.low)
    limit = (1 + FLAT) * aim_of(trail.seen[best], trail.over)
    found: list[tuple[float, ...]] = []
    for key in range(keys):
        places = np.linspace(0.0, 1.0, SLICE if keys > 1 else SCAN[0])
        trail.all([np.where(np.arange(keys) == key, place, part) for place in places])
        others = [other for other in range(keys) if other != key]
        line = sorted(
            (point[key], aim_of(values, trail.over))
            for point, values in trail.seen.items()
            if all(abs(point[other] - best[other]) <= 1e-9 * abs(best[other]) for other in others)
        )
        where, aims = np.array(line).T
        at = int(np.argmin(np.abs(where - best[key])))
        found.append(tuple(_edge(_Cut(trail, part, key), where, aims, at, limit, step) for step in (-1, 1)))
    return tuple((low, high) for low, high in found)


@dataclass
class _Cut:
    """The aim along one key, the others where `part` has them."""

    trail: _Trail
    part: Array
    key: int

    def at(self, place: float) -> float:
        """The aim at a value of the key."""
        low, high = self.trail.low[self.key], self.trail.high[self.key]
        return self.trail.at(np.where(np.arange(len(self.part)) == self.key, (place - low) / (high - low), self.part))


def _edge(cut: _Cut, places: Array, aims: Array, at: int, limit: float, step: int) -> float:
    """Where the aim crosses the limit, from `at` on, found by halving; the end of the range if it does not."""
    while 0 <= at + step < len(places):
        if aims[at + step] <= limit:
            at += step
            continue
        (inside, here), (outside, there) = (places[at], aims[at]), (places[at + step], aims[at + step])
        for _ in range(HALVINGS):
            middle = 0.5 * (inside + outside)
            aim = cut.at(middle)
            if aim > limit:
                outside, there = middle, aim
            else:
                inside, here = middle, aim
        part = (limit - here) / (there - here) if np.isfinite(there) else 0.0
        return float(inside + part * (outside - inside))
    return float(places[at])
