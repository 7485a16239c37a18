"""The rig that was found, kept on the way of a judged record whose flanks part.

Its own motion may go another way than the record's: there are several, and a little of any number decides between them
at an impact. Whether the rig or only its way is another is told by a damper between the driver and its measured motion.
"""

from __future__ import annotations

from typing import NamedTuple

from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.selection.followable import nudges_of, parts
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.words import length

# Part of what the rig's own motion leaves up to which the same rig kept on the record's way must come: such a damper
# takes away some of any gap.
CLOSER = 0.25
# Multiples of the noise from which the gap is worth a word.
FLOORS = 2.0


class Along(NamedTuple):
    """Rms of the transmission error [m] that a rig leaves of a record, kept on its way and by its own motion."""

    record: str
    kept: float
    own: float

    def sentence(self) -> str:
        """What that says."""
        return (
            f"Flanks part in the record {self.record}: kept on its way by a damper between the driver and its measured"
            f" motion, the same rig leaves {length(1e6 * self.kept)} um rms of the transmission error in place of"
            f" {length(1e6 * self.own)} um. Its own motion goes another way after an impact, which takes little: most"
            " of what remains says nothing of a cause"
        )


def along(problem: Problem, judged: Judged) -> Along | None:
    """What the rig leaves when it is kept on the judged record's way, where flanks part and that is far less than by
    itself; None elsewhere."""
    size, measured, found = judged.sizes.get("dte"), judged.measured, judged.found
    if size is None or size.final <= FLOORS * size.noise:
        return None
    nudges = nudges_of(problem.model, [prepare(measured, problem.model, problem.conditions[0].band)])
    simulator, p = found.simulator, found.end_of(found.selection.best)
    if not nudges or not parts(found.layout.case(p, measured.name), measured, simulator.simulate):
        return None
    try:
        kept = Simulator(found.layout, simulator.target, simulator.simulate, nudges).channels(p, measured)
    except ValueError:  # a rig that cannot be kept there costs a sentence
        return None
    left = judged.rms_left("dte", kept)
    return Along(measured.name, left, size.final) if left <= CLOSER * size.final else None
