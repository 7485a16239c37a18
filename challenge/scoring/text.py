"""The score as text for a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gearbench.challenge.scoring.score import CONTROL_RESULTS, EFFECT_RESULTS, FOREIGN_RESULTS

Table = Mapping[str, Any]

WORDS = {
    "right": "right",
    "class": "right class",
    "part": "some of several",
    "wrong": "wrong cause",
    "missed": "missed",
    "refused": "refused as unknown",
    "failed": "failed",
    "named": "false alarm, named",
    "flagged": "false alarm, flagged",
    "blamed": "blamed on an effect",
    "place_right": "place right",
    "refused_at_right_place": "place right, no blame",
}
# Results that are told only where there are any.
RARE = ("class", "part", "failed")


def score_text(score: Table) -> str:
    """All tables of a score, a line each row."""
    parts = [_kinds(score), _due(score["due"], score["several"]), _by_effect(score), _by_severity(score)]
    parts += [_calibration(score), _parameters(score["parameters"]), _shrinkage(score["shrinkage"])]
    parts += [_smallest(score["smallest"]), _reach(score)]
    return "\n\n".join(part for part in parts if part)


def rate_text(rate: Table) -> str:
    """`7 of 9, 78 % (45-96)`."""
    if not rate["total"]:
        return "no cases"
    return (
        f"{rate['count']} of {rate['total']}, {100 * rate['share']:.0f} %"
        f" ({100 * rate['low']:.0f}-{100 * rate['high']:.0f})"
    )


def _kinds(score: Table) -> str:
    lines = [f"Counts, shares and their {100 * score['coverage']:.0f} % binomial intervals"]
    for kind, title, results in (
        ("effect", "with an effect of the library", (*EFFECT_RESULTS, "place_right")),
        ("none", "without effect", CONTROL_RESULTS),
        ("foreign", "with an effect that the library lacks", (*FOREIGN_RESULTS, "refused_at_right_place")),
    ):
        if score["cases"][kind]:
            lines.append(f"  {score['cases'][kind]} cases {title}")
            lines += [
                f"    {WORDS[result]:22} {rate_text(score[kind][result])}"
                for result in results
                if score[kind][result]["count"] or not (result in RARE or (kind, result) == ("foreign", "right"))
            ]
    return "\n".join(lines)


def _due(due: Table, several: Table) -> str:
    lines = ["Of the effects at work, those without which the oracle's held-out gap is a tenth larger are due"]
    for key, words in (("found", "due effects found"), ("true", "named effects true")):
        lines.append(f"  {words:24} {rate_text(due[key])}")
    if several["cases"]:
        lines.append(f"Of {several['cases']} cases with several effects")
        for key, words in (("found", "effects found"), ("true", "named effects true")):
            lines.append(f"  {words:24} {rate_text(several[key])}")
    return "\n".join(lines)


def _by_effect(score: Table) -> str:
    lines = [f"{'effect':24}{'right':28}{'wrong':>6}{'missed':>8}{'refused':>9}{'place':>7}"]
    for name, rows in score["by_effect"].items():
        good, worst = ("right", "wrong") if "wrong" in rows else ("refused", "blamed")
        bad = rows[worst]["count"]
        place = rows["place_right"]["count"]
        right = rate_text(rows[good]) + ("" if good == "right" else " refused")
        lines.append(
            f"{name or 'none':24}{right:28}{bad:>6}{rows['missed']['count']:>8}{rows['refused']['count']:>9}{place:>7}"
        )
    return "\n".join(lines) if len(lines) > 1 else ""


def _by_severity(score: Table) -> str:
    lines = ["Right by third of the severities' range"]
    for third, rows in score["by_severity"].items():
        lines.append(f"  {third:10} {rate_text(rows['right']):26} place {rate_text(rows['place_right'])}")
    for name, rows in score["by_effect"].items():
        thirds = rows.get("by_severity", {})
        told = [
            f"{third} {row['right']['count']} of {row['right']['total']}"
            for third, row in thirds.items()
            if row["right"]["total"]
        ]
        if told and "wrong" in rows:
            lines.append(f"    {name:22} {', '.join(told)}")
    return "\n".join(lines)


def _calibration(score: Table) -> str:
    calibration = score["calibration"]
    if calibration["brier"] is None:
        return ""
    lines = [f"Brier score of effect, none, unknown: {calibration['brier']:.3f} (0 is perfect)"]
    for key, title in (("verdict", "verdict"), ("effect", "named effect")):
        lines += [
            f"  {title}: stated {row['from']:.2f}-{row['to']:.2f}, mean {row['stated']:.2f}: true {rate_text(row)}"
            for row in calibration[key]
        ]
        error = calibration.get("error", {}).get(key)
        if error is not None:
            chance = calibration["error_by_chance"][key]
            lines.append(
                f"  {title}: calibration error {error:.2f}, where probabilities that all hold come out "
                f"{chance['median']:.2f} ({chance['low']:.2f}-{chance['high']:.2f}) off by chance"
            )
    return "\n".join(lines)


def _parameters(rows: Sequence[Table]) -> str:
    if not rows:
        return ""
    lines = ["Errors of the parameters of rightly named effects"]
    for row in rows:
        relative = "" if row["median_relative"] is None else f", median {100 * row['median_relative']:.0f} %"
        lines.append(
            f"  {row['effect']} {row['parameter']}: rms {row['rms']:.3g} {row['unit']}, bias {row['bias']:.3g}"
            f"{relative}; within the stated 90 %: {rate_text(row['within'])}"
        )
    return "\n".join(lines)


def _shrinkage(shrinkage: Table) -> str:
    lines = ["Held-out gap on cases with an effect (medians, 90 % intervals)"]
    for key, words in (
        ("recalibrated", "recalibrated over nominal"),
        ("with_effect", "with effect over nominal"),
        ("floor", "floor over nominal"),
        ("oracle", "verdict over oracle fit"),
    ):
        row = shrinkage[key]
        if row["total"]:
            ends = "" if row["low"] is None else f" ({row['low']:.2f}-{row['high']:.2f})"
            lines.append(f"  {words}: {row['median']:.2f}{ends}, {row['total']} cases")
    if shrinkage["oracle"]["total"]:
        lines.append(f"  within 1.5 x of the oracle fit: {rate_text(shrinkage['oracle_within_1.5'])}")
    if shrinkage["oracle_not_listed"]:
        lines.append(f"  without the true effect among the candidates: {shrinkage['oracle_not_listed']} cases")
    return "\n".join(lines) if len(lines) > 1 else ""


def _smallest(table: Table) -> str:
    lines = ["Missed effects beside the smallest that their records would have named, as the verdicts tell it"]
    for row in table["missed"]:
        words = f"  {row['case'][:8]} {row['effect']}{'' if row['due'] else ' (not due)'}"
        if row["parameter"] is None:
            lines.append(f"{words}: not told")
            continue
        limit = "at no size" if row["smallest"] is None else f"from {row['smallest']:.3g}"
        lines.append(
            f"{words}: {row['parameter']} {row['true']:.3g} {row['unit']}, named {limit}; good rig {row['good']:.2g},"
            f" standard deviation at least {row['std']:.2g}"
        )
    if table["told"]:
        lines.append(
            f"  of {table['told']} missed {table['small']} are smaller, {table['hidden']} no larger than the records'"
            " own uncertainty"
        )
    if table["named"]:
        lines.append(f"  of {table['named']} named {table['named_small']} are smaller")
    return "\n".join(lines) if len(lines) > 1 else ""


def _reach(score: Table) -> str:
    lines = ["Reach (met: also at the unfavourable end of the 90 % interval)"]
    for row in score["reach"]:
        value = "no cases" if row["value"] is None else f"{row['value']:.2f}"
        if row["value"] is not None and row["low"] is not None:
            value += f" ({row['low']:.2f}-{row['high']:.2f})"
        lines.append(f"  {row['what']:45} {row['limit']:14} {value:20} {row['status']}")
    return "\n".join(lines)
