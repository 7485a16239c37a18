"""How far the stiffness of the mesh changes over its phase, as an unknown: by more or less than the nominal tables say.

Pairs in contact at once share the compliance of bodies, rims and webs. The more of all compliance that is, the less a
second pair stiffens the mesh; the less, the more the stiffness of a mesh changes over its phase. What the mesh yields
in the mean stays as it is: that is an unknown of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import changed
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Compliance that pairs share beyond the nominal one, over the mesh's mean one: thin rims and webs add some tenths, and
# teeth on solid bodies have some tenths less than finite elements give those.
CONTRAST, CONTRAST_SD, CONTRAST_LEAST, CONTRAST_LARGEST = "contrast", 0.2, -0.6, 1.0
CONTRAST_NAME = "compliance that tooth pairs share, beyond the nominal one, over that of the mesh"
BEYOND = 2.5  # standard deviations, from which other flanks are tried
STEP = 1e-4  # of the unknown, for the derivative of what keeps the mean


def contrast_groups() -> list[Group]:
    """The one mesh."""
    return [group(CONTRAST, "1", ("mesh",), CONTRAST_SD, slot="contrast", low=CONTRAST_LEAST, high=CONTRAST_LARGEST)]


def is_strange(unknowns: Unknowns, p: Array) -> bool:
    """Whether the mesh stiffness of unknowns (size,) changes as that of no body, rim or web does, so that the flanks
    may be others."""
    return bool(abs(p[unknowns[CONTRAST]][0]) > BEYOND * CONTRAST_SD) if CONTRAST in unknowns.slices else False


def other_flanks(unknowns: Unknowns, p: Array) -> tuple[str, ...]:
    """A sentence where what the pairs share ends at its bound: no body, rim or web does that."""
    more = float(p[unknowns[CONTRAST]][0])
    if CONTRAST_LEAST < more < CONTRAST_LARGEST:
        return ()
    return (
        f"The pairs of teeth would have to share {'less' if more < 0.0 else 'more'} compliance than the nominal one and"
        f" {more:+g} of the mesh's: check whether reliefs and profiles are those of the rig",
    )


def tangents_of(model: NominalModel) -> Array:
    """Tangent stiffness (phases,) [N/m] of the nominal mesh over its phase under the mean torque, without its scale."""
    law = model.hardened
    phases = np.arange(law.phases) / law.phases
    force = abs(model.torque_mean) / model.base_radius[0] / model.scale
    depth = law.approach[1:, None]
    forces, tangents = law.evaluate(depth, phases)
    return np.array([np.interp(force, forces[:, i], tangents[:, i]) for i in range(law.phases)])


def contrasted(rig: Rig, tangents: Array, unknowns: Unknowns, p: Array) -> Rig:
    """The rig whose pairs share more or less, with the mean stiffness that it has; `tangents` of the nominal mesh."""
    more = float(p[unknowns[CONTRAST]][0])
    if not more:
        return rig
    compliance = rig.mesh.shared_compliance + more / float(tangents.mean())
    return changed(rig, "mesh", shared_compliance=compliance, stiffness_scale=rig.mesh.stiffness_scale
                   * kept_mean(tangents, more))  # fmt: skip


def kept_mean(tangents: Array, more: float) -> float:
    """Factor on the force that keeps the mean stiffness of a mesh of `tangents` (phases,) [N/m] whose pairs share so
    much more of its mean compliance. Raises ValueError for less than there is."""
    left = 1.0 + more * tangents / tangents.mean()
    if left.min() <= 0.0:
        raise ValueError(f"pairs of teeth cannot share {more:+g} of the mesh's compliance beyond the nominal one")
    return float(tangents.mean() / np.mean(tangents / left))


def contrast_slope(tangents: Array, more: float, stiffness: Array) -> Array:
    """Relative change (n,) of a mesh force by the unknown, which has the value `more`, where the teeth's own law is of
    the stiffness (n,) [N/m]: what the pairs share yields under it, and the factor that keeps the mean."""
    high, low = (kept_mean(tangents, more + step) for step in (STEP, -STEP))
    return np.asarray(np.log(high / low) / (2 * STEP) - stiffness / tangents.mean())
