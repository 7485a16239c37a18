"""The mesh of one tooth sector, of the kind of elements that the case asks for."""

from __future__ import annotations

from typing import Literal

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.quads import quad_sector_mesh
from gearbench.geometry.mesh.sector_mesh import sector_mesh
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Element = Literal["triangle", "quadrilateral"]


def meshed_sector(
    tooth: Profile, gear: Gear, element_size: float | None = None, element: Element = "triangle"
) -> SectorMesh:
    """One sound tooth sector of quadratic triangles or biquadratic quadrilaterals. `element_size` [m] and errors as in
    `sector_mesh`."""
    if element == "quadrilateral":
        return quad_sector_mesh(tooth, gear, element_size)
    return sector_mesh(tooth, gear, element_size)


def refuse_crack(gear: Gear, element: Element, name: str = "gear", key: str = "element") -> None:
    """Raise GeometryError for a crack in a mesh of quadrilaterals; `name` and `key`: of gear and element in the case or
    on the command line."""
    if gear.crack is not None and gear.crack.meshed and element != "triangle":
        raise GeometryError(
            f'{name}.crack cannot be meshed with {key} = "{element}": a crack with a length runs between triangles'
        )
