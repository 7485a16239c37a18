"""Friction along a motion: which forces come with a normal force in the mesh, at every instant of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.lumped.nonlinear.coordinates import U1, U2, X1, X2, Y1, Y2
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.reading import over_pairs

Array = NDArray[np.float64]


def rubbed_along(model: NonLinear, position: Array, pace: Array, rates: Array, mesh_frequency: float) -> Array:
    """What friction adds to the deflection's direction (entries, n): a normal force f in the mesh pushes coordinate i
    by -f (m_i + this), m_i being what it contributes to the deflection.

    `position` (entries,) in rows of the mesh law, `pace` (entries,) the speed of the rotation over that of
    `mesh_frequency` [Hz], `rates` (entries, n) of the coordinates [m/s]. The levers are those of `forces.friction`.
    """
    out = np.zeros_like(rates)
    r = model.rubbing(mesh_frequency)
    if r is None:
        return out
    further = rates.shape[1] > X2
    aside = model.factor * (rates[:, X1] - rates[:, X2]) if further else 0.0
    u1, u2, closing = rates[:, U1], rates[:, U2], rates[:, Y1] - rates[:, Y2]
    middle = r.centre1 * u1 - r.centre2 * u2 + r.slide * closing - aside
    slope = pace * r.drift + r.pitch1 * u1 + r.pitch2 * u2
    rows = len(r.carried) - 1
    row = np.minimum(position.astype(int), rows - 1)
    carried = r.carried[row] + (position - row)[:, None] * (r.carried[row + 1] - r.carried[row])
    away = (position / rows - r.offset)[:, None] - np.arange(r.carried.shape[1])
    part = carried * r.coefficient * np.tanh((middle[:, None] + away * slope[:, None]) * r.steepness)
    along = over_pairs(part)
    out[:, U1] = over_pairs(part * (r.centre1 + away * r.pitch1))
    out[:, U2] = -over_pairs(part * (r.centre2 - away * r.pitch2))
    out[:, Y1], out[:, Y2] = r.slide * along, -r.slide * along
    if further:
        out[:, X1], out[:, X2] = -model.factor * along, model.factor * along
    return out
