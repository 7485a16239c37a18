"""A crack in the mesh, in words and as the loss of stiffness by which the lumped model knows it."""

from __future__ import annotations

from math import degrees

from gearbench.geometry import Profile, pair
from gearbench.rig import Gear, Material, Rig

HALF_WIDTH = 0.05  # of the loaded stretch [modules]


def stiffness_loss(
    gear: Gear, shape: Profile, material: Material, element_size: float | None = None, modes: int = 8
) -> float:
    """Relative loss of bending stiffness of a gear's cracked tooth: the key that stands for the crack in a lumped case.

    What finite elements find the crack to add to the compliance of the flank at the reference circle, over the
    compliance of the sound tooth there by the potential energy method, which is what the lumped model lets grow.
    """
    # Imported on use: few gears have a crack, and elements take seconds to load.
    from gearbench.fem.gear.elasticity import plane_moduli
    from gearbench.fem.gear.patch import patch_compliance
    from gearbench.fem.gear.store import stored_gear
    from gearbench.lumped.stiffness.potential_energy import tooth_compliance

    condensed = stored_gear(gear, material, element_size, modes)
    s = (shape.reference_radius**2 - shape.base_radius**2) / (2 * shape.base_radius)
    room = min(s - shape.s_form, shape.s_end - s)
    half = min(HALF_WIDTH * shape.module, 0.9 * room)
    _, added = patch_compliance(condensed, plane_moduli(material), s, half)
    tooth = tooth_compliance(shape, gear.hub_radius, gear.face_width, material, shape.roll([s])).total.item()
    return added / (added + tooth * gear.face_width)


def crack_line(
    name: str, gear: Gear, shape: Profile, material: Material, element_size: float | None = None, modes: int = 8
) -> str | None:
    """One sentence on the crack of a gear with one in its mesh."""
    crack = gear.crack
    if crack is None or not crack.length or crack.direction is None:
        return None
    loss = stiffness_loss(gear, shape, material, element_size, modes)
    return (
        f"{name}: crack of {1e3 * crack.length:.4g} mm in tooth {crack.tooth}, {degrees(crack.direction):.4g} degrees"
        f" to its centre line from the {degrees(crack.start):.4g}-degree tangent of the fillet; in the lumped"
        f" model stiffness_loss = {loss:.3g}"
    )


def crack_lines(rig: Rig, element_size: float | None = None, modes: int = 8) -> list[str]:
    """`crack_line` of both gears, where they have one. Raises GeometryError for a crack that does not fit."""
    if not any(gear.crack and gear.crack.meshed for gear in (rig.driver, rig.driven)):
        return []
    meshing = pair(rig)
    gears = (("driver", rig.driver, meshing.driver), ("driven", rig.driven, meshing.driven))
    lines = (crack_line(name, gear, shape, rig.material, element_size, modes) for name, gear, shape in gears)
    return [line for line in lines if line]
