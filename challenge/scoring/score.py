"""The score of a diagnosis on a challenge: rates with binomial intervals, calibration, errors, shrinkage, reach."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from math import log
from typing import Any

import numpy as np

from gearbench.challenge.scoring.due import (
    found_of_due,
    is_foreign_due,
    right_verdict,
    true_of_named,
    within_intervals,
)
from gearbench.challenge.scoring.intervals import (
    COVERAGE,
    Rate,
    brier,
    calibration_error,
    error_by_chance,
    middle,
    reliability,
)
from gearbench.challenge.scoring.outcomes import VERDICTS, Outcome, said
from gearbench.challenge.scoring.reach import reach_table
from gearbench.challenge.scoring.smallest import smallest_table
from gearbench.challenge.truth.effects import EFFECTS, SEVERITY
from gearbench.rig.contract import rank_of

EFFECT_RESULTS = ("right", "class", "part", "wrong", "missed", "refused", "failed")
CONTROL_RESULTS = ("right", "named", "flagged", "failed")
FOREIGN_RESULTS = ("refused", "right", "blamed", "missed", "failed")
THIRDS = ("light", "medium", "severe")

Table = dict[str, Any]


def score(outcomes: Sequence[Outcome]) -> Table:
    """All figures of a challenge as plain numbers, ready for JSON."""
    effects = [o for o in outcomes if o.answer.kind == "effect"]
    controls = [o for o in outcomes if o.answer.kind == "none"]
    foreign = [o for o in outcomes if o.answer.kind == "foreign"]
    table: Table = {
        "cases": {"effect": len(effects), "none": len(controls), "foreign": len(foreign)},
        "coverage": COVERAGE,
        "effect": {**_rates(effects, EFFECT_RESULTS), "place_right": _place(effects).plain()},
        "none": {**_rates(controls, CONTROL_RESULTS), "place_right": _place(controls).plain()},
        "foreign": {
            **_rates(foreign, FOREIGN_RESULTS),
            "place_right": _place(foreign).plain(),
            "refused_at_right_place": _rate(
                [o for o in foreign if is_foreign_due(o)], lambda o: o.result in ("refused", "right") and o.place_right
            ).plain(),
        },
        "by_effect": {name: _effect_rows(name, group) for name, group in grouped([*effects, *foreign]).items()},
        "by_severity": _by_third([o for o in effects if len(o.answer.effects) == 1]),
        "confusion": _confusion(outcomes),
        "calibration": _calibration(outcomes),
        "parameters": parameter_errors(effects),
        "shrinkage": shrinkage(effects),
    }
    table["several"] = _several([o for o in effects if len(o.answer.effects) > 1])
    table["due"] = {
        "found": found_of_due(effects).plain(),
        "true": true_of_named(outcomes).plain(),
        "within": within_intervals(table["parameters"]).plain(),
    }
    table["smallest"] = smallest_table(outcomes)
    table["reach"] = reach_table(table)
    return table


def grouped(outcomes: Sequence[Outcome]) -> dict[str, list[Outcome]]:
    """Outcomes by what was at work: the library's effects first, in their order; several by their number."""
    groups: dict[str, list[Outcome]] = {}
    for outcome in sorted(outcomes, key=lambda o: (len(o.answer.effects), rank_of(o.answer.effects[0]))):
        effects = outcome.answer.effects
        groups.setdefault(effects[0] if len(effects) == 1 else f"{len(effects)} effects", []).append(outcome)
    return groups


def _several(outcomes: Sequence[Outcome]) -> Table:
    """Of cases with several effects: how many of the effects were named, and how many of the names were true."""
    at_work = [outcome.found(effect) for outcome in outcomes for effect in outcome.answer.effects]
    named = [outcome.told(name) for outcome in outcomes for name in outcome.named]
    return {
        "cases": len(outcomes),
        "found": Rate(sum(at_work), len(at_work)).plain(),
        "true": Rate(sum(named), len(named)).plain(),
    }


def _rate(outcomes: Sequence[Outcome], holds: Callable[[Outcome], bool]) -> Rate:
    return Rate(sum(holds(outcome) for outcome in outcomes), len(outcomes))


def _place(outcomes: Sequence[Outcome]) -> Rate:
    return _rate(outcomes, lambda o: o.place_right)


def _rates(outcomes: Sequence[Outcome], results: Sequence[str]) -> Table:
    counts = Counter(outcome.result for outcome in outcomes)
    return {result: Rate(counts[result], len(outcomes)).plain() for result in results}


def _effect_rows(name: str, outcomes: Sequence[Outcome]) -> Table:
    results = EFFECT_RESULTS if outcomes[0].answer.kind == "effect" else FOREIGN_RESULTS
    rows: Table = {**_rates(outcomes, results), "place_right": _place(outcomes).plain()}
    if name in EFFECTS:
        rows["by_severity"] = _by_third(outcomes)
    return rows


def third_of(severity: float) -> str:
    """Third of the range of severities, in equal parts of its logarithm."""
    low, high = (log(value) for value in SEVERITY)
    part = (log(severity) - low) / (high - low)
    return THIRDS[min(max(int(3 * part), 0), 2)]


def _by_third(outcomes: Sequence[Outcome]) -> Table:
    known = [o for o in outcomes if o.answer.severity]
    groups = {name: [o for o in known if third_of(next(iter(o.answer.severity.values()))) == name] for name in THIRDS}
    good = ("right", "wrong", "missed", "refused", "blamed")
    return {name: {**_rates(group, good), "place_right": _place(group).plain()} for name, group in groups.items()}


