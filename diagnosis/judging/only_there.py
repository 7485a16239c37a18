"""Backlash that only the judged record feels.

Where flanks meet behind in none of the records of the search, these say no more than that there is some backlash. A
judged record in which they do meet then is far off for want of it, and says how much there is: that is believed where
it alone brings the simulation close to that record, and the records of the search allow it.
"""

from __future__ import annotations

from gearbench.diagnosis.effects.backlash import BACKLASH
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.selection.followable import nudges_of, parts
from gearbench.diagnosis.selection.opened import opened
from gearbench.diagnosis.selection.parting import FOLLOWED, off, with_backlash
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import joined, target_of

# Part of what the judged record is off without it that may be left with it.
CLOSED = 0.5


def with_backlash_there(problem: Problem, found: Simulated, measured: Measurement) -> Simulated:
    """What simulation found, with the backlash that the judged record alone shows, if it is far off without."""
    condition = prepare(measured, problem.model, problem.conditions[0].band)
    nudges = nudges_of(problem.model, [condition])
    if not nudges or not parts(found.layout.nominal, measured, found.simulator.simulate):
        return found
    searched, simulate = found.simulator, found.simulator.simulate
    alone = Simulator(found.layout, target_of([measured], [condition]), simulate, nudges)
    # Smooth records say nothing of it.
    rough = [number for number, one in enumerate(searched.target.measurements) if one.name in searched.nudges]
    target = joined(searched.target.of_records(rough), alone.target) if rough else alone.target
    told = Simulator(found.layout, target, simulate, {**searched.nudges, **nudges})
    (backlash,) = BACKLASH.hypotheses(problem.model)
    more = opened(told, found.selection.best.p)
    selection = with_backlash(told, found.selection, backlash, more, apart=True, only_in=measured.name)
    if len(selection.entered) == len(found.selection.entered):
        return found
    left, before = off(alone, selection.best.p), off(alone, found.selection.best.p)
    return found.with_selection(selection) if left < min(FOLLOWED, CLOSED * before) else found
