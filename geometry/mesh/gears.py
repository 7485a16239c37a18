"""The gears of a rig as whole meshes, each in its own frame or both where they touch."""

from __future__ import annotations

from math import pi
from typing import Literal

import numpy as np

from gearbench.geometry.mesh.assembly import full_mesh, with_sector
from gearbench.geometry.mesh.cracked_sector import cracked_sector
from gearbench.geometry.mesh.sector import Element, meshed_sector, refuse_crack
from gearbench.geometry.mesh.sector_mesh import sector_mesh
from gearbench.geometry.mesh.values import GearMesh, PairMesh, joined
from gearbench.geometry.pair.kinematics import Pair, pair
from gearbench.geometry.pair.numbering import sector_of
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear, Rig


def gear_plane(mesh: GearMesh, number: int = 0, angle: float = 0.0, centre: float = 0.0) -> PairMesh:
    """A full gear turned by `angle` [rad] and moved to x = `centre` [m], as gear `number`."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = mesh.points.T
    points = np.column_stack((centre + cosine * x - sine * y, sine * x + cosine * y))
    return PairMesh(points, mesh.cells, np.full(len(mesh.cells), number), sector_of(mesh.sector, number, mesh.teeth))


def pair_plane(meshing: Pair, driver: GearMesh, driven: GearMesh) -> PairMesh:
    """Both gears in the world frame at mesh phase 0: both teeth 0 touch at the pitch point, unloaded."""
    one = gear_plane(driver, 0, meshing.driver_angle)
    two = gear_plane(driven, 1, pi + meshing.driven_angle, meshing.centre_distance)
    return joined((one, two))


def mesh_gear(
    tooth: Profile,
    gear: Gear,
    element_size: float | None = None,
    element: Element = "triangle",
    number: Literal[0, 1] = 0,
) -> GearMesh:
    """The full mesh of the driver (`number` 0) or the driven gear (1), a crack that has a length open in its tooth;
    `element_size` as in `sector_mesh`. Raises GeometryError."""
    name = ("rig.driver", "rig.driven")[number]
    if gear.crack is not None and gear.crack.meshed:
        refuse_crack(gear, element, name)
        place = sector_of(gear.crack.tooth, number, tooth.teeth)
        odd = cracked_sector(tooth, gear, element_size, name=name)
        return with_sector(sector_mesh(tooth, gear, element_size), odd, place)
    return full_mesh(meshed_sector(tooth, gear, element_size, element))


def mesh_pair(rig: Rig, element_size: float | None = None, element: Element = "triangle") -> PairMesh:
    """Both gears of a rig, meshed and placed as in `pair_plane`."""
    meshing = pair(rig)
    driver = mesh_gear(meshing.driver, rig.driver, element_size, element)
    same = meshing.driver == meshing.driven and rig.driver.hub_radius == rig.driven.hub_radius
    same = same and rig.driver.crack is None and rig.driven.crack is None
    driven = driver if same else mesh_gear(meshing.driven, rig.driven, element_size, element, 1)
    return pair_plane(meshing, driver, driven)
