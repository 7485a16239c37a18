"""What moves the lines of the rotation alone: a search for structure, which answers the excitation, leaves it aside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.eccentricity import KEYS as RUNOUTS
from gearbench.diagnosis.effects.encoder_runout import KEYS as ENCODERS
from gearbench.diagnosis.effects.pitch_error import KEYS as PITCHES
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.effects.torque_ripple import KEY as RIPPLE
from gearbench.diagnosis.fitting.beginning import linear_cost
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROTATION = (*RUNOUTS.values(), *PITCHES.values(), CRACK, RIPPLE, *ENCODERS.values())
RENEWALS = 3  # of the Jacobian of all unknowns


def but_rotation(unknowns: Unknowns, sd: Array) -> Flags:
    """All unknowns (size,) but those, unless the prior `sd` (size,) widens them as an effect's."""
    return (sd > unknowns.prior()) | ~unknowns.of(ROTATION)


def with_rotation(simulator: Simulator, found: Optimum, part: Optimum) -> Optimum | None:
    """The fit of all unknowns begun where the `part` without the rotation's ended; None where its excited lines are no
    closer than those that were `found`: what waits is missing in the others."""
    if linear_cost(simulator, part.p, found.sd) > linear_cost(simulator, found.p, found.sd):
        return None
    return fit_afresh(simulator, part.p, found.sd, renewals=RENEWALS)
