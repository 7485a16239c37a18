"""A mesh whose law is written down in two lines, and whose tables are therefore exact between their nodes.

Pair n carries the share 1 - |phase - n| (two pairs always touch); F = stiffness(phase) delta (1 + bend sqrt(delta/top))
with a stiffness that is linear between whole and half phases.
"""

from __future__ import annotations

from math import pi, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.lumped.nonlinear.law import MeshLaw, approach_grid

Array = NDArray[np.float64]

PHASES = 64
TOP = 40e-6  # largest tabulated deflection [m]
STIFFNESS = 3e8
SWING = 0.25
BEND = 0.2
BACKLASH = 50e-6
BENDING = (0.3, 0.4)  # of driver and driven tooth in their pair
RADII = (28.19e-3, 42.285e-3)  # of the base circles of 20 and 30 teeth [m]
ALPHA = pi / 9
PITCH_ROLL = (RADII[0] * tan(ALPHA), RADII[1] * tan(ALPHA))  # roll lengths at the pitch point [m]
BASE_PITCH = 2 * pi * RADII[0] / 20


def hat(away: ArrayLike) -> Array:
    """Share of a pair whose contact is `away` cycles behind the pitch point."""
    return np.asarray(np.maximum(1.0 - np.abs(away), 0.0))


def stiffness(phase: ArrayLike, swing: float = SWING) -> Array:
    """Stiffness [N/m] at small deflections: highest at whole phases, lowest half-way."""
    cycle = np.mod(phase, 1.0)
    return np.asarray(STIFFNESS * (1 + swing * (4 * np.abs(cycle - 0.5) - 1)))


def force(delta: ArrayLike, phase: ArrayLike, swing: float = SWING, bend: float = BEND) -> Array:
    """Force [N] at deflections >= 0 [m]."""
    return np.asarray(stiffness(phase, swing) * delta * (1 + bend * np.sqrt(np.asarray(delta) / TOP)))


def hat_law(*, swing: float = SWING, bend: float = BEND, backlash: float = BACKLASH, mirror: float = 0.5) -> MeshLaw:
    """The law as tables."""
    phase = np.arange(PHASES) / PHASES
    approach = approach_grid(TOP, 9)
    offsets = np.arange(-1, 3)
    away = phase[:, None] - offsets
    total = force(approach, phase[:, None], swing, bend)
    return MeshLaw(
        approach=approach,
        force=total,
        offsets=offsets,
        share=hat(away),
        parts=total[..., None] * hat(away)[:, None],
        rho1=PITCH_ROLL[0] + away * BASE_PITCH,
        rho2=PITCH_ROLL[1] - away * BASE_PITCH,
        bending=np.broadcast_to(np.array(BENDING), (PHASES, len(offsets), 2)).copy(),
        backlash=backlash,
        base_pitch=BASE_PITCH,
        mirror=mirror,
    )
