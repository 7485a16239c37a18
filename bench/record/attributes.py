"""What a record says about its rig."""

from __future__ import annotations

from typing import Any

from gearbench.geometry import Body, Pair
from gearbench.rig import Rig


def rig_attributes(rig: Rig, meshing: Pair, bodies: tuple[Body, Body]) -> dict[str, Any]:
    """Record attributes of teeth, base radii [m], inertias [kg m^2], pressure angle [rad] and boundaries."""
    return {
        "teeth_driver": rig.driver.teeth,
        "teeth_driven": rig.driven.teeth,
        "base_radius_driver": meshing.driver.base_radius,
        "base_radius_driven": meshing.driven.base_radius,
        "inertia_driver": bodies[0].inertia,
        "inertia_driven": bodies[1].inertia,
        "working_pressure_angle": meshing.working_pressure_angle,
        "support_direction": rig.support.direction,
        "driven_boundary": rig.load.boundary,
    }


def lost_contact(lost: int, total: int) -> str | None:
    """Warning where the teeth separate: the response then is not that of a linear system."""
    if not lost:
        return None
    return (
        f"the teeth are out of contact in {lost} of {total} samples, so the rig is not linear and its identified"
        " response depends on the excitation"
    )
