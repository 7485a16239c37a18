"""The rig that was found, kept on the way of a judged record whose flanks part.

Its own motion may go another way than the record's: there are several, and a little of any number decides between them
at an impact. Whether the rig or only its way is another is told by a damper between the driver and its measured motion;
where only its way is, what an effect closes is judged along the record's.
"""

from __future__ import annotations

from typing import NamedTuple

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.selection.followable import nudges_of, parts
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.words import length

# Part of what the rig's own motion leaves up to which the same rig kept on the record's way must come: such a damper
# takes away some of any gap.
CLOSER = 0.25
# Multiples of the noise from which a gap can be one of ways.
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


def way_of(
    found: Simulated, model: NominalModel, condition: Condition, measured: Measurement
) -> Simulator | None:
    """What keeps the driver of the rig that was found on the way of a record; None where its flanks stay together or
    nothing tells that way."""
    nudges, simulator = nudges_of(model, [condition]), found.simulator
    if not nudges or not parts(found.layout.case(found.selection.best.p, measured.name), measured, simulator.simulate):
        return None
    return Simulator(found.layout, simulator.target, simulator.simulate, nudges)
