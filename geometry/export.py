"""Meshes as files for gmsh (.msh) and ParaView (.vtu)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.files import written_whole
from gearbench.geometry.mesh import GearMesh, full_mesh, sector_mesh
from gearbench.geometry.pair import Pair, pair
from gearbench.geometry.profile import Profile
from gearbench.rig import Gear, Rig

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# meshio's names of the formats by suffix; gmsh's format 2.2 in ASCII is what every reader understands.
_FORMATS = {".msh": "gmsh22", ".vtu": "vtu"}


@dataclass(frozen=True)
class PlaneMesh:
    """Points (n, 2) [m], quadratic triangles (m, 6), and for each triangle the number of its gear (0, 1) and
    tooth."""

    points: Array
    triangles: Index
    gear: Index
    tooth: Index


def gear_plane(mesh: GearMesh, number: int = 0, angle: float = 0.0, centre: float = 0.0) -> PlaneMesh:
    """A full gear turned by `angle` [rad] and moved to x = `centre` [m], as gear `number`."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = mesh.points.T
    points = np.column_stack((centre + cosine * x - sine * y, sine * x + cosine * y))
    count = len(mesh.triangles)
    tooth = np.repeat(np.arange(mesh.teeth), count // mesh.teeth)
    return PlaneMesh(points, mesh.triangles, np.full(count, number), tooth)


def pair_plane(meshing: Pair, driver: GearMesh, driven: GearMesh) -> PlaneMesh:
    """Both gears in the world frame at mesh phase 0: both teeth 0 touch at the pitch point, unloaded."""
    one = gear_plane(driver, 0, meshing.driver_angle)
    two = gear_plane(driven, 1, pi + meshing.driven_angle, meshing.centre_distance)
    return PlaneMesh(
        points=np.concatenate((one.points, two.points)),
        triangles=np.concatenate((one.triangles, len(one.points) + two.triangles)),
        gear=np.concatenate((one.gear, two.gear)),
        tooth=np.concatenate((one.tooth, two.tooth)),
    )


def mesh_gear(tooth: Profile, gear: Gear, element_size: float | None = None) -> GearMesh:
    """The full gear's mesh; `element_size` as in `sector_mesh`."""
    return full_mesh(sector_mesh(tooth, gear, element_size))


def mesh_pair(rig: Rig, element_size: float | None = None) -> PlaneMesh:
    """Both gears of a rig, meshed and placed as in `pair_plane`."""
    meshing = pair(rig)
    driver = mesh_gear(meshing.driver, rig.driver, element_size)
    same = meshing.driver == meshing.driven and rig.driver.hub_radius == rig.driven.hub_radius
    driven = driver if same else mesh_gear(meshing.driven, rig.driven, element_size)
    return pair_plane(meshing, driver, driven)


def write_mesh(path: str | Path, mesh: PlaneMesh) -> Path:
    """Write a mesh in the format of the suffix, .msh or .vtu, coordinates in m.

    The file appears under its name only when complete. In .msh the gear's number + 1 is the physical group.
    Raises GeometryError for another suffix or a missing folder.
    """
    import meshio

    target = Path(path)
    if target.suffix not in _FORMATS:
        raise GeometryError(
            f"out = {target.name} has no known mesh format: the suffix must be .msh, .vtu, .dxf or .step"
        )
    cells = {"gear": [mesh.gear.astype(np.int32)], "tooth": [mesh.tooth.astype(np.int32)]}
    if target.suffix == ".msh":
        group = (mesh.gear + 1).astype(np.int32)
        cells = {"gmsh:physical": [group], "gmsh:geometrical": [group]}
    # The format's readers expect three coordinates.
    points = np.column_stack((mesh.points, np.zeros(len(mesh.points))))
    content = meshio.Mesh(points, [("triangle6", mesh.triangles)], cell_data=cells)
    options = {"binary": False} if target.suffix == ".msh" else {}
    return written_whole(
        target, lambda name: meshio.write(str(name), content, file_format=_FORMATS[target.suffix], **options)
    )
