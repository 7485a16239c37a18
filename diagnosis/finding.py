"""What was found of a gap's cause."""

from __future__ import annotations

from dataclasses import dataclass, field

from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.remainder.missing import Missing
from gearbench.diagnosis.verdict import Candidate, Effect, Found, Outcome, Share
from gearbench.rig import Case
from gearbench.rig.contract import Place


@dataclass(frozen=True)
class Finding:
    """What was found: fields of the verdict, the nominal case recalibrated and with the effects added; `judged`: what
    simulation makes of the judged record, None where records cannot be simulated; `problem`: what was searched."""

    verdict: Outcome
    probability: dict[str, float]
    signs: dict[str, float]
    effects: tuple[Effect, ...]
    candidates: tuple[Candidate, ...]
    place: Place
    where: tuple[Share, ...]
    recalibrated: Case
    with_effect: Case | None
    because: tuple[str, ...]
    structure: tuple[Found, ...] = ()
    missing: Missing | None = None
    places: tuple[Place, ...] = ()
    indistinguishable: tuple[tuple[str, ...], ...] = ()
    advice: tuple[str, ...] = ()
    evidence: dict[str, float] = field(default_factory=dict)
    audits: dict[str, tuple[float, ...]] = field(default_factory=dict)
    judged: Judged | None = None
    problem: Problem | None = None
