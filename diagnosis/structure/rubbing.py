"""How fast flanks slide where friction has turned round, as an unknown: oil films and rough flanks turn it round over a
wider part of the path of contact than dry ones do."""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import changed
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Logarithm of the sliding speed at which friction has turned round, over the nominal rig's: films are known to a few
# times of it. One that is far smaller looks like a jump, which steps would have to follow.
TURNING, TURNING_SD, TURNING_LEAST, TURNING_LARGEST = "friction-turning", 1.2, -1.0, 3.0
TURNING_NAME = "sliding speed at which friction turns round, over the nominal one (logarithm)"


def rubbing_groups() -> list[Group]:
    """The one mesh."""
    return [group(TURNING, "1", ("mesh",), TURNING_SD, slot="rubbing", low=TURNING_LEAST, high=TURNING_LARGEST)]


def rubbing(rig: Rig, unknowns: Unknowns, p: Array) -> Rig:
    """The rig whose friction turns round at that speed; itself where there is none to turn."""
    if TURNING not in unknowns.slices or not rig.friction.coefficient or not p[unknowns[TURNING]][0]:
        return rig
    return changed(
        rig, "friction", transition_speed=rig.friction.transition_speed * exp(float(p[unknowns[TURNING]][0]))
    )
