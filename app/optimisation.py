"""`gb.optimise`: the keys of a case that make a result smallest at several loads, with the valley around them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.files import fingerprint
from gearbench.shell.failure import InputError
from gearbench.shell.output import Output, claimed
from gearbench.shell.progress import Silent, Steps
from gearbench.studies import member_text, reader

if TYPE_CHECKING:
    from gearbench.bench.study.design import Factor
    from gearbench.bench.study.minimise import Over, Valley
    from gearbench.bench.study.quantities import Ask, Column
    from gearbench.rig import Case


KEPT = "points.json"


@dataclass(frozen=True)
class Optimum:
    """What `optimise` finds. best: value of each key; value: the worst (or mean) of `at_loads`, the results at `loads`
    [N m]; unit; before: the same of the case as it stands, NaN where it has no result; flat: for each key the interval
    in which the result stays within 10 %; textbook: tip relief [um] by the rule of thumb at each load, empty where no
    tip relief varies; valley: all that was computed; lacking: why the last point without a result has none, empty where
    all have; case: the case with the best values."""

    case: Case
    names: tuple[str, ...]
    column: Column
    over: str
    loads: tuple[float, ...]
    best: tuple[float, ...]
    value: float
    at_loads: tuple[float, ...]
    before: tuple[float, ...]
    flat: tuple[tuple[float, float], ...]
    bounds: tuple[tuple[float, float], ...]
    textbook: tuple[float, ...]
    valley: Valley
    lacking: str = ""


def optimise(
    case: str | Path | Case,
    vary: Sequence[str],
    quantity: str = "te-peak-to-peak",
    torques: Sequence[float] = (),
    *,
    over: Over = "worst",
    settings: Sequence[str] = (),
    positions: int = 64,
    cycles: int = 1,
    out: str | Path | None = None,
    workers: int | None = None,
    force: bool = False,
    progress: Steps | None = None,
) -> Optimum:
    """The values of a few keys that make a result smallest: its worst or mean over several loads.

    `vary`: "KEY=LOW:HIGH", or "KEY1+KEY2=LOW:HIGH" for keys that move together; at most six. `quantity`: a result of
    docs/campaigns.md, or one of its columns. `torques` [N m]: the loads; absent: the experiment's mean. With `out` the
    folder gets valley.csv, valley.png, optimum.json and best.toml, and points.json while it searches: one that was
    interrupted goes on in the folder of the same question and sources; another's is refused unless `force`. What can
    be computed side by side runs on `workers` processes (absent: as many as there are processors, where it pays).
    Derivative-free and the same every time. Raises CaseError, BenchError or InputError, one sentence.

    >>> import gearbench as gb
    >>> found = gb.optimise("quick_lumped", ["rig.driver.face_width_mm=10:20"], "te-mean", [100.0, 200.0])
    >>> found.best, f"{found.value:.1f} {found.column.unit}"
    ((20.0,), '8.3 um')
    """
    from gearbench.bench.study.quantities import Ask, single_column

    if over not in ("worst", "mean"):
        raise InputError(f"over = {over!r} must be worst or mean")
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers} must be at least 1")
    name, column = single_column(quantity)
    factors = _factors(vary)
    with reader(case) as read:
        base = read(settings)
        loads = tuple(float(one) for one in torques) or _own_load(base)
        for load in loads:
            if not (np.isfinite(load) and load > 0):
                raise InputError(f"--at-nm {load:g} must be a torque greater than 0 N m")
        ask = Ask((name,), None, positions, cycles, loads)
        search = _Search(base, partial(_case_at, read, settings, factors), factors, ask, column, over, workers)
        if out is None:
            return search.found(progress or Silent())
        with claimed(Path(out), "optimise", search.identity(quantity, vary), force) as output:
            return search.found(progress or Silent(), output)


def _case_at(read: Any, settings: Sequence[str], factors: Sequence[Factor], point: Sequence[float]) -> Case:
    """The case with the keys at a point. Raises CaseError."""
    pairs = zip(factors, point, strict=True)
    made: Case = read([*settings, *(f"{key}={value!r}" for factor, value in pairs for key in factor.axis.keys)])
    return made


@dataclass(frozen=True)
class _Search:
    """A question: the case as it stands and at a point, what moves, what is asked for, how."""

    base: Case
    case_at: Any
    factors: tuple[Factor, ...]
    ask: Ask
    column: Column
    over: Over
    workers: int | None

    @property
    def bounds(self) -> tuple[tuple[float, float], ...]:
        return tuple((factor.axis.low, factor.axis.high) for factor in self.factors)

    def identity(self, quantity: str, vary: Sequence[str]) -> str:
        """What tells it from another question."""
        from gearbench.records.provenance import source_digest
        from gearbench.rig import dump_case

        asked = json.dumps([self.ask.loads, self.bounds, self.ask.positions, self.ask.cycles, list(vary)])
        return fingerprint(dump_case(self.base), source_digest(), quantity, self.over, asked)

    def found(self, teller: Steps, output: Output | None = None) -> Optimum:
        """The answer, in the folder too where there is one. Raises BenchError."""
        from gearbench.bench.errors import BenchError
        from gearbench.bench.study.minimise import minimise
        from gearbench.bench.study.points import Points

        teller.step("search")
        points = Points(self.case_at, lambda point: member_text(self.case_at(point)), self.ask, self.column.name,
                        self.workers, tell=partial(_told, teller, len(self.factors)))  # fmt: skip
        if output is not None:
            points.known.update(_kept(output))
            points.keep = partial(output.write_text, KEPT)
        try:
            valley = minimise(points.at, self.bounds, self.over, points.ahead)
        except BenchError as error:
            raise BenchError(f"{error}{': ' if points.said else ''}{points.said}") from error
        finally:
            points.finish()
        name, loads = self.ask.of[0], self.ask.loads
        answered = int(np.isfinite(valley.aim).sum())
        if answered < 2:
            looked = f"one point of {len(valley.aim)} has a result, which leaves nothing to search"
            raise BenchError(f"{looked}: {points.said}")
        before = _before(self.base, loads, name, self.column, self.ask)
        best = tuple(float(one) for one in valley.points[valley.best])
        found = Optimum(
            self.case_at(best).model_copy(update={"study": None}), tuple(factor.name for factor in self.factors),
            self.column, self.over, loads, best, float(valley.aim[valley.best]),
            tuple(map(float, valley.values[valley.best])), before, valley.flat, self.bounds,
            textbook_relief(self.base, self.factors, loads), valley, points.said if answered < len(valley.aim) else "",
        )  # fmt: skip
        if output is not None:
            teller.step("files")
            write_optimum(found, output)
        return found


def _told(teller: Steps, keys: int, count: int) -> None:
    from gearbench.bench.study.minimise import about_points

    teller(min(count / about_points(keys), 0.99), f"{count} points")


def _kept(output: Output) -> dict[tuple[float, ...], Any]:
    """Points that the same search has computed before."""
    from gearbench.bench.study.points import read_points

    if not output.has(KEPT):
        return {}
    try:
        return read_points(output.path(KEPT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def _before(base: Case, loads: Sequence[float], name: str, column: Column, ask: Ask) -> tuple[float, ...]:
    """The results of the case as it stands."""
    from gearbench.bench.study.quantities import at_loads

    try:
        return tuple(map(float, at_loads(base, loads, name, column.name, ask)))
    except ValueError:
        return (float("nan"),) * len(loads)


def _factors(vary: Sequence[str]) -> tuple[Factor, ...]:
    """What may move, each between two bounds. Raises CaseError or InputError."""
    from gearbench.bench.study.design import factor_of

    if not vary:
        raise InputError("nothing may move: give --vary KEY=LOW:HIGH")
    factors = tuple(factor_of(text) for text in vary)
    for text, factor in zip(vary, factors, strict=True):
        if factor.axis.kind != "interval":
            raise InputError(f"--vary {text!r} must read KEY=LOW:HIGH: optimise moves between two bounds")
        if factor.key.kind != "number":
            raise InputError(f"{factor.name} is a whole number, which optimise does not move: use campaign")
    names = [key for factor in factors for key in factor.axis.keys]
    for key in names:
        if names.count(key) > 1:
            raise InputError(f"--vary names {key} twice")
    return factors


def _own_load(base: Case) -> tuple[float, ...]:
    """The experiment's mean torque."""
    if not base.stated:
        raise InputError("experiment.torque_mean_nm is missing: give the loads, --at-nm 50,100,200")
    return (base.experiment.torque_mean,)


