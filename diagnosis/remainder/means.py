"""What the rig found leaves of the mean transmission error: a late angle that lines do not tell enough of to be named,
or a zero or a load that the case does not know."""

from __future__ import annotations

import numpy as np

from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.words import length, number

# Times what is unknown of the means, in rms over the records, from which it is said that they are off.
OFF = 5.0


def sentences_of_means(found: Simulated) -> tuple[str, ...]:
    """A sentence if the means of the records are off; none where no record's zeros are known."""
    target, best = found.simulator.target, found.selection.best
    at = ~target.fluctuating[target.of_line]
    if not at.any():
        return ()
    off = (target.lines - best.lines)[at].real
    over = float(np.sqrt((off**2 / target.floors[target.of_line[at]]).mean()))
    if over <= OFF:
        return ()
    names = [target.blocks[block].record for block in target.of_line[at]]
    pace = {one.name: found.layout.model.pitch_speed(one.mesh_frequency) for one in target.meant}
    speeds = np.array([pace[name] for name in names])
    late = float(off @ speeds / (speeds @ speeds))
    worst = int(np.argmax(np.abs(off)))
    gear = "driven" if late > 0.0 else "driver"
    size, lag, made = (length(1e6 * abs(one)) for one in (off[worst], late, late * speeds[worst]))
    return (
        f"The mean of the transmission error is {size} um off in the record {names[worst]}, in all records"
        f" {number(over, 2)} times what a rig's stiffness leaves unknown of it. A {gear} angle that is recorded"
        f" {lag} us later than in the rig found makes {made} um of that; else look at the zeros of angles and"
        " displacements, and at the mean torque",
    )
