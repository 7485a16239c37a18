"""How likely what was found is at work."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import log
from typing import NamedTuple

import numpy as np

from gearbench.diagnosis.account import which
from gearbench.diagnosis.effects.temperature_drift import TEMPERATURE_DRIFT
from gearbench.diagnosis.judging.decided import Decided
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.odds import Calibration, called_signs, effect_signs
from gearbench.diagnosis.selection.selection import evidence_without
from gearbench.diagnosis.selection.weighing import Weighed, best_evidence, has_own
from gearbench.diagnosis.words import percent

LIKELY = 2 / 3  # an effect is named that is twice as likely at work as not: to blame one costs more than to miss one


class Called(NamedTuple):
    """An effect that the judged record calls for: nats of evidence, and the factor by which the gap of some part grows
    without it."""

    effect: str
    nats: float
    grows: float


class Chances(NamedTuple):
    """How likely each named effect is at work, and what speaks for it, by its hypothesis' name ("temperature-drift"
    that of a drift), and the signs of the likeliest candidate."""

    named: dict[str, float]
    called: dict[str, Called]
    best: tuple[float, ...]


def signs_of_called(chances: Chances, names: Iterable[str]) -> dict[str, float]:
    """What speaks for hypotheses that the judged record calls for, of an effect in the place where it is likeliest, as
    a verdict keeps it for a calibration to learn from."""
    signs: dict[str, float] = {}
    for name in sorted(names, key=chances.named.__getitem__):
        signs |= called_signs(*chances.called[name])
    return signs


def chances_of(
    judged: Judged, decided: Decided, known: Calibration, lines: float, entered: Sequence[Weighed]
) -> Chances:
    """The chances of what was named, and of the best candidate, named or not, that nothing spoke against: of what had
    `entered` and is not named, its size or the judged record did. Evidence is that of the candidates: over the
    background alone, or, where that is more, beside the others that are named, but no more than over the rig that was
    fitted without it; of a number of the nominal rig, over a rig with it where its uncertainty ends; of a usual cause
    also what its rare counterparts have beyond it."""
    weighed = judged.found.selection.weighed
    evidence = best_evidence(weighed, decided.named)
    called = {}
    for one in decided.named:
        nats = _nats(judged, one, evidence[one.effect.name]) + _of_class(one, weighed)
        called[one.hypothesis.name] = Called(one.effect.name, nats, judged.closings[one.hypothesis.name].growth)
    if decided.drift is not None:
        name = TEMPERATURE_DRIFT.name
        called[name] = Called(name, decided.drift.nats, decided.drift.grows)
    signs = {name: effect_signs(one.nats, lines, one.grows) for name, one in called.items()}
    named = {name: known.effect.of(its).value for name, its in signs.items()}
    if signs:
        return Chances(named, called, signs[max(named, key=named.__getitem__)])
    refused = {one.effect.name for one in entered}
    left = max((value for name, value in evidence.items() if name not in refused), default=0.0)
    return Chances(named, called, effect_signs(left, lines, None))


def _nats(judged: Judged, one: Weighed, worth: float) -> float:
    """Nats by which the records of the search call for a named effect: what it was `worth`, but no more than over the
    rig that was fitted without any of it, beside held backgrounds of all others, as slopes may promise too much; a
    number of the nominal rig over that with it where its uncertainty ends, whose prior recalibration would pay, if that
    is more."""
    without = judged.closings[one.hypothesis.name].optimum
    if without is None:
        return worth
    unknowns, selection = judged.found.layout.unknowns, judged.found.selection
    held = evidence_without(unknowns, selection, one, without)
    fitted = float(selection.best.evidence - held - log(one.hypothesis.choices))
    return min(worth, fitted) if has_own(unknowns, one.hypothesis) else max(worth, fitted)


def _of_class(one: Weighed, weighed: Sequence[Weighed]) -> float:
    """Nats that the records have beyond a named effect for it or its rare counterparts, which explain them as well: its
    name stands for them all."""
    alone = {other.hypothesis.name: other.log_bayes_factor for other in weighed}
    own = alone.get(one.hypothesis.name)
    rare = [alone[other.name] for other in one.rivals if other.name in alone and other.gives_way_to(one.hypothesis)]
    return 0.0 if own is None else float(np.logaddexp.reduce([0.0, *(value - own for value in rare)]))


def unlikely(decided: Decided, chances: Chances) -> Weighed | None:
    """The least likely of the named effects that are not twice as likely at work as not; None without any."""
    doubtful = [one for one in decided.named if chances.named[one.hypothesis.name] < LIKELY]
    return min(doubtful, key=lambda one: chances.named[one.hypothesis.name], default=None)


def sentence_of_doubt(one: Weighed, chances: Chances) -> str:
    """Why an effect that closes a part of the gap is not named."""
    noun = one.effect.noun
    return (
        f"{noun[0].upper()}{noun[1:]} would close a part of the gap, but is"
        f" not twice as likely at work as not ({percent(chances.named[one.hypothesis.name])})"
    )


def sentence_of_size(one: Weighed) -> str:
    """Why an effect that is smaller than the records tell is not named."""
    noun = one.effect.noun
    return (
        f"{noun[0].upper()}{noun[1:]} would close a small part of the gap, but is smaller than these records would"
        " tell, so that something like it may be at work"
    )


def sentence_of_astray(one: Weighed) -> str:
    """Why an effect is not named with which the rig is further from the judged record than without any."""
    noun = which(one.hypothesis)
    return f"The records of the search speak for {noun}, but the rig without it is far closer to the judged record"
