"""Damping of the mesh that grows with its load, as an unknown around "not at all": films and joints of real teeth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import changed
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Case, Damping, Rig

Array = NDArray[np.float64]

# Exponent of the damping over the elastic force in the mesh: that of teeth is between none and in proportion to it.
LOADED, LOADED_SD, LOADED_LARGEST = "damping-load", 0.4, 2.0
LOADED_NAME = "exponent of mesh damping over normal force"


def viscous_groups(nominal: Case, model: NominalModel) -> list[Group]:
    """The exponent beyond the nominal one; none for a nominal rig whose own model has another law of damping."""
    if nominal.simulation.model != "lumped":
        return []
    own = nominal.rig.damping.mesh_exponent
    return [group(LOADED, "1", ("mesh",), LOADED_SD, slot="viscous", low=-own, high=LOADED_LARGEST - own)]


def damping_reference(damping: Damping, model: NominalModel) -> float:
    """Force [N] at which the exponent changes nothing: that of the rig, or that under the mean torque."""
    return damping.mesh_reference_force if damping.mesh_exponent else abs(model.torque_mean) / model.base_radius[0]


def viscous(rig: Rig, model: NominalModel, unknowns: Unknowns, p: Array) -> Rig:
    """The rig with damping of that exponent, about the force under the mean torque where the nominal rig has none."""
    if LOADED not in unknowns.slices or not p[unknowns[LOADED]][0]:
        return rig
    own = rig.damping
    about = damping_reference(own, model)
    exponent = own.mesh_exponent + float(p[unknowns[LOADED]][0])
    return changed(rig, "damping", mesh_exponent=exponent, mesh_reference_force=about)
