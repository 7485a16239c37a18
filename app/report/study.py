"""The one-page report of a study: what the results span, which factor decides, pictures, members, from what."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.report.html import drawing, folded, items, table, text
from gearbench.report.live import live_page
from gearbench.report.study_live import live_scatter, live_tornado
from gearbench.words.study import SAMPLES, best, between, decider, failures, percent, shown, span_line, span_title

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.study.design import Design
    from gearbench.bench.study.indices import Effects

MOST_ROWS = 500
CAPTIONS = {
    "tornado": "What each factor moves: the range of the mean result over the factor, all other factors as they vary;"
    " the mean at its lowest values (blue, to the left) and at its highest (orange, to the right).",
    "scatter": "Every member: each result over each factor, and the mean of each level where members share levels.",
}


def study_page(
    title: str,
    design: Design,
    members: xr.Dataset,
    effects: Sequence[Effects],
    pictures: Mapping[str, Callable[[Path], None]],
) -> str:
    """The page as one HTML text."""
    results = [one.result for one in effects]
    factors = [factor.name for factor in design.factors]
    deciders = [line for line in map(decider, effects) if line]
    counted = int((members["sentence"].values == "").sum())
    drawn = ", ".join(factors)
    lead = f"{len(design.members)} members, {SAMPLES[design.sample]}, over {drawn}; {counted} have results."
    answer = " ".join([deciders[0] if deciders else "", best(members, results[0], factors), lead]).strip()
    kept = "study.csv, study.nc and effects.csv hold the numbers, members/ the case and the result of each."
    body = [
        text(f"gearbench study · {title}", style="mark"),
        text(span_title(members, results[0]), "h1"),
        text(answer, style="lead"),
        *_figures(members, effects, factors, results, pictures),
        *_others(members, results, deciders),
        *_effects(effects),
        *_failures(members),
        *_members(members, factors, results),
        *_trust(design, effects),
        *_provenance(members),
        text(kept, style="small"),
    ]
    return live_page(f"{title}: study", body)


def _figures(
    members: xr.Dataset,
    effects: Sequence[Effects],
    factors: Sequence[str],
    results: Sequence[str],
    pictures: Mapping[str, Callable[[Path], None]],
) -> list[str]:
    """Tornado, where there are factors to compare, and scatter, live."""
    stills = {name: drawing(draw, name) for name, draw in pictures.items()}
    found = []
    if "tornado" in stills:
        found.append(live_tornado(effects, stills["tornado"], CAPTIONS["tornado"]))
    return [*found, live_scatter(members, factors, results, stills["scatter"], CAPTIONS["scatter"])]


def _others(members: xr.Dataset, results: Sequence[str], deciders: Sequence[str]) -> list[str]:
    lines = [span_line(members, name) for name in results]
    return [text("All results", "h2"), items([*lines, *deciders[1:]])]


def _effects(effects: Sequence[Effects]) -> list[str]:
    if len(effects[0].each) < 2:
        return []
    head = ("result", "factor", "mean at lowest", "mean at highest", "range of the mean", "S", "90 %", "T", "90 %", "r")
    rows = [
        (
            result.result,
            one.factor,
            f"{one.low:.4g}",
            f"{one.high:.4g}",
            f"{one.most - one.least:.3g} {'' if result.unit == '1' else result.unit}".strip(),
            percent(one.first),
            between(one.first_interval),
            percent(one.total),
            between(one.total_interval),
            f"{one.trend:.2f}" if isfinite(one.trend) else "-",
        )
        for result in effects
        for one in sorted(result.each, key=lambda each: -(each.total if isfinite(each.total) else each.first))
    ]
    methods = sorted({f"{one.method} ({one.members} members)" for one in effects})
    return [
        text("Which factor decides", "h2"),
        table(head, rows, numbers=range(2, 10)),
        text(
            "S: part of the variance that the factor decides on its own; T: with its interactions; r: linear"
            f" correlation. Found by: {'; '.join(methods)}.",
            style="small",
        ),
    ]


def _failures(members: xr.Dataset) -> list[str]:
    said = failures(members)
    lines = [f"{count} x {sentence}" if count > 1 else sentence for sentence, count in said[:20]]
    return [text("Members without a result", "h2"), items(lines)] if lines else []


def _members(members: xr.Dataset, factors: Sequence[str], results: Sequence[str]) -> list[str]:
    count = members.sizes["member"]
    rows = [
        [
            str(row),
            *(shown(members[name].values[row]) for name in factors),
            *(_number(members[name].values[row]) for name in results),
            str(members["sentence"].values[row] or members["warnings"].values[row]),
        ]
        for row in range(min(count, MOST_ROWS))
    ]
    head = ["member", *factors, *results, "note"]
    inner = table(head, rows, numbers=range(len(head) - 1))
    more = f" (the first {MOST_ROWS} of {count}; all are in study.csv)" if count > MOST_ROWS else ""
    return [text("Members", "h2"), folded(f"All {count} members{more}", inner) if count > 12 else inner]


def _number(value: float) -> str:
    return f"{value:.5g}" if isfinite(value) else "-"


def _trust(design: Design, effects: Sequence[Effects]) -> list[str]:
    lines = ["Each member is computed as the command for its case alone would: the limits are those of its model."]
    if design.sample == "grid":
        lines.append("A grid says nothing between its levels, and its indices hold for levels that are equally likely.")
    else:
        lines.append("The sample is drawn: another seed gives slightly other numbers; the 90 % intervals say how much.")
    wide = [one for one in effects for each in one.each if each.first_interval[1] - each.first_interval[0] > 0.3]
    if wide:
        lines.append("Some indices are known to no better than 0.3: a larger --size narrows them with its square root.")
    return [text("How far to trust it", "h2"), items(lines)]


def _provenance(members: xr.Dataset) -> list[str]:
    about = json.loads(members.attrs["provenance"])
    rows = [("gearbench", about["version"]), ("sources (SHA-256)", about["sources"][:16])]
    rows += [(name, json.dumps(value)) for name, value in {"seed": about["seed"], **about["settings"]}.items()]
    return [
        text("From what", "h2"),
        table(("", ""), rows, code=(1,)),
        folded("The case", f"<pre>{_escaped(about['case'])}</pre>"),
    ]


def _escaped(words: str) -> str:
    from html import escape

    return escape(words)
