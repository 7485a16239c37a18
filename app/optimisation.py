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
from gearbench.studies import reader

if TYPE_CHECKING:
    from gearbench.bench.study.design import Factor
    from gearbench.bench.study.minimise import Over, Valley
    from gearbench.bench.study.quantities import Ask, Column
    from gearbench.rig import Case


@dataclass(frozen=True)
class Optimum:
    """What `optimise` finds. best: value of each key; value: the worst (or mean) of `at_loads`, the results at `loads`
    [N m]; unit; before: the same of the case as it stands, NaN where it has no result; flat: for each key the interval
    in which the result stays within 10 %; textbook: tip relief [um] by the rule of thumb at each load, empty where no
    tip relief varies; valley: all that was computed; case: the case with the best values."""

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
    force: bool = False,
    progress: Steps | None = None,
) -> Optimum:
    """The values of a few keys that make a result smallest: its worst or mean over several loads.

    `vary`: "KEY=LOW:HIGH", or "KEY1+KEY2=LOW:HIGH" for keys that move together; at most six. `quantity`: a result of
    docs/campaigns.md, or one of its columns. `torques` [N m]: the loads; absent: the experiment's mean. With `out` the
    folder gets valley.csv, valley.png, optimum.json and best.toml. Derivative-free and the same every time. Raises
    CaseError, BenchError or InputError, one sentence.

    >>> import gearbench as gb
    >>> found = gb.optimise("quick_lumped", ["rig.driver.face_width_mm=10:20"], "te-mean", [100.0, 200.0])
    >>> found.best, f"{found.value:.1f} {found.column.unit}"
    ((20.0,), '8.3 um')
    """
    from gearbench.bench.errors import BenchError
    from gearbench.bench.study.minimise import minimise
    from gearbench.bench.study.quantities import Ask, at_loads, single_column

    if over not in ("worst", "mean"):
        raise InputError(f"over = {over!r} must be worst or mean")
    name, column = single_column(quantity)
    factors = _factors(vary)
    ask = Ask((name,), None, positions, cycles)
    teller = progress or Silent()
    with reader(case) as read:
        base = read(settings)
        loads = tuple(float(one) for one in torques) or _own_load(base)
        for load in loads:
            if not (np.isfinite(load) and load > 0):
                raise InputError(f"--at-nm {load:g} must be a torque greater than 0 N m")
        bounds = tuple((factor.axis.low, factor.axis.high) for factor in factors)
        last: dict[str, str] = {}

        def case_at(point: Sequence[float]) -> Case:
            pairs = zip(factors, point, strict=True)
            made: Case = read([*settings, *(f"{key}={value!r}" for f, value in pairs for key in f.axis.keys)])
            return made

        def evaluate(point: Sequence[float]) -> Any:
            try:
                return at_loads(case_at(point), loads, name, column.name, ask)
            except (ValueError, ArithmeticError) as error:  # a sentence of ours: such a point is none
                last["said"] = str(error)
                return np.full(len(loads), np.nan)

        asked = [quantity, over, json.dumps([loads, bounds, positions, cycles, list(vary)])]
        teller.step("search")

        def report(count: int, about: int) -> None:
            teller(min(count / about, 0.99), f"{count} points")

        try:
            valley = minimise(evaluate, bounds, over, report)
        except BenchError as error:
            raise BenchError(f"{error}{': ' if last else ''}{last.get('said', '')}") from error
        before = _before(base, loads, name, column, ask)
        best = tuple(float(one) for one in valley.points[valley.best])
        found = Optimum(
            case_at(best).model_copy(update={"study": None}), tuple(factor.name for factor in factors), column, over,
            loads, best, float(valley.aim[valley.best]), tuple(map(float, valley.values[valley.best])), before,
            valley.flat, bounds, textbook_relief(base, factors, loads), valley,
        )  # fmt: skip
    if out is not None:
        from gearbench.records.provenance import source_digest
        from gearbench.rig import dump_case

        with claimed(Path(out), "optimise", fingerprint(dump_case(base), source_digest(), *asked), force) as output:
            teller.step("files")
            write_optimum(found, output)
    return found


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
