"""What signs are worth: probabilities read off truth rigs whose answer was known, none of them a constant.

Two logistic curves (Berkson 1944), each fitted to diagnoses of truth rigs. `effect`: is a candidate at work, given its
log evidence over the number of independent lines, whether the judged record calls for it, and by how much the gap of
some part of that grows without it? And `unknown`: where no effect of the library is at work, is something else, given
the largest sign of it over its limit? Few rigs make flat curves: the weights have a Gaussian prior, and what they leave
open is the interval of a probability.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import log, log1p, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from gearbench.diagnosis.verdict import NINE_OF_TEN, Verdict

Array = NDArray[np.float64]

PER_LINES = 100.0  # evidence is told in nats a hundred independent lines
SMALLEST_SIGN = 1e-2
CONVERGED = {"ftol": 1e-14, "gtol": 1e-9}
# Standard deviations of the weights before any rig was seen: logits that a unit of each sign may be worth. Nearly all
# that a judged record calls for is at work, so that rigs hardly tell what each sign is worth, and what is thought
# before counts: a gap that grows e times as far makes nobody twice as sure.
WIDTHS = {"effect": (4.0, 2.0, 2.0, 0.5), "unknown": (2.0, 2.0)}
# How far the largest value on sound rigs may be exceeded, and the part of the limit before that remains at least: a few
# rigs do not show the largest.
MARGIN, LEAST = 1.25, 0.5


class Chance(NamedTuple):
    """A probability and its 90 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Odds:
    """A logistic curve: weights (n,) of the signs, the first one of 1; their covariance (n, n); number of cases that it
    was fitted to, and how many of them were true."""

    weights: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    cases: int = 0
    true: int = 0

    def of(self, signs: Sequence[float]) -> Chance:
        """The probability at these signs (n,)."""
        x = np.array(signs)
        middle = float(x @ np.array(self.weights))
        reach = NINE_OF_TEN * sqrt(max(float(x @ np.array(self.covariance) @ x), 0.0))
        return Chance(*(float(expit(value)) for value in (middle, middle - reach, middle + reach)))


def nothing_known(widths: Sequence[float]) -> Odds:
    """The curve before any rig was seen."""
    covariance = np.diag(np.square(widths))
    return Odds((0.0,) * len(widths), tuple(map(tuple, covariance.tolist())))


def fitted(prior: Odds, signs: Array, true: Sequence[bool]) -> Odds:
    """The curve after cases with signs (cases, n): the mode that the prior moves to, and its curvature. More of a sign
    never makes less likely what it speaks for: no weight but the first is negative."""
    if not len(true):
        return prior
    centre, precision = np.array(prior.weights), np.linalg.inv(np.array(prior.covariance))
    wanted, x = np.array(true, dtype=float), np.asarray(signs, dtype=float)

    def cost(at: Array) -> tuple[float, Array]:
        logits, away = x @ at, at - centre
        value = float(np.sum(np.logaddexp(0.0, logits) - wanted * logits) + 0.5 * away @ precision @ away)
        return value, x.T @ (expit(logits) - wanted) + precision @ away

    bounds = [(None, None), *[(0.0, None)] * (len(centre) - 1)]
    begin = np.concatenate((centre[:1], np.maximum(centre[1:], 0.0)))
    weights = minimize(cost, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=CONVERGED).x
    p = expit(x @ weights)
    covariance = np.linalg.inv((x * (p * (1.0 - p))[:, None]).T @ x + precision)
    return Odds(
        tuple(weights.tolist()),
        tuple(map(tuple, covariance.tolist())),
        prior.cases + len(true),
        prior.true + int(wanted.sum()),
    )


def effect_signs(evidence: float, lines: float, grows: float | None) -> tuple[float, ...]:
    """Signs of a candidate: nats of evidence over the background, number of independent lines, and of one that the
    judged record calls for the factor by which the gap of some part grows without it (None: it does not)."""
    scaled = PER_LINES * evidence / max(lines, 1.0)
    called = (0.0, 0.0) if grows is None else (1.0, log(max(grows, 1.0)))
    return (1.0, log1p(scaled) if scaled > 0.0 else -log1p(-scaled), *called)


def called_signs(effect: str, evidence: float, grows: float) -> dict[str, float]:
    """The signs of a verdict that keep those of an effect that the judged record calls for, named or too unlikely."""
    return {f"nats {effect}": evidence, f"grows {effect}": grows}


