"""How far the stiffness of a pair of teeth falls from the middle of its path of contact towards the ends, and from one
end to the other, as unknowns: by more or less than the nominal tables say.

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
# The same of c x: rims and webs of one gear that are softer than the nominal ones, with which the teeth of that gear
# tilt, and pictures of teeth as beams have a fifth of it.
TILT, TILT_SD, TILT_LARGEST = "tilt", 0.2, 1.0
TILT_NAME = "compliance that a pair has more where its path of contact ends than in the middle, less where it begins"
UNEVEN = (ENDS, TILT)
STEP = 1e-4  # of the unknowns, for the derivatives of what keeps the mean


@dataclass(frozen=True)
class Ends:
    """Of the nominal mesh under the mean torque: each pair's own stiffness (phases, n_o) [N/m], without what the pairs
    `shared` [m/N] yield, how much more at its place (2, phases, n_o) either unknown gives it of the mesh's `mean`
    compliance, which is one over this stiffness [N/m]."""

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
    more = meshing.uneven(rows[:, None] / law.phases - law.offsets)
    return Ends(tangents / (1.0 - law.shared * whole), more, law.shared, float(whole.mean()))


def ends_groups() -> list[Group]:
    """The one mesh."""
    return [
        group(ENDS, "1", ("mesh",), ENDS_SD, slot="ends", low=-ENDS_LARGEST, high=ENDS_LARGEST),
        group(TILT, "1", ("mesh",), TILT_SD, slot="ends", first=1, low=-TILT_LARGEST, high=TILT_LARGEST),
    ]


def uneven_of(unknowns: Unknowns, p: Array) -> Array:
    """Both of the unknowns (size,): (2,)."""
    return np.concatenate([p[unknowns[key]] for key in UNEVEN])


def ended(rig: Rig, ends: Ends, unknowns: Unknowns, p: Array) -> Rig:
    """The rig whose pairs yield more or less at the ends, with the mean stiffness that it has."""
    more = uneven_of(unknowns, p)
    if not more.any():
        return rig
    mesh, (both, one) = rig.mesh, more / ends.mean
    return changed(
        rig,
        "mesh",
        end_compliance=mesh.end_compliance + float(both),
        tilt_compliance=mesh.tilt_compliance + float(one),
        stiffness_scale=mesh.stiffness_scale * kept_mean(ends, more),
    )


def kept_mean(ends: Ends, more: Array) -> float:
    """Factor on the force that keeps the mean stiffness of a mesh whose pairs yield so much `more` (2,), of its mean
    compliance, at the ends and at one. Raises ValueError for more than there is."""
    left = 1.0 + np.tensordot(more / ends.mean, ends.more, 1) * ends.own
    if left.min() <= 0.0:
        raise ValueError(
            f"pairs of teeth cannot have {more[0]:+g} of the mesh's compliance at the ends of their path, and"
            f" {more[1]:+g} at one"
        )
    stiffness = (ends.own / left).sum(axis=1)
    return float(ends.mean / np.mean(stiffness / (1.0 + ends.shared * stiffness)))


def ends_slope(ends: Ends, more: Array) -> Array:
    """Derivatives (2,) of that factor's logarithm by the unknowns, which have the values `more` (2,)."""
    steps = STEP * np.eye(len(more))
    return np.array([np.log(kept_mean(ends, more + one) / kept_mean(ends, more - one)) for one in steps]) / (2 * STEP)
