"""Which records tell whether something changes: those whose motion repeats itself where nothing does.

Flanks that part and meet again make a motion that need not repeat with its excitation, in a rig where nothing drifts:
such a record says nothing of what changes from one repetition to the next.
"""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.forces.steadiness import SLOW, changing_parts
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.words import percent


def repeating(measurements: Sequence[Measurement], found: Simulated | None) -> tuple[Measurement, ...]:
    """The records whose flanks stay together, or part little, which simulation follows; all where it follows none."""
    if found is None:
        return tuple(measurements)
    return tuple(one for one in found.simulator.held_by if one.name not in found.restless)


def sentences_of_others(
    measurements: Sequence[Measurement], kept: Sequence[Measurement], band: float
) -> tuple[str, ...]:
    """A sentence for each record that is not among those `kept` and changes between its repetitions up to `band`
    [Hz]."""
    out = []
    for one in measurements:
        changes = max(changing_parts([one], band).values(), default=0.0)
        if changes > SLOW and not any(one is other for other in kept):
            out.append(
                f"The record {one.name} changes by {percent(changes)} of a channel's fluctuation from one repetition to"
                " the next; its flanks part, and such a motion need not repeat, so that this speaks for nothing"
            )
    return tuple(out)
