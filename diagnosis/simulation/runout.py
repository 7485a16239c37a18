"""Forces that stand for a gear's run-out along a motion: its flanks stand proud, contact begins and ends elsewhere, and
the mesh force turns and has other levers (`lumped.nonlinear.ends`, `lumped.nonlinear.equations`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.lumped.nonlinear.coordinates import U1, U2, X1, X2, Y1, Y2
from gearbench.lumped.nonlinear.ends import aside_of, ends_of, turned_by

if TYPE_CHECKING:
    from gearbench.bench.nonlinear.along import Along

Array = NDArray[np.float64]


def in_mesh_of_runout(along: Along, side: int) -> Array:
    """Force (entries, 2) [N] in the mesh per unit of the cosine and the sine of the run-out of a gear (0: driver)."""
    turn = turn_of(along, side)
    # Normals of working and back flanks are so much of the gear's rotation apart (`lumped.nonlinear.tables`).
    between = np.pi - 2 * along.model.working_pressure_angle
    proud, back = lobes_of(turn), lobes_of(turn + (between, -between)[side])
    turned = turned_by(along.phase, turn, side, ends_of(along.model)).T
    closed = sum(change * along.fine(on)[:, None] for on, change in _directions(along, side).items())
    return along.of_excess(proud + closed) + along.of_back_excess(back) + along.tangent.turning[:, None] * turned


def on_gears_of_runout(along: Along, side: int) -> dict[int, Array]:
    """Force (entries, 2) [N] on coordinates per unit of both: that of the mesh pushes along another direction."""
    pressed = np.maximum(along.elastic + along.tangent.damping * along.rate, 0.0)
    pressed[along.elastic < 0.0] = 0.0
    return {on: -pressed[:, None] * change for on, change in _directions(along, side).items()}


def _directions(along: Along, side: int) -> dict[int, Array]:
    """What coordinates that the run-out acts on contribute more to the deflection (entries, 2) per unit of both."""
    model, aside = along.model, aside_of(turn_of(along, side), side).T
    tilt = aside / model.length_of_action
    out = {(U1, U2)[side]: (1.0, -1.0)[side] * aside / model.base_radii[side]}
    if model.slide:
        out |= {Y1: model.slide * tilt, Y2: -model.slide * tilt}
    if model.rig.support.move_across:
        out |= {X1: -model.factor * tilt, X2: model.factor * tilt}
    return out


def turn_of(along: Along, side: int) -> Array:
    """Rotation (entries,) [rad] of a gear."""
    rig = along.model.rig
    return 2 * np.pi * along.phase / (rig.driver, rig.driven)[side].teeth


def lobes_of(turn: Array) -> Array:
    """Cosine and sine (entries, 2) of a gear's rotation [rad]."""
    return np.stack([np.cos(turn), np.sin(turn)], axis=1)
