"""Which effects a diagnosis owes: those without which the oracle's held-out gap is at least a tenth larger.

The oracle is the same fit with the true effects: a verdict lists it among its candidates where it was simulated. An
effect of which the candidates tell nothing counts as due, so that a search cannot excuse itself by not looking, unless
the truth rig itself hardly shows it, or the rig of the verdict, which lacks it, leaves hardly more than noise: no
oracle's gap lies below the noise, and none grows by more than the record does when the effect is taken out of the rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt

from gearbench.challenge.answers import Answer
from gearbench.challenge.scoring.intervals import Rate
from gearbench.challenge.scoring.outcomes import Outcome

DUE = 1.1
# What shows between repetitions, not in their mean.
PASSING = ("temperature-drift", "non-synchronous-torque")


def owed(outcome: Outcome) -> tuple[str, ...]:
    """The true effects of a case of the library that are due."""
    if outcome.answer.kind != "effect":
        return ()
    shown = shown_of(outcome.answer)
    true = frozenset(outcome.answer.effects)
    candidates = (outcome.verdict or {}).get("candidates", ())
    gaps = {frozenset(candidate["effects"]): candidate.get("held_out") for candidate in candidates}
    oracle = gaps.get(true)
    left = {name: gaps.get(true - {name}) for name in true}
    closed = _at_the_noise(outcome)
    return tuple(
        name for name in sorted(shown)
        if (oracle is None or (gap := left[name]) is None or gap >= DUE * oracle)
        and (outcome.found(name) or name in PASSING or not closed)
    )  # fmt: skip


def _at_the_noise(outcome: Outcome) -> bool:
    """Whether the rig of a verdict, without what it missed, leaves hardly more of the held-out transmission error than
    noise: no oracle leaves less."""
    sizes = next((one for one in (outcome.verdict or {}).get("gap", ()) if one["channel"] == "dte"), None)
    if sizes is None or not sizes.get("floor"):
        return False
    left = sizes.get("with_effect") or sizes["recalibrated"]
    return float(left[0]) < DUE * float(sizes["floor"][0])


def is_foreign_due(outcome: Outcome) -> bool:
    """Whether a diagnosis owes that something foreign is at work: the record shows it, and it is not recalibrated away
    to the noise."""
    answer = outcome.answer
    passing = any(name in PASSING for name in answer.effects)
    return kind_shown(answer) == "foreign" and (passing or not _at_the_noise(outcome))


def shown_of(answer: Answer) -> frozenset[str]:
    """The effects at work that the truth rig's held-out record shows, those of which that is not known included."""
    return frozenset(name for name in answer.effects if sqrt(1.0 + answer.traces.get(name, inf) ** 2) >= DUE)


def kind_shown(answer: Answer) -> str:
    """What the held-out record shows of an answer's kind: nothing of a foreign effect that changes less than its
    noise."""
    return "none" if answer.kind == "foreign" and not shown_of(answer) else answer.kind


def right_verdict(outcome: Outcome) -> str:
    """Which of the verdicts effect, none and unknown a perfect program is sure of: none, too, of an effect that nobody
    owes and nobody named, and of a foreign one that the record does not show; effect of a foreign one that the library
    has after all, and that was named."""
    answer = outcome.answer
    if answer.kind == "foreign":
        if outcome.result == "right":
            return "effect"
        return "unknown" if is_foreign_due(outcome) else "none"
    hit = any(outcome.told(name) for name in outcome.named)
    return "effect" if hit or owed(outcome) else "none"


def found_of_due(outcomes: Sequence[Outcome]) -> Rate:
    """How many of the effects that are due were named, or a class that holds them."""
    found = total = 0
    for outcome in outcomes:
        for name in owed(outcome):
            total += 1
            found += outcome.found(name)
    return Rate(found, total)


def true_of_named(outcomes: Sequence[Outcome]) -> Rate:
    """How many of the effects named in any case were at work there; one of a class with the true one counts."""
    true = total = 0
    for outcome in outcomes:
        for name in outcome.named:
            total += 1
            true += outcome.told(name)
    return Rate(true, total)


def within_intervals(rows: Sequence[dict[str, object]]) -> Rate:
    """How many of all parameters lay within their stated interval (rows of `parameter_errors`)."""
    rates = [row["within"] for row in rows]
    counts = [(int(rate["count"]), int(rate["total"])) for rate in rates if isinstance(rate, dict)]
    return Rate(sum(count for count, _ in counts), sum(total for _, total in counts))
