"""What entered, sifted: by its size, by what the force residuals name, and by the judged record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.decision import named
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.evidence.search import Search
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.decided import relative_size, size_needed
from gearbench.diagnosis.judging.held_against import itself, judged_on
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.selection.selection import only, with_entered
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import WORTH, Weighed

Report = Callable[[str], None]


def judged_of_size(
    problem: Problem,
    found: Simulated,
    held_out: Measurement | None,
    searched: Sequence[Measurement],
    report: Report = lambda step: None,
) -> Judged:
    """What was found on the judged record, but for effects of which a sound rig has as much: some enter there only."""
    dropped: tuple[Weighed, ...] = ()
    while True:
        judged = judgement(problem, found, held_out, searched, report).with_dropped(dropped)
        found, dropped = sized(judged.found), judged.dropped
        if found is judged.found:
            return judged


def judgement(
    problem: Problem,
    found: Simulated,
    held_out: Measurement | None,
    searched: Sequence[Measurement],
    report: Report = lambda step: None,
) -> Judged:
    """What was found on the held-out record; without one that can be simulated, on the first record of the search."""
    judged = None
    if held_out is not None and held_out.phase_known:
        judged = judged_on(problem, found, held_out, searched, report)
    return judged or itself(problem, found)


def sized(found: Simulated, limits: Limits = LIMITS) -> Simulated:
    """What simulation found without those effects of which a sound rig has as much."""
    entered = found.selection.entered
    return left_out(found, [one for one in entered if relative_size(found, one) <= size_needed(one, limits)])


def left_out(found: Simulated, out: Sequence[Weighed]) -> Simulated:
    """What simulation found without these of the effects that entered."""
    if not out:
        return found
    kept = [one for one in found.selection.entered if not any(one is other for other in out)]
    selection = only(found.simulator, found.selection, kept)
    return replace(found.with_selection(selection), out=(*found.out, *out))


def seconded(found: Simulated, forces: Search) -> Simulated:
    """With what the force residuals name where simulation alone names nothing but speaks for the same effect."""
    best = named(forces)
    if found.selection.entered or best is None:
        return found
    for one in found.selection.weighed:
        if one.hypothesis.name == best.hypothesis.name and one.optimum is not None and one.log_bayes_factor > WORTH:
            return found.with_selection(with_entered(found.simulator, found.selection, one))
    return found