def textbook_relief(base: Case, factors: Sequence[Factor], loads: Sequence[float]) -> tuple[float, ...]:
    """Tip relief [um] at each load by the rule of thumb that the tip be set back by as much as the tooth pair before it
    is bent when it carries alone (Walker, The Engineer 166 (1938) 409 and 434): F / (b c'), F along the line of action,
    c' the single stiffness of ISO 6336-1 Method B. Nothing where no tip relief varies."""
    from gearbench.geometry import GeometryError, pair
    from gearbench.lumped.stiffness.iso6336 import iso_stiffness

    if not any(key.endswith("tip_relief_um") for factor in factors for key in factor.axis.keys):
        return ()
    try:
        meshing = pair(base.rig)
    except GeometryError:
        return ()
    found = []
    for load in loads:
        force = load / meshing.driver.base_radius
        single = iso_stiffness(base.rig, meshing, force).single
        found.append(force / (1e3 * meshing.face_width) / single)
    return tuple(found)


def write_optimum(found: Optimum, output: Output) -> None:
    """All that was computed, its picture, the answer and the case with it."""
    from gearbench.figures.studies.valley import draw_valley
    from gearbench.rig import dump_case
    from gearbench.shell.options import json_text
    from gearbench.words.valley import optimum_data, valley_csv

    output.write_text("valley.csv", valley_csv(found))
    output.write_text("best.toml", dump_case(found.case))
    output.write_text("optimum.json", json_text(optimum_data(found)) + "\n")
    output.write("valley.png", partial(draw_valley, found))
