"""Force that stands for the form of the flanks along a motion: what they have more where they touch, which is beside
the place where involutes would as far as they slope (`geometry.pair.touching`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import on_path
from gearbench.geometry import Pair
from gearbench.geometry.pair.touching import touching
from gearbench.rig import Rig
from gearbench.rig.neutral import without_reliefs

if TYPE_CHECKING:
    from gearbench.bench.nonlinear.along import Along
    from gearbench.lumped.nonlinear.law import MeshLaw

Array = NDArray[np.float64]


def in_mesh_of_form(along: Along, meshing: Pair, travel: Array) -> Array:
    """Force (entries, parts) [N] in the mesh per unit of each part of a form along the path of contact, on all pairs,
    which are `travel` (entries, n_o) [base pitches] behind the pitch point."""
    places, parts = parts_where_touching(along.model.rig, meshing, along.law)
    shape = np.stack([np.interp(travel, places, part) for part in parts])
    return np.asarray((shape * along.form_stiffness).sum(axis=-1).T)


def parts_where_touching(rig: Rig, meshing: Pair, law: MeshLaw) -> tuple[Array, Array]:
    """Distances (places,) behind the pitch point [base pitches] where involutes would touch, and each part of a form
    (parts, places) where the rig's flanks do. A part is the driver's behind the middle of the path and the driven
    gear's before it (`effects.profile_error.add`). That the contact moves on with more of a form takes nothing in first
    order: it is where flanks close the mesh most."""
    found = touching(meshing, (without_reliefs(rig.driver), without_reliefs(rig.driven)))
    one, two = law.pitch_roll
    places = (found.involute - one) / law.base_pitch
    on_driver, on_driven = (found.driver - one) / law.base_pitch, (two - found.driven) / law.base_pitch
    middle = np.full(1, 0.5 * sum(meshing.path))
    behind, before = np.maximum(on_driver, middle), np.minimum(on_driven, middle)
    return places, sum(on_path(travel, meshing.path) for travel in (behind, before)) - on_path(middle, meshing.path)
