"""A hypothesis begun anew from shapes that no slope leads to: reliefs far deeper than the mesh yields.

What it is called for by is a mesh whose stiffness changes over its phase as no body, rim or web makes it: the fit
without the effect then has bent the structure of the rig as well, so that it begins from the nominal one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.fitting.fit import Optimum, cost_of, fit_afresh
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]

RENEWALS = 5


def has_shapes(one: Hypothesis) -> bool:
    """Whether a hypothesis has shapes to begin from."""
    return one.effect is not None and one.wide == (Wide(one.effect.shaped),)


def reshaped(simulator: Simulator, one: Hypothesis, sd: Array) -> Optimum | None:
    """The optimum of a hypothesis under its prior `sd` (size,), begun from the nominal rig with the shape that comes
    closest; None where none of them comes closer than the nominal rig."""
    assert one.effect is not None
    layout, entries = simulator.layout, one.entries(simulator.layout.unknowns)
    nothing = np.zeros(layout.size)
    begin, least = None, cost_of(simulator, nothing, sd)
    for shape in one.effect.shapes(layout.model):
        p = nothing.copy()
        p[entries] = shape
        cost = cost_of(simulator, p, sd)
        if cost < least:
            begin, least = p, cost
    if begin is None:
        return None
    return fit_afresh(simulator, begin, sd, renewals=RENEWALS)