def _confusion(outcomes: Sequence[Outcome]) -> Table:
    """How often which truth was given which name."""
    table: dict[str, dict[str, int]] = {}
    for outcome in outcomes:
        true = "+".join(outcome.answer.effects) or "none"
        name = "failed"
        if outcome.verdict is not None:
            name = "+".join(sorted(outcome.named)) or said(outcome.verdict)
        row = table.setdefault(true, {})
        row[name] = row.get(name, 0) + 1
    return table


def _calibration(outcomes: Sequence[Outcome]) -> Table:
    """Brier score over effect, none and unknown, and how often a stated probability came true: of the verdict
    (whether it is the right one of the three) and of the named effect; and what chance alone makes of that."""
    given = [o for o in outcomes if o.verdict is not None]
    stated = [[float(o.verdict["probability"][key]) for key in VERDICTS] for o in given if o.verdict is not None]
    truth = [VERDICTS.index(right_verdict(o)) for o in given]
    told = [VERDICTS.index(said(o.verdict)) for o in given if o.verdict is not None]
    named: list[tuple[float, bool]] = []
    for outcome in given:
        assert outcome.verdict is not None
        for effect in outcome.verdict.get("effects", ()):
            named.append((float(effect["probability"]), outcome.told(effect["name"])))
    chosen = [p[i] for p, i in zip(stated, told, strict=True)]
    verdict = reliability(chosen, [a == b for a, b in zip(told, truth, strict=True)])
    effect = reliability([p for p, _ in named], [hit for _, hit in named])
    return {
        "brier": brier(stated, truth),
        "verdict": verdict,
        "effect": effect,
        "error": {"verdict": calibration_error(verdict), "effect": calibration_error(effect)},
        "error_by_chance": {
            "verdict": error_by_chance(chosen).plain(),
            "effect": error_by_chance([p for p, _ in named]).plain(),
        },
        "of_verdicts": {"median": calibration_error(verdict), "low": None, "high": None, "total": len(given)},
    }


def parameter_errors(outcomes: Sequence[Outcome]) -> list[Table]:
    """Errors of the parameters of rightly named effects that the verdict gives in the answer's unit: per effect and
    name the number, bias, rms and median magnitude, the last also relative, and how often the truth lies within the
    stated 90 % interval."""
    found: dict[tuple[str, str, str], list[tuple[float, float, float, float]]] = {}
    for outcome in outcomes:
        if outcome.result not in ("right", "part") or outcome.verdict is None:
            continue
        for effect in outcome.verdict["effects"]:
            true = outcome.answer.parameters.get(effect["name"], {})
            for name, given in effect.get("parameters", {}).items():
                if name in true and true[name]["unit"] == given["unit"]:
                    key = (effect["name"], name, str(given["unit"]))
                    found.setdefault(key, []).append((given["value"], *_interval(given), true[name]["value"]))
    rows = []
    for (effect_name, name, unit), values in found.items():
        value, low, high, true_value = np.array(values, dtype=float).T
        error = value - true_value
        relative = np.abs(error[true_value != 0] / true_value[true_value != 0])
        rows.append(
            {
                "effect": effect_name,
                "parameter": name,
                "unit": unit,
                "cases": len(values),
                "bias": float(error.mean()),
                "rms": float(np.sqrt(np.mean(error**2))),
                "median": float(np.median(np.abs(error))),
                "median_relative": float(np.median(relative)) if relative.size else None,
                "within": Rate(int(((low <= true_value) & (true_value <= high)).sum()), len(values)).plain(),
            }
        )
    return rows


def _interval(given: Mapping[str, Any]) -> tuple[float, float]:
    """The 90 % interval of a parameter; version 1 gives a standard deviation."""
    if "std" in given:
        reach = 1.645 * float(given["std"])
        return float(given["value"]) - reach, float(given["value"]) + reach
    return float(given["low"]), float(given["high"])


def shrinkage(outcomes: Sequence[Outcome]) -> Table:
    """How far the held-out gap shrinks on cases with an effect.

    `oracle`: the verdict's held-out gap over that of its candidate with the true effects, where both are listed.
    `with_effect`, `recalibrated`, `floor`: each over the nominal gap, the geometric mean over channels and bands of
    the held-out record, one number a case.
    """
    ratios = [ratio for o in outcomes if (ratio := _oracle_ratio(o)) is not None]
    parts: dict[str, list[float]] = {"recalibrated": [], "with_effect": [], "floor": []}
    for outcome in outcomes:
        for key, values in parts.items():
            part = _gap_part(outcome.verdict, key)
            if part is not None:
                values.append(part)
    within = Rate(sum(ratio <= 1.5 for ratio in ratios), len(ratios))
    return {
        "oracle": middle(ratios).plain(),
        "oracle_within_1.5": within.plain(),
        "oracle_not_listed": len(outcomes) - len(ratios),
        **{key: middle(values).plain() for key, values in parts.items()},
    }


def _oracle_ratio(outcome: Outcome) -> float | None:
    if outcome.verdict is None:
        return None
    candidates = outcome.verdict.get("candidates", ())
    listed = {frozenset(candidate["effects"]): candidate.get("held_out") for candidate in candidates}
    oracle = listed.get(frozenset(outcome.answer.effects))
    chosen = listed.get(frozenset(outcome.named))
    return float(chosen) / float(oracle) if chosen is not None and oracle else None


def _gap_part(verdict: Mapping[str, Any] | None, key: str) -> float | None:
    """Geometric mean of gap[key] / nominal over the rows of the held-out record."""
    if verdict is None:
        return None
    logs = []
    for row in verdict.get("gap", ()):
        given, nominal = row.get(key), row["nominal"]
        if row["record"] == verdict.get("held_out") and given and given[0] > 0 and nominal[0] > 0:
            logs.append(log(given[0] / nominal[0]))
    return float(np.exp(np.mean(logs))) if logs else None
