"""One case judged: what the verdict is worth beside the answer.

* An effect (or several) was at work. `right`: the verdict names exactly these. `class`: it names another, but reports a
  class of indistinguishable effects that holds both the named and the true one. `part`: it names some of several.
  `wrong`: it names anything else. `missed`: it says none. `refused`: it says unknown.
* None was. `right`: it says none. `named`: it names an effect (a false alarm). `flagged`: it says unknown.
* A foreign one was, or one that was taken out of the library. `refused`: it says unknown. `blamed`: it names another
  effect; `right`: it knows that one. `missed`: it says none.
* `failed`: there is no verdict, because the diagnosis of the case failed.

The place is right when the verdict's is that of one of the effects, whatever the verdict.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from gearbench.challenge.answers import Answer

VERDICTS = ("effect", "none", "unknown")
# What version 2 of a verdict says for those of version 1.
_NOW = {"effects": "effect"}

Verdict = Mapping[str, Any]


@dataclass(frozen=True)
class Outcome:
    """A case, its answer, its verdict (None: failed) and what that is worth."""

    name: str
    answer: Answer
    verdict: Verdict | None
    result: str
    place_right: bool

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that the verdict gives; none where it failed."""
        return named_effects(self.verdict or {})

    def at_work(self, effect: str) -> bool:
        """Whether a named effect was at work: a foreign one, too, if the library has it after all."""
        return effect in self.answer.effects

    def told(self, effect: str) -> bool:
        """Whether a named effect was at work, or one that was and is not named, which the verdict says that it cannot
        tell from it."""
        return self.at_work(effect) or bool(self._like(effect) & set(self.answer.effects).difference(self.named))

    def found(self, effect: str) -> bool:
        """Whether an effect at work was named, or one that was not at work in its class."""
        return effect in self.named or any(
            effect in self._like(other) for other in self.named if not self.at_work(other)
        )

    def _like(self, effect: str) -> set[str]:
        """Effects of the library that the verdict cannot tell from one of it."""
        if self.answer.kind != "effect":
            return set()
        classes = (self.verdict or {}).get("indistinguishable", ())
        return {name for members in classes if effect in members for name in members}


def without(answer: Answer, effect: str | None) -> Answer:
    """The answer when `effect` is not in the library: a case that it made counts as foreign."""
    if effect is not None and answer.kind == "effect" and effect in answer.effects:
        return replace(answer, kind="foreign")
    return answer


def named_effects(verdict: Verdict) -> tuple[str, ...]:
    """Names of the effects that a verdict gives."""
    return tuple(effect["name"] for effect in verdict.get("effects", ()))


def said(verdict: Verdict) -> str:
    """Which of `VERDICTS` a verdict of either version says; what it says otherwise as it stands."""
    return _NOW.get(str(verdict.get("verdict")), str(verdict.get("verdict")))


def judge(name: str, answer: Answer, verdict: Verdict | None) -> Outcome:
    """The outcome of one case."""
    if verdict is None:
        return Outcome(name, answer, None, "failed", False)
    return Outcome(name, answer, verdict, _result(answer, verdict), verdict["place"] in answer.everywhere)


def _result(answer: Answer, verdict: Verdict) -> str:
    word = said(verdict)
    if answer.kind == "none":
        return {"none": "right", "effect": "named", "unknown": "flagged"}[word]
    if word != "effect":
        return {"none": "missed", "unknown": "refused"}[word]
    named, true = set(named_effects(verdict)), set(answer.effects)
    if named == true:
        return "right"
    if answer.kind == "foreign":
        return "blamed"
    if _in_one_class(true, named, verdict.get("indistinguishable", ())):
        return "class"
    return "part" if named < true else "wrong"


def _in_one_class(true: set[str], named: set[str], classes: Sequence[Sequence[str]]) -> bool:
    """Whether one class holds the one true and the one named effect."""
    if len(true) != 1 or len(named) != 1:
        return False
    return any(true | named <= set(members) for members in classes)
