"""The words of an optimum: what is best, how flat the valley is, what the textbook says."""

from __future__ import annotations

import csv
import io
from math import isfinite
from typing import TYPE_CHECKING, Any

from gearbench.words.study import unit

if TYPE_CHECKING:
    from gearbench.optimisation import Optimum

NEAR = 1e-3  # of the range: a best value this near to a bound is at it


def optimum_lines(found: Optimum) -> list[str]:
    """The answer in a few sentences."""
    shown = unit(found.column.unit)
    torques = ", ".join(f"{load:g}" for load in found.loads)
    over = "" if len(found.loads) == 1 else f", {found.over} over the loads"
    best = ", ".join(f"{name} = {value:.4g}" for name, value in zip(found.names, found.best, strict=True))
    lines = [f"{found.column.words}{over}, at {torques} N m: least {found.value:.4g}{shown} at {best}"]
    if len(found.loads) > 1:
        parts = [f"{one:.4g} at {load:g} N m" for one, load in zip(found.at_loads, found.loads, strict=True)]
        lines.append(f"at each load: {', '.join(parts)}{f' [{found.column.unit}]' if shown else ''}")
    if all(map(isfinite, found.before)):
        before = max(found.before) if found.over == "worst" else sum(found.before) / len(found.before)
        lines.append(f"the case as it stands has {before:.4g}{shown}")
    lines += [_flat_line(found, place) for place in range(len(found.names))]
    if found.lacking:
        empty = sum(not isfinite(one) for one in found.valley.aim)
        lines.append(f"{empty} of {len(found.valley.aim)} points have no result, the last because: {found.lacking}")
    if found.textbook:
        parts = [f"{one:.3g} um at {load:g} N m" for one, load in zip(found.textbook, found.loads, strict=True)]
        lines.append(
            f"textbook tip relief, F/(b c') with c' of ISO 6336-1 Method B (Walker 1938): {', '.join(parts)}"
        )
    return lines


def _flat_line(found: Optimum, place: int) -> str:
    name, (low, high), value = found.names[place], found.flat[place], found.best[place]
    bounds = found.bounds[place]
    near = NEAR * (bounds[1] - bounds[0])
    end = [f"{bound:g}" for bound in bounds if abs(value - bound) <= near]
    line = f"{name}: within 10 % of the least from {low:.4g} to {high:.4g}"
    return f"{line}; the least lies at the bound {end[0]}: beyond it may be better" if end else line


def optimum_data(found: Optimum) -> dict[str, Any]:
    """The answer as plain data."""
    return {
        "case": found.case.name,
        "result": found.column.name,
        "unit": found.column.unit,
        "over": found.over,
        "torques_nm": list(found.loads),
        "best": dict(zip(found.names, found.best, strict=True)),
        "value": found.value,
        "at_torques": list(found.at_loads),
        "before": list(found.before),
        "within_10_percent": dict(zip(found.names, map(list, found.flat), strict=True)),
        "bounds": dict(zip(found.names, map(list, found.bounds), strict=True)),
        "textbook_tip_relief_um": list(found.textbook),
        "points": len(found.valley.points),
    }


def valley_csv(found: Optimum) -> str:
    """Every point that was computed, in order: keys, result at each load, worst or mean."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    at = [f"{found.column.name}_at_{load:g}_nm" for load in found.loads]
    writer.writerow([*found.names, *at, f"{found.column.name}_{found.over}"])
    for point, values, aim in zip(found.valley.points, found.valley.values, found.valley.aim, strict=True):
        writer.writerow([*(f"{one:.10g}" for one in point), *(_cell(one) for one in (*values, aim))])
    return out.getvalue()


def _cell(number: float) -> str:
    return repr(float(number)) if isfinite(number) else ""
