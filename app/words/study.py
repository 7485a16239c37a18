"""The words of a study: what its results span, which factor decides, what failed."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.study.indices import Effect, Effects, Interval

SAMPLES = {
    "grid": "every combination of the levels",
    "lhs": "a Latin hypercube",
    "sobol": "a Sobol sequence in Saltelli's design",
}


def unit(name: str) -> str:
    """A unit behind a number; nothing for 1."""
    return "" if name in ("", "1") else f" {name}"


def span_line(table: xr.Dataset, result: str) -> str:
    """Range, mean and spread of one result."""
    held = table[result]
    values = np.asarray(held.values, dtype=float)
    good = values[np.isfinite(values)]
    words = f"{held.attrs['long_name']} ({result})"
    if not good.size:
        return f"{words}: no member has it"
    shown = unit(str(held.attrs["units"]))
    if good.size == 1 or not np.ptp(good):
        return f"{words}: {good[0]:.4g}{shown} in every member"
    low, middle, high = np.quantile(good, [0.05, 0.5, 0.95])
    return (
        f"{words}: {good.min():.4g} to {good.max():.4g}{shown}, mean {good.mean():.4g}, standard deviation"
        f" {good.std(ddof=1):.3g}; 5, 50, 95 % of the members lie below {low:.4g}, {middle:.4g}, {high:.4g}"
    )


def span_title(table: xr.Dataset, result: str) -> str:
    """Range of one result, for a headline."""
    values = np.asarray(table[result].values, dtype=float)
    good = values[np.isfinite(values)]
    words = str(table[result].attrs["long_name"])
    words = words[:1].upper() + words[1:]
    if not good.size:
        return f"{words}: no member has it"
    spread = f", mean {good.mean():.4g}, standard deviation {good.std(ddof=1):.3g}" if good.size > 1 else ""
    return f"{words}: {good.min():.4g} to {good.max():.4g}{unit(str(table[result].attrs['units']))}{spread}"


def decider(effects: Effects) -> str:
    """Which factor decides a result; nothing where fewer than two are known that could."""
    known = [one for one in effects.each if isfinite(one.first)]
    if len(known) < 2:
        return ""
    ranked = sorted(known, key=lambda one: -(one.total if isfinite(one.total) else one.first))
    first = ranked[0]
    low, high = first.first_interval
    sure = f" (90 %: {percent(low)[:-2]} to {percent(high)})" if isfinite(low) else ""
    line = f"{first.factor} decides {percent(first.first)}{sure} of the variance of {effects.result}"
    more = first.total > first.first and percent(first.total) != percent(first.first)
    line += f", {percent(first.total)} with its interactions" if more else ""
    if len(ranked) > 1:
        second = ranked[1]
        line += f"; then {second.factor} ({percent(second.total if isfinite(second.total) else second.first)})"
    return f"{line}."


def best(table: xr.Dataset, result: str, factors: Sequence[str]) -> str:
    """The member with the smallest value of a result."""
    values = np.asarray(table[result].values, dtype=float)
    if not np.isfinite(values).any():
        return ""
    at = int(np.nanargmin(values))
    where = ", ".join(f"{name} = {shown(table[name].values[at])}" for name in factors)
    return f"Smallest {result}: {values[at]:.4g}{unit(str(table[result].attrs['units']))} at {where} (member {at})."


def failures(table: xr.Dataset) -> list[tuple[str, int]]:
    """The sentences of failed members and how many have each, the most frequent first."""
    said: dict[str, int] = {}
    for sentence in table["sentence"].values:
        if sentence:
            said[str(sentence)] = said.get(str(sentence), 0) + 1
    return sorted(said.items(), key=lambda item: -item[1])


def percent(part: float) -> str:
    """A part as per cent; an estimate a little below 0 or above 1 is noise about it."""
    return f"{100 * min(max(part, 0.0), 1.0):.0f} %" if isfinite(part) else "-"


def between(interval: Interval) -> str:
    """An interval of an index, or a dash."""
    return f"{interval[0]:.2f} to {interval[1]:.2f}" if isfinite(interval[0]) else "-"


def shown(value: object) -> str:
    """A value of a factor."""
    return value if isinstance(value, str) else f"{float(value):.6g}"  # type: ignore[arg-type]


def _row(effects: Effects, one: Effect) -> list[str]:
    numbers = [one.low, one.high, one.least, one.most, one.first, *one.first_interval]
    numbers += [one.total, *one.total_interval, one.trend]
    texts = ["" if not isfinite(number) else repr(float(number)) for number in numbers]
    return [effects.result, effects.unit, one.factor, *texts, effects.method, str(effects.members)]


def effects_csv(effects: Sequence[Effects]) -> str:
    """The effects of all factors on all results as CSV."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    means = ["mean_at_lowest", "mean_at_highest", "least_mean", "most_mean"]
    first = ["first_index", "first_low", "first_high", "total_index", "total_low", "total_high"]
    writer.writerow(["result", "unit", "factor", *means, *first, "correlation", "method", "members"])
    for result in effects:
        writer.writerows(_row(result, one) for one in result.each)
    return out.getvalue()


def effects_from(text: str) -> list[Effects]:
    """The effects in what `effects_csv` wrote."""
    from gearbench.bench.study.indices import Effect, Effects

    def number(cell: str) -> float:
        return float(cell) if cell else float("nan")

    def effect(row: dict[str, str]) -> Effect:
        return Effect(
            row["factor"],
            low=number(row["mean_at_lowest"]),
            high=number(row["mean_at_highest"]),
            least=number(row["least_mean"]),
            most=number(row["most_mean"]),
            first=number(row["first_index"]),
            first_interval=(number(row["first_low"]), number(row["first_high"])),
            total=number(row["total_index"]),
            total_interval=(number(row["total_low"]), number(row["total_high"])),
            trend=number(row["correlation"]),
        )

    rows = list(csv.DictReader(io.StringIO(text)))
    found = []
    for name in dict.fromkeys(row["result"] for row in rows):
        mine = [row for row in rows if row["result"] == name]
        first = mine[0]
        found.append(Effects(name, first["unit"], first["method"], int(first["members"]), tuple(map(effect, mine))))
    return found
