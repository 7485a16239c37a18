"""What explains the records as well as the hypothesis that is ahead: its rivals, and which of them all is named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.evidence.separable import APART

if TYPE_CHECKING:
    from gearbench.diagnosis.output.selection import Weighed

MOST_LEFT = 6.0  # nats still promised by fits that count for comparing them


def usual_of(weighed: Sequence[Weighed]) -> Weighed | None:
    """The best of those weighed; in place of a rare one the best usual one that explains the records as well, as far as
    fits tell that still promise something. None of none."""
    if not weighed:
        return None
    best = weighed[0]
    if not best.hypothesis.rare:
        return best
    return next((one for one in weighed if not one.hypothesis.rare and _as_good(one, best, _left(one, best))), best)


def rivals_of(winner: Weighed, weighed: Sequence[Weighed]) -> tuple[Hypothesis, ...]:
    """Those of the hypotheses weighed beside the winner that explain the records as well, by other unknowns, and are
    another cause to look for."""
    return tuple(one.hypothesis for one in weighed if _as_good(one, winner))


def _as_good(one: Weighed, winner: Weighed, less: float = 0.0) -> bool:
    """Whether one explains the records as another cause does, or worse by no more than `less` nats."""
    return (
        one.optimum is not None
        and one.log_bayes_factor > winner.log_bayes_factor - APART - less
        and not is_same(one.hypothesis, winner.hypothesis)
        and not _same_cause(one.hypothesis, winner.hypothesis)
    )


def _left(*weighed: Weighed) -> float:
    """The most that any of their fits still promises [nats]."""
    return min(max((one.optimum.left for one in weighed if one.optimum), default=0.0), MOST_LEFT)


def is_same(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses move the same unknowns."""
    return any(a.key == b.key and (a.at is None or b.at is None or a.at == b.at) for a in one.wide for b in other.wide)


def _same_cause(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses are an effect in the same part, by other unknowns: not one tooth or another."""
    whole = all(wide.at is None for wide in (*one.wide, *other.wide))
    return whole and one.effect == other.effect and one.on == other.on