def unknown_signs(sign: float) -> tuple[float, ...]:
    """Signs of something unknown: the largest sign over its limit."""
    return (1.0, log(max(sign, SMALLEST_SIGN)))


@dataclass(frozen=True)
class Calibration:
    """What the decision rests on. `source`: truth rigs around the rig at hand, or a population of other rigs; `rigs`:
    how many; `structure`, `changing`: what sound rigs leave of a channel's fluctuation, and how much of the nominal
    gap changes between repetitions; `outstanding`: by place, factors to what sound rigs leave there."""

    source: Literal["this rig", "population"]
    effect: Odds
    unknown: Odds
    rigs: int
    structure: float
    changing: float
    outstanding: Mapping[str, float] = field(default_factory=dict)

    def probabilities(self, effect: tuple[float, ...], sign: float) -> dict[str, float]:
        """Of effect, none and unknown, with the signs of the best candidate and that of something unknown."""
        at_work = self.effect.of(effect).value
        unknown = (1.0 - at_work) * self.unknown.of(unknown_signs(sign)).value
        return {"effect": at_work, "none": 1.0 - at_work - unknown, "unknown": unknown}


class Known(NamedTuple):
    """A diagnosis of a truth rig: its verdict, and the effects that were at work (kind "effect", "none", "foreign")."""

    verdict: Verdict
    kind: str
    effects: tuple[str, ...]


def calibrated(
    prior: Calibration, known: Sequence[Known], source: Literal["this rig", "population"] = "this rig"
) -> Calibration:
    """A calibration that has also seen these rigs; limits are what the sound ones among them leave, but at least half
    of those before. Verdicts without signs are passed over."""
    told = [one for one in known if one.verdict.signs]
    rows = [row for one in told for row in candidate_rows(one)]
    effect = fitted(prior.effect, np.array([signs for signs, _ in rows]), [true for _, true in rows])
    others = [
        one
        for one in told
        if one.kind != "effect" and one.verdict.verdict != "effects" and "unknown" in one.verdict.signs
    ]
    unknown = fitted(
        prior.unknown,
        np.array([unknown_signs(one.verdict.signs["unknown"]) for one in others]),
        [one.kind == "foreign" for one in others],
    )
    # Records that could not be simulated say nothing of what remains.
    sound = [one.verdict.signs for one in told if one.kind == "none" and "remains" in one.verdict.signs]
    limits = {"structure": prior.structure, "changing": prior.changing}
    outstanding = dict(prior.outstanding)
    if sound:
        seen = {"structure": [_unexplained(one) for one in sound], "changing": [one["changing"] for one in sound]}
        limits = {name: _limit(limits[name], seen[name]) for name in limits}
        places = [key.removeprefix("over ") for key in sound[0] if key.startswith("over ")]
        outstanding = {
            place: _limit(prior.outstanding.get(place, 1.0), [one[f"over {place}"] for one in sound])
            for place in places
        }
    return Calibration(source, effect, unknown, len(told), **limits, outstanding=outstanding)


def _unexplained(signs: Mapping[str, float]) -> float:
    """The largest part of a channel's fluctuation that is left on the judged record, as far as the records of the
    search show it; where they are not told they count as showing all of it."""
    return min(signs["remains"], signs.get("searched", signs["remains"]))


def _limit(before: float, seen: Sequence[float]) -> float:
    return max(LEAST * before, MARGIN * max(seen))


def candidate_rows(one: Known) -> list[tuple[tuple[float, ...], bool]]:
    """Signs of every single candidate of a diagnosis, as its probability is read from them, and whether it was at work,
    or what was and is not named is not told from it."""
    signs, lines = one.verdict.signs, one.verdict.signs["lines"]
    evidence = {the.effects[0]: the.log_evidence for the in one.verdict.candidates if len(the.effects) == 1}
    called = {name.removeprefix("grows "): value for name, value in signs.items() if name.startswith("grows ")}
    evidence |= {name: signs[f"nats {name}"] for name in called}
    return [
        (effect_signs(value, lines, called.get(name)), bool(_alike(one, name) & set(one.effects)))
        for name, value in evidence.items()
    ]


def _alike(one: Known, name: str) -> set[str]:
    """A candidate, and effects that its verdict neither names nor tells from it."""
    classes = [set(members) for members in one.verdict.indistinguishable if name in members]
    return {name, *set().union(*classes).difference(effect.name for effect in one.verdict.effects)}
