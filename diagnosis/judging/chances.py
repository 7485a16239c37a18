"""How likely what was found is at work."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from gearbench.diagnosis.effects.temperature_drift import TEMPERATURE_DRIFT
from gearbench.diagnosis.judging.decided import Decided
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.odds import Calibration, effect_signs
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.words import percent

LIKELY = 0.5  # an effect is named that is more likely at work than not


class Chances(NamedTuple):
    """How likely each named effect is at work, by its hypothesis' name, and the signs of the likeliest candidate."""

    named: dict[str, float]
    best: tuple[float, ...]


def chances_of(
    judged: Judged, decided: Decided, known: Calibration, lines: float, entered: Sequence[Weighed]
) -> Chances:
    """The chances of what was named, and of the best candidate, named or not, that nothing spoke against: of what had
    `entered` and is not named, its size or the judged record did. Evidence is that of the candidates: over the
    background alone, or, where that is more, beside the others that are named."""
    told = {one.hypothesis.effect.name for one in decided.named if one.hypothesis.effect is not None}
    dropped = {one.hypothesis.effect.name for one in entered if one.hypothesis.effect is not None} - told
    alone: dict[str, float] = {}
    for one in judged.found.selection.weighed:
        assert one.hypothesis.effect is not None
        alone.setdefault(one.hypothesis.effect.name, one.log_bayes_factor)
    left = max((evidence for name, evidence in alone.items() if name not in dropped), default=0.0)
    named, all_signs = {}, [effect_signs(left, lines, False, 0.0)]
    for one in decided.named:
        assert one.hypothesis.effect is not None
        share = judged.share(judged.closings[one.hypothesis.name].without)
        evidence = max(alone.get(one.hypothesis.effect.name, -inf), one.log_bayes_factor)
        all_signs.append(effect_signs(evidence, lines, True, share))
        named[one.hypothesis.name] = known.effect.of(all_signs[-1]).value
    if decided.drift is not None:
        all_signs.append(effect_signs(decided.drift.nats, lines, True, decided.drift.share))
        named[TEMPERATURE_DRIFT.name] = known.effect.of(all_signs[-1]).value
    best = max(all_signs[1:] or all_signs, key=lambda signs: known.effect.of(signs).value)
    return Chances(named, best)


def unlikely(decided: Decided, chances: Chances) -> Weighed | None:
    """The least likely of the named effects that are not more likely at work than not; None without any."""
    doubtful = [one for one in decided.named if chances.named[one.hypothesis.name] < LIKELY]
    return min(doubtful, key=lambda one: chances.named[one.hypothesis.name], default=None)


def sentence_of_doubt(one: Weighed, chances: Chances) -> str:
    """Why an effect that closes a part of the gap is not named."""
    assert one.hypothesis.effect is not None
    return (
        f"{one.hypothesis.effect.noun[0].upper()}{one.hypothesis.effect.noun[1:]} would close a part of the gap, but is"
        f" less likely at work than not ({percent(chances.named[one.hypothesis.name])})"
    )
