"""How many branches of a mesh-feedback model its response takes, and what those beyond hold.

A mode of little damping that travels far at a slow mesh needs L f_mesh of more than its travel: 196 branches a side at
7 Hz mesh for one between 2600 and 3800 Hz with 0.5 %. The model has them all; how many are written is only a question
of room.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.result import followed, htf_on
from gearbench.identification.spectra.joint import Floats

# Branches that a result has at least, if its lines reach so far; the part of the response's rms that those beyond may
# hold; and numbers of the HTF at most, unless the fewest branches take more.
FEWEST = 160
NEGLIGIBLE = 2e-4
ROOM = 6_000_000
# Sidebands by so much further tell what a model misses that ends with its own.
WIDER = 1.5


def enough_branches(
    model: Model, data: ClassData, lines: NDArray[np.int64], ratio: float = 1.0
) -> tuple[int, Floats]:
    """Branches on each side that hold all but NEGLIGIBLE of the response, within ROOM, and the power [m^2/N^2] (F,)
    beyond them on the output `lines`; `ratio` as in `htf_on`."""
    most = int(2 * data.furthest_at(ratio) / (data.mesh_lines * ratio))
    chosen = followed(lines)
    power = np.abs(htf_on(model, data, chosen, most, ratio)) ** 2
    order = np.abs(np.arange(-most, most + 1))
    of_order = np.bincount(order, weights=power.sum(axis=1))
    beyond = of_order.sum() - np.cumsum(of_order)
    enough = int(np.argmax(beyond <= NEGLIGIBLE**2 * of_order.sum()))
    room = (ROOM // lines.size - 1) // 2
    kept = min(most, max(FEWEST, min(enough, room)))
    return kept, np.asarray(np.interp(lines, chosen, power[order > kept].sum(axis=0)))


def left_out(model: Model, data: ClassData, lines: NDArray[np.int64], branches: int, ratio: float = 1.0) -> Floats:
    """Power [m^2/N^2] (F,) by which the response on the output `lines` would change if the model had sidebands half as
    far again: what it may err by because it ends. A resonance beyond its end, from which sidebands act back, shows."""
    chosen, furthest = followed(lines), data.furthest_at(ratio)
    now, wider = (htf_on(model, data, chosen, branches, ratio, end) for end in (furthest, int(WIDER * furthest)))
    return np.asarray(np.interp(lines, chosen, np.sum(np.abs(wider - now) ** 2, axis=0)))
