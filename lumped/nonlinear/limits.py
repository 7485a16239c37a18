"""What the non-linear lumped model leaves out, in words."""

from __future__ import annotations

from gearbench.rig import Rig

LIMITS = (
    "forces of unbalance, also of eccentric gears, are left out",
    "a pair deflects as between sound neighbours: what the neighbours of an uneven tooth carry does not bend it",
    "back flanks are free of friction, pitch errors and cracks",
    "mesh phase is that of the steady rotation, turned on by the centres along their supports and by where the driven"
    " gear stands at rest: what it vibrates beside does not turn the mesh on",
    "back flanks of gears that run out begin and end contact as the working ones do, with levers of centred gears",
)
ONE_DIRECTION = "the centres move along the support direction only: friction acts on rotations and tangential supports"


def limits_of(rig: Rig) -> tuple[str, ...]:
    """What it leaves out of a rig."""
    across = rig.support.driver.across is not None and rig.support.driven.across is not None
    return LIMITS if across else (LIMITS[0], ONE_DIRECTION, *LIMITS[1:])
