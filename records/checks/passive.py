"""A torque that shakes a rig feeds it: no rig gives back what it was never given."""

from __future__ import annotations

import numpy as np

from gearbench.records.checks.finding import Finding
from gearbench.records.checks.look import GEARS, Look

# Cosine between force and rate of the transmission error over the excited lines. The force works on
# rb1 theta1 - rb2 theta2, where a passive rig has it at 0 or above; dte holds the gear centres too, on which it does
# not work, and may lie a little below.
REFUSED, DOUBTED = -0.15, -0.05


def force_feeds_the_rig(look: Look) -> list[Finding]:
    """The excitation does positive work on the transmission error (mean of F d/dt over the excited lines >= 0)."""
    force = look.force
    if force is None or float(np.ptp(force)) <= 1e-9 * float(np.abs(force).max()):
        return []
    rolled = _rolled(look)
    error, name = (rolled, "angles") if rolled is not None else (look.channel("dte"), "dte")
    if error is None:
        return []
    driving = look.spectrum(force)
    lines = look.excited(driving)
    driving, rate = driving[lines], (1j * look.omega * look.spectrum(error))[lines]
    size = float(np.linalg.norm(driving) * np.linalg.norm(rate))
    cosine = float(np.vdot(driving, rate).real) / size if size > 0 else 0.0
    if cosine >= DOUBTED:
        return []
    reason = "are driver and driven swapped, or is a sign reversed?" if name == "angles" else "is a sign reversed?"
    return [
        Finding(
            f"the {name} move against the torque that shakes them: the cosine between force and rate is {cosine:.2f}"
            f" (limit {DOUBTED:g}), as if the rig fed the drive; {reason}",
            refused=cosine < REFUSED,
            error=0.0 if cosine < REFUSED else 1.0,
        )
    ]


def _rolled(look: Look) -> np.ndarray | None:
    """rb1 theta1 - rb2 theta2 (samples,) [m]."""
    angles = [look.channel(f"angle_{gear}") for gear in GEARS]
    radii = [look.number(f"base_radius_{gear}") for gear in GEARS]
    if angles[0] is None or angles[1] is None or radii[0] is None or radii[1] is None:
        return None
    return radii[0] * angles[0] - radii[1] * angles[1]
