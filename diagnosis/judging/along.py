"""The rig that was found, kept on the way of a judged record whose flanks part.

Its own motion may go another way than the record's: there are several, and a little of any number decides between them
at an impact. Whether the rig or only its way is another is told by a damper between the driver and its measured motion.
"""

from __future__ import annotations

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


def sentences_along(problem: Problem, judged: Judged) -> tuple[str, ...]:
    """What the rig leaves of the transmission error when it is kept on the judged record's way, where that is far less
    than by itself; nothing elsewhere."""
    size, measured, found = judged.sizes.get("dte"), judged.measured, judged.found
    if size is None or size.final <= FLOORS * size.noise:
        return ()
    nudges = nudges_of(problem.model, [prepare(measured, problem.model, problem.conditions[0].band)])
    simulator, p = found.simulator, found.end_of(found.selection.best)
    if not nudges or not parts(found.layout.case(p, measured.name), measured, simulator.simulate):
        return ()
    try:
        kept = Simulator(found.layout, simulator.target, simulator.simulate, nudges).channels(p, measured)
    except ValueError:  # a rig that cannot be kept there costs a sentence
        return ()
    part = judged.part_left("dte", kept)
    left = size.fluctuation * part if part is not None else size.final
    if left > CLOSER * size.final:
        return ()
    return (
        f"Flanks part in the record {measured.name}: kept on its way by a damper between the driver and its measured"
        f" motion, the same rig leaves {length(1e6 * left)} um rms of the transmission error in place of"
        f" {length(1e6 * size.final)} um. Its own motion goes another way after an impact, which takes little: most of"
        " what remains says nothing of a cause",
    )
