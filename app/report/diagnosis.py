"""The one-page report of a diagnosis: what is the cause, how sure, where, how far, what next, from what."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.figures.plotting import BLUE, GREEN, ORANGE
from gearbench.report.html import bar, folded, items, page, picture, table, text
from gearbench.words.diagnosis import (
    SHORT_CHANNELS,
    SHOWN_UNITS,
    band_in_words,
    confidence,
    detectable_in_words,
    effects_in_words,
    headline,
    interval,
    meaning,
    number,
    parameter_in_words,
    percent,
    places_in_words,
    sentences,
    value_in_words,
    whole_band,
)

if TYPE_CHECKING:
    from gearbench.diagnosis.verdict import Gap, Verdict

# Hypotheses of the table; the others are counted.
CANDIDATES = 10


@dataclass(frozen=True)
class Source:
    """One record: its name, file, SHA-256, what it was used for and what was said about it at intake."""

    name: str
    file: str
    digest: str
    used: str
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Report:
    """All that the page shows. `pictures`: name -> (draws an SVG or PNG file, caption); `about`: provenance."""

    title: str
    verdict: Verdict
    sources: tuple[Source, ...]
    pictures: Mapping[str, tuple[Callable[[Path], None], str]]
    about: tuple[tuple[str, str], ...]


def report_page(report: Report) -> str:
    """The page as one HTML text."""
    verdict = report.verdict
    body = [
        text(f"gearbench diagnosis · {report.title}", style="mark"),
        text(headline(verdict), "h1"),
        text(confidence(verdict), style="lead"),
        _probability(verdict),
        *_because(verdict),
        *_parameters(verdict),
        *_how_far(report),
        *_by_elements(verdict),
        *_candidates(verdict),
        *_where(report),
        *_limits(report),
        *_provenance(report),
    ]
    return page(f"{report.title}: {headline(verdict)}", body)


def _probability(verdict: Verdict) -> str:
    parts = (
        ("one of the known effects", verdict.probability.effect, BLUE),
        ("no effect", verdict.probability.none, GREEN),
        ("a cause that is not known", verdict.probability.unknown, ORANGE),
    )
    return bar([(name, value, percent(value), colour) for name, value, colour in parts])


def _because(verdict: Verdict) -> list[str]:
    return [text("Why, and what remains", "h2"), items(sentences(verdict))] if verdict.because else []


def _parameters(verdict: Verdict) -> list[str]:
    rows = [
        (
            effects_in_words([effect.name]),
            percent(effect.probability),
            parameter_in_words(effect.name, name),
            *value_in_words(parameter),
        )
        for effect in verdict.effects
        for name, parameter in effect.parameters.items()
    ]
    if not rows:
        return []
    return [
        text("What is found", "h2"),
        table(("effect", "probability", "parameter", "value ± std", "unit"), rows, numbers=(1, 3)),
        *(text(meaning(effect.name)) for effect in verdict.effects if meaning(effect.name)),
    ]


def _how_far(report: Report) -> list[str]:
    gaps = report.verdict.gap
    if not gaps:
        return []
    record = gaps[0].record
    where = (
        f"Rms of measured minus simulated on record {record}, which was held out of the search"
        if report.verdict.held_out
        else f"Rms of measured minus simulated on record {record}, which had part in the search: the rig was fitted to"
        " it, and the gap on another one would be larger"
    )
    main = [gap for gap in gaps if gap in whole_band(gaps) or gap.channel == gaps[0].channel]
    rest = len(gaps) - len(main)
    return [
        text("How far the gap shrinks", "h2"),
        text(f"{where}. In brackets: the range in which nine of ten repeated measurements would fall."),
        *_pictures(report, ("waterfall", "gap", "traces")),
        _gap_table(main),
        folded("All channels and bands", _gap_table(gaps)) if rest else "",
    ]


def _by_elements(verdict: Verdict) -> list[str]:
    told = verdict.confirmed
    if told is None:
        return []
    rows = [
        (
            effects_in_words([one.name]),
            "confirmed" if one.confirmed else "not confirmed",
            f"{number(one.growth, 2)} times",
            ", ".join(f"{parameter_in_words(one.name, name)} {' '.join(value_in_words(parameter)).strip()}"
                      for name, parameter in one.parameters.items()) or "–",
        )
        for one in told.effects
    ]  # fmt: skip
    head = ("effect", "by finite elements", "gap without it, where most", "as fitted there")
    return [
        text("What finite elements say", "h2"),
        text(
            "The same rigs on the reduced finite-element model, each fitted again by it on the records of the search;"
            " rms of measured minus simulated on the judged record."
        ),
        _gap_table([gap for gap in told.gap if gap in whole_band(told.gap)]) if told.gap else "",
        table(head, rows) if rows else "",
        items([]) if told.gap else items([f"{one[:1].upper()}{one[1:]}." for one in told.because]),
    ]


def _gap_table(gaps: Sequence[Gap]) -> str:
    rows = []
    for before, gap in zip((None, *gaps), gaps, strict=False):
        unit = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))[1]
        again = before is not None and before.channel == gap.channel
        name = "" if again else f"{SHORT_CHANNELS.get(gap.channel, gap.channel)} [{unit}]"
        stages = (gap.nominal, gap.recalibrated, gap.with_effect, gap.floor)
        rows.append((name, band_in_words(gap.band_hz), *(interval(stage, gap.unit) for stage in stages)))
    head = ("channel", "band", "nominal rig", "recalibrated", "with the effect", "noise floor")
    return table(head, rows, numbers=(2, 3, 4, 5))


def _candidates(verdict: Verdict) -> list[str]:
    if not verdict.candidates:
        return []
    ranked = sorted(verdict.candidates, key=lambda one: -one.log_evidence)
    best = ranked[0].log_evidence
    chosen = {effect.name for effect in verdict.effects}
    judged = any(one.held_out is not None for one in ranked)
    rows, bold = [], None
    for place, one in enumerate(ranked[:CANDIDATES]):
        if set(one.effects) == chosen and (chosen or verdict.verdict == "none") and bold is None:
            bold = place
        held_out = () if not judged else ("–" if one.held_out is None else percent(one.held_out),)
        rows.append((effects_in_words(one.effects), number(one.log_evidence - best), *held_out))
    more = len(ranked) - len(rows)
    return [
        text("Which causes were weighed", "h2"),
        text(
            "Each cause against the best one, by log evidence: the natural logarithm of how much less likely the"
            " records are if it is the cause (-3: one in twenty), whatever its size. In bold: the verdict."
            + (" Beside it, the part of the held-out transmission error that each leaves." if judged else "")
        ),
        table(("cause", "log evidence", *(("left on held-out",) if judged else ())), rows, numbers=(1, 2), best=bold),
        text(f"{more} less likely ones are left out.", style="small") if more else "",
    ]


def _where(report: Report) -> list[str]:
    if not report.verdict.where:
        return []
    words = places_in_words(report.verdict)
    return [
        text("Where the gap is", "h2"),
        text(
            f"{words}Below, the gap of the nominal rig (by place: what recalibration does not close of it) is divided"
            " in several ways; each adds up to 100 %. The marks"
            " show how much of a part measurement noise and the uncertainty of the nominal rig could make: where a mark"
            " lies beyond its bar, the size of that part alone is no sign of an effect."
        ),
        *_pictures(report, ("where",)),
    ]


def _limits(report: Report) -> list[str]:
    verdict = report.verdict
    same = [f"{' / '.join(effects_in_words([name]) for name in group)}" for group in verdict.indistinguishable]
    losses = [f"{source.name}: {warning}" for source in report.sources for warning in source.warnings]
    return [
        text("What these records cannot tell", "h2"),
        text(
            "These causes would leave the same traces in the records:"
            if same
            else "Each effect of the library would leave traces of its own; where one could be in either of two parts,"
            " the reasons above say so."
        ),
        items(same),
        *_smallest(verdict),
        text("What the records lack:") if losses else "",
        items(losses),
        *([text("What to measure next", "h2"), items(verdict.advice)] if verdict.advice else []),
    ]


def _smallest(verdict: Verdict) -> list[str]:
    """From which size on the effects that are not named would have been."""
    rows = [
        (one.effect, one.told, "at no size" if one.found is None else number(one.found), number(one.good))
        for one in detectable_in_words(verdict)
    ]
    if not rows:
        return []
    return [
        text(
            "An effect that is not named may still be at work, smaller than these records would have named it. As much"
            " as a good rig has is not named, however well it shows. Sizes of each effect alone:"
        ),
        table(("effect", "size told by", "named from", "good rig"), rows, numbers=(2, 3)),
    ]


def _provenance(report: Report) -> list[str]:
    rows = [(source.name, source.used, source.file, source.digest[:16]) for source in report.sources]
    return [
        text("From what this was made", "h2"),
        table(("record", "used for", "file", "SHA-256"), rows, code=(2, 3)),
        table(("", ""), report.about, code=(1,)),
    ]


def _pictures(report: Report, names: Sequence[str]) -> list[str]:
    held = [(name, *report.pictures[name]) for name in names if name in report.pictures]
    return [picture(draw, name, caption) for name, draw, caption in held]
