"""Which cases a challenge holds: how many of each kind, with which effects and severities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.effects import EFFECTS, FOREIGN, SEVERITY

# Controls, cases with an effect, foreign ones: as many as a scoring by which the diagnosis is judged has.
SHARES = (60, 81, 30)
MOST_CASES = 10_000


@dataclass(frozen=True)
class Mix:
    """Numbers of cases: without effect, with each effect of the library, with foreign effects, with two effects."""

    controls: int
    per_effect: tuple[int, ...]  # in the order of EFFECTS
    foreign: int
    pairs: int = 0

    @property
    def cases(self) -> int:
        """All cases."""
        return self.controls + sum(self.per_effect) + self.foreign + self.pairs


@dataclass(frozen=True)
class Plan:
    """One case to be: its kind, its effects, and the severity of each."""

    kind: str
    effects: tuple[str, ...] = ()
    severity: tuple[float, ...] = ()


def default_mix(cases: int) -> Mix:
    """`cases` cases in SHARES; effects as evenly as that goes."""
    controls, foreign = (round(cases * share / sum(SHARES)) for share in (SHARES[0], SHARES[2]))
    rest = cases - controls - foreign
    each, more = divmod(rest, len(EFFECTS))
    return Mix(controls, tuple(each + (i < more) for i in range(len(EFFECTS))), foreign)


def parse_mix(text: str) -> Mix:
    """The mix in a text such as "controls=12,per-effect=4,foreign=12,pairs=0". Raises ChallengeError."""
    known = {"controls": 0, "per-effect": 0, "foreign": 0, "pairs": 0}
    for item in text.split(","):
        key, _, number = item.strip().partition("=")
        if key not in known:
            raise ChallengeError(f"--mix {text}: {key!r} is unknown; keys are {', '.join(known)}")
        if not number.isdecimal() or int(number) > MOST_CASES:
            raise ChallengeError(f"--mix {text}: {key} = {number!r} must be a whole number from 0 to {MOST_CASES}")
        known[key] = int(number)
    return Mix(known["controls"], (known["per-effect"],) * len(EFFECTS), known["foreign"], known["pairs"])


def make_plan(mix: Mix, rng: np.random.Generator) -> list[Plan]:
    """All cases in a fixed order. Severities of each effect are log-uniform, one from each of as many equal parts of
    the range as there are cases; foreign effects take turns."""
    plans = [Plan("none") for _ in range(mix.controls)]
    for name, count in zip(EFFECTS, mix.per_effect, strict=True):
        plans += [Plan("effect", (name,), (severity,)) for severity in _severities(count, rng)]
    foreign = list(FOREIGN)
    plans += [Plan("foreign", (foreign[i % len(foreign)],), (1.0,)) for i in range(mix.foreign)]
    names = list(EFFECTS)
    for severities in zip(_severities(mix.pairs, rng), _severities(mix.pairs, rng), strict=True):
        one, two = rng.choice(len(names), 2, replace=False)
        plans.append(Plan("effect", (names[one], names[two]), severities))
    return plans


def _severities(count: int, rng: np.random.Generator) -> list[float]:
    low, high = np.log(SEVERITY)
    parts = (rng.permutation(count) + rng.uniform(size=count)) / max(count, 1)
    return [float(value) for value in np.exp(low + (high - low) * parts)]


def counted(plans: list[Plan]) -> Mapping[str, int]:
    """Number of cases of each kind."""
    return {kind: sum(plan.kind == kind for plan in plans) for kind in ("none", "effect", "foreign")}
