"""Which cases a challenge holds: how many of each kind, with which effects and severities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.effects import EFFECTS, FOREIGN, SEVERITY
from gearbench.challenge.truth.elastic import REPRESENTED

# Controls, cases with an effect, foreign ones: as many as a scoring by which the diagnosis is judged has.
SHARES = (60, 81, 30)
MOST_CASES = 10_000
SEVERAL = 0.1  # part of the cases with an effect that have two or three
KEYS = ("controls", "per-effect", "foreign", "pairs", "triples", "reduced")


@dataclass(frozen=True)
class Mix:
    """Numbers of cases: without effect, with each effect of the library, with foreign effects, with two effects, with
    three, and of rigs by finite elements, without an effect and with one in turn."""

    controls: int
    per_effect: tuple[int, ...]  # in the order of EFFECTS
    foreign: int
    pairs: int = 0
    triples: int = 0
    reduced: int = 0

    @property
    def cases(self) -> int:
        """All cases."""
        return self.controls + sum(self.per_effect) + self.foreign + self.pairs + self.triples + self.reduced


@dataclass(frozen=True)
class Plan:
    """One case to be: its kind, its effects, the severity of each, and whether the rig is one of finite elements."""

    kind: str
    effects: tuple[str, ...] = ()
    severity: tuple[float, ...] = ()
    elastic: bool = False


def default_mix(cases: int) -> Mix:
    """`cases` cases in SHARES; a tenth of those with an effect have several, of which every third has three; single
    effects as evenly as that goes."""
    controls, foreign = (round(cases * share / sum(SHARES)) for share in (SHARES[0], SHARES[2]))
    rest = cases - controls - foreign
    several = round(SEVERAL * rest)
    triples = several // 3
    each, more = divmod(rest - several, len(EFFECTS))
    single = tuple(each + (i < more) for i in range(len(EFFECTS)))
    return Mix(controls, single, foreign, several - triples, triples)


def parse_mix(text: str) -> Mix:
    """The mix in a text such as "controls=12,per-effect=4,foreign=12,pairs=2,triples=1,reduced=4". Raises
    ChallengeError."""
    known = dict.fromkeys(KEYS, 0)
    for item in text.split(","):
        key, _, number = item.strip().partition("=")
        if key not in known:
            raise ChallengeError(f"--mix {text}: {key!r} is unknown; keys are {', '.join(known)}")
        if not number.isdecimal() or int(number) > MOST_CASES:
            raise ChallengeError(f"--mix {text}: {key} = {number!r} must be a whole number from 0 to {MOST_CASES}")
        known[key] = int(number)
    controls, single, *rest = (known[key] for key in KEYS)
    return Mix(controls, (single,) * len(EFFECTS), *rest)


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
    # What follows draws after all that was there before it.
    for sizes in zip(*(_severities(mix.triples, rng) for _ in range(3)), strict=True):
        chosen = rng.choice(len(names), 3, replace=False)
        plans.append(Plan("effect", tuple(names[one] for one in chosen), sizes))
    first = int(rng.integers(len(REPRESENTED))) if mix.reduced else 0
    for number, size in enumerate(_severities(mix.reduced, rng)):
        turn = REPRESENTED[(first + number // 2) % len(REPRESENTED)]
        plans.append(Plan("effect", (turn,), (size,), True) if number % 2 else Plan("none", elastic=True))
    return plans


def _severities(count: int, rng: np.random.Generator) -> list[float]:
    low, high = np.log(SEVERITY)
    parts = (rng.permutation(count) + rng.uniform(size=count)) / max(count, 1)
    return [float(value) for value in np.exp(low + (high - low) * parts)]


def counted(plans: list[Plan]) -> Mapping[str, int]:
    """Number of cases of each kind."""
    return {kind: sum(plan.kind == kind for plan in plans) for kind in ("none", "effect", "foreign")}
