"""What was weighed, as a verdict lists it: its evidence, and the part of the judged record that it leaves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.selection.selection import evidence_without
from gearbench.diagnosis.selection.weighing import best_evidence
from gearbench.diagnosis.verdict import Candidate

Array = NDArray[np.float64]
Effects = tuple[str, ...]


def candidates_of(judged: Judged, held_out: Measurement | None) -> tuple[Candidate, ...]:
    """The background alone, the best hypothesis of each effect, what entered together and the same without each one of
    it, with the part of the transmission error's fluctuation that each leaves on the held-out record; the best first.
    Evidence is that over the background alone, or beside what else entered where only that shows an effect. Beside
    effects that entered, the background has no part of them."""
    selection, base = judged.found.selection, judged.found.selection.base.evidence
    entered = tuple(dict.fromkeys(one.effect.name for one in selection.entered))
    single = best_evidence(selection.weighed, selection.entered)
    evidence: dict[Effects, float] = {(): 0.0, **{(name,): value for name, value in single.items()}}
    if len(entered) > 1:
        evidence[entered] = selection.best.evidence - base
    left = _left(judged, entered) if judged.measured is held_out else {}
    for effects, optimum in _without_each(judged).items():
        evidence.setdefault(effects, optimum - base)
    listed = [Candidate(effects=e, log_evidence=float(value), held_out=left.get(e)) for e, value in evidence.items()]
    return tuple(sorted(listed, key=lambda candidate: -candidate.log_evidence))


def _single(judged: Judged) -> dict[str, Effects]:
    """What else entered, by the name of each hypothesis whose effect is at work in one place."""
    entered = judged.found.selection.entered
    names = [one.effect.name for one in entered]
    count = Counter(names)
    return {
        one.hypothesis.name: tuple(dict.fromkeys(name for name in names if name != one.effect.name))
        for one in entered
        if count[one.effect.name] == 1
    }


def _without_each(judged: Judged) -> dict[Effects, float]:
    """Evidence of what entered without each one of it, by the effects that stay."""
    found, out = judged.found, {}
    entered = {one.hypothesis.name: one for one in found.selection.entered}
    for name, effects in _single(judged).items():
        optimum = judged.closings[name].optimum
        if effects and optimum is not None:
            out[effects] = evidence_without(found.layout.unknowns, found.selection, entered[name], optimum)
    return out


def _left(judged: Judged, entered: Effects) -> dict[Effects, float]:
    """Part of the fluctuation that each leaves, by its effects; what is not in it was not simulated. Where all records
    are nudged, what else was weighed has not been fitted as it goes its own way."""
    simulator, size = judged.found.simulator, judged.sizes.get("dte")
    if size is None:
        return {}
    signals: dict[Effects, Mapping[str, Array]] = {(): judged.plain, entered: judged.signals}
    for name, effects in _single(judged).items():
        closing = judged.closings[name]
        signals.setdefault(effects, closing.own or closing.without)
    for one in judged.found.selection.weighed if simulator.anchored else ():
        if (one.effect.name,) in signals or one.optimum is None or one.log_bayes_factor <= 0.0:
            continue
        try:
            signals[(one.effect.name,)] = simulator.free.channels(one.optimum.p, judged.measured)
        except ValueError:  # a rig that cannot answer the record leaves a number out
            continue
    return {effects: judged.rms_left("dte", values) / size.fluctuation for effects, values in signals.items()}
