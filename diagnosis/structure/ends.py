"""How far the stiffness of a pair of teeth falls from the middle of its path of contact towards the ends, as an
unknown: by more or less than the nominal tables say.

It says how two pairs in contact divide the load, and so how an error of one tooth shows in the transmission error: in
the spectrum of pitch errors, far below the mesh's order. What the mesh yields in the mean stays as it is: that is an
unknown of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import changed
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.geometry import Pair
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Compliance c of c (x^2 - 1/3), x from -1 to 1 along the path, over the mesh's mean one: pictures of teeth as beams,
# or parabolas of their stiffness over the path, have half of it more or less than finite elements.
ENDS, ENDS_SD, ENDS_LARGEST = "ends", 0.4, 2.0
ENDS_NAME = "compliance that a pair has more at the ends of its path of contact than in the middle, over the mesh's"
STEP = 1e-4  # of the unknown, for the derivative of what keeps the mean


@dataclass(frozen=True)
class Ends:
    """Of the nominal mesh under the mean torque: each pair's own stiffness (phases, n_o) [N/m], without what the pairs
    `shared` [m/N] yield, how much more at its place (phases, n_o) the unknown gives it of the mesh's `mean` compliance,
    which is one over this stiffness [N/m]."""

    own: Array
    more: Array
    shared: float
    mean: float


def ends_of(model: NominalModel, meshing: Pair) -> Ends:
    """Those of a nominal rig."""
    law = model.hardened
    force = abs(model.torque_mean) / model.base_radius[0] / model.scale
    rows = np.arange(law.phases)
    node = np.clip((law.force < force).sum(axis=1), 1, len(law.approach) - 1)
    step = law.approach[node] - law.approach[node - 1]
    tangents = (law.parts[rows, node] - law.parts[rows, node - 1]) / step[:, None]
    whole = tangents.sum(axis=1, keepdims=True)
    more = meshing.towards_ends(rows[:, None] / law.phases - law.offsets)
    return Ends(tangents / (1.0 - law.shared * whole), more, law.shared, float(whole.mean()))


def ends_groups() -> list[Group]:
    """The one mesh."""
    return [group(ENDS, "1", ("mesh",), ENDS_SD, slot="ends", low=-ENDS_LARGEST, high=ENDS_LARGEST)]


def ended(rig: Rig, ends: Ends, unknowns: Unknowns, p: Array) -> Rig:
    """The rig whose pairs yield more or less at the ends, with the mean stiffness that it has."""
    more = float(p[unknowns[ENDS]][0])
    if not more:
        return rig
    mesh = rig.mesh
    compliance, scale = mesh.end_compliance + more / ends.mean, mesh.stiffness_scale * kept_mean(ends, more)
    return changed(rig, "mesh", end_compliance=compliance, stiffness_scale=scale)


def kept_mean(ends: Ends, more: float) -> float:
    """Factor on the force that keeps the mean stiffness of a mesh whose pairs yield so much `more`, of its mean
    compliance, at the ends. Raises ValueError for more than there is."""
    left = 1.0 + more / ends.mean * ends.more * ends.own
    if left.min() <= 0.0:
        raise ValueError(f"pairs of teeth cannot have {more:+g} of the mesh's compliance at the ends of their path")
    stiffness = (ends.own / left).sum(axis=1)
    return float(ends.mean / np.mean(stiffness / (1.0 + ends.shared * stiffness)))


def ends_slope(ends: Ends, more: float) -> float:
    """Derivative of that factor's logarithm by the unknown, which has the value `more`."""
    return float(np.log(kept_mean(ends, more + STEP) / kept_mean(ends, more - STEP)) / (2 * STEP))
