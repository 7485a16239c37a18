"""Results of a case at points of its keys: each computed once, here or on processes, and kept for the same search.

What a search will ask for in any case (its first look, the cuts through its lowest point) is computed side by side;
its steps, each of which depends on the one before, one after the other.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from math import isfinite, nan

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.study.member import Task
from gearbench.bench.study.processes import compute_here
from gearbench.bench.study.quantities import Ask, at_loads
from gearbench.rig import Case

Array = NDArray[np.float64]
Point = tuple[float, ...]

QUICK = 20.0  # s: what takes less is computed here, for processes take seconds to begin
OFTEN = 1.0  # s between two writings of what is known


def _nothing(*_: object) -> None:
    """Neither kept nor told."""


@dataclass
class Points:
    """Results (loads,) of one `column` at points.

    case_at, text_at: the case at a point, as value and as TOML; both raise ValueErrors of ours. `workers`: processes
    (absent: as many as there are processors, where it pays). keep(text): takes what is known, as `read_points` reads
    it. tell(count): hears of every point. `said`: why the last point without a result has none.
    """

    case_at: Callable[[Point], Case]
    text_at: Callable[[Point], str]
    ask: Ask
    column: str
    workers: int | None = None
    keep: Callable[[str], object] = _nothing
    tell: Callable[[int], object] = _nothing
    known: dict[Point, Array] = field(default_factory=dict)
    said: str = ""
    _kept: float = 0.0

    def at(self, point: Point) -> Array:
        """Results (loads,), NaN where there are none."""
        if point not in self.known:
            self._learn(point, self._here(point))
        return self.known[point]

    def ahead(self, points: Sequence[Point]) -> None:
        """Compute these, side by side where that is faster."""
        from gearbench.bench.plan.workers import processors

        missing = [point for point in dict.fromkeys(points) if point not in self.known]
        crew = self.workers or processors()
        if crew > 1 and self.workers is None and len(missing) > 1:
            began = time.perf_counter()
            self.at(missing.pop(0))
            crew = crew if (time.perf_counter() - began) * len(missing) > QUICK else 1
        if crew > 1 and len(missing) > 1:
            self._there(missing, crew)

    def finish(self) -> None:
        """Keep all that is known."""
        self.keep(points_text(self.known))

    def _here(self, point: Point) -> Array:
        try:
            return at_loads(self.case_at(point), self.ask.loads, self.ask.of[0], self.column, self.ask)
        except (ValueError, ArithmeticError) as error:  # a sentence of ours: such a point is none
            self.said = str(error)
            return np.full(len(self.ask.loads), nan)

    def _there(self, points: Sequence[Point], crew: int) -> None:
        tasks = []
        for number, point in enumerate(points):
            try:
                tasks.append(Task(number, self.text_at(point), self.ask))
            except ValueError as error:
                self.said = str(error)
                self._learn(point, np.full(len(self.ask.loads), nan))
        with closing(compute_here(tasks, crew)) as stream:  # type: ignore[type-var]
            for found in stream:
                self.said = found.sentence or self.said
                if not found.sources:
                    continue  # its process died, which says nothing of its case: the search tries it again
                values = [found.numbers.get(f"{self.column}@{place}", nan) for place in range(len(self.ask.loads))]
                self._learn(points[found.number], np.array(values))

    def _learn(self, point: Point, values: Array) -> None:
        self.known[point] = values
        self.tell(len(self.known))
        if time.monotonic() - self._kept > OFTEN:
            self.finish()
            self._kept = time.monotonic()


def points_text(known: dict[Point, Array]) -> str:
    """Points and their results as JSON, exact to the last bit."""
    rows = [[list(point), [one if isfinite(one) else None for one in map(float, values)]]
            for point, values in known.items()]  # fmt: skip
    return json.dumps(rows, indent=None, separators=(",", ":")) + "\n"


def read_points(text: str) -> dict[Point, Array]:
    """What `points_text` wrote. Raises ValueError for anything else."""
    found = {}
    try:
        for point, values in json.loads(text):
            found[tuple(map(float, point))] = np.array([nan if one is None else float(one) for one in values])
    except TypeError as error:
        raise ValueError(str(error)) from error
    return found
