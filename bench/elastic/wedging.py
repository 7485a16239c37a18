"""Teeth that touch on both flanks at rest: backlash too small for the errors of the flanks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.law import Law, find_pairs
from gearbench.fem.contact.static import StaticCycle

Array = NDArray[np.float64]

# Part of the tooth forces that the working flanks may lack before it is said.
UNTOLD = 0.01


def wedging(law: Law, cycle: StaticCycle, backlash: float) -> str | None:
    """A sentence where the back flanks carry too, with the normal backlash [m] that would free them; else None.

    `backlash` [m]: the normal backlash of the pair. Where the working flanks just touch, the back flanks overlap; that
    much more backlash and they touch nowhere, nor under load, which turns the driver on and opens them.
    """
    working = cycle.load_share.sum(axis=2)
    jammed = np.argwhere((working < 1 - UNTOLD) & (working > 0))
    if not len(jammed):
        return None
    deepest = max(_overlap(law, float(cycle.phase[j]), float(cycle.unloaded[j])) for j in np.unique(jammed[:, 1]))
    return (
        f"the teeth wedge: at {len(jammed)} of {working.size} positions they touch on both flanks, where the working"
        f" ones carry only {working[tuple(jammed.T)].min():.2g} to {working[tuple(jammed.T)].max():.2g} of the tooth"
        f" forces and the torque ratio wanders; a normal backlash of {1e6 * (backlash + deepest):.3g} um would free"
        f" them, where it is {1e6 * max(backlash, 0.0):.3g} um (rig.driver.thinning_um, rig.centre_distance_mm)"
    )


def _overlap(law: Law, phase: float, dte: float) -> float:
    """Deepest overlap [m] of back flanks in the position of a mesh phase [cycles] and transmission error [m]."""
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    found = find_pairs(law, theta1, phase * law.driven.pitch, law.centre, 0.0, 0.0)
    gaps = found["gap"][found["side"] == 1]
    return max(0.0, -float(gaps.min())) if len(gaps) else 0.0
