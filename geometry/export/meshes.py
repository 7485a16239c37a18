"""Meshes as files for gmsh (.msh), ParaView (.vtu) and, as elements without a load, CalculiX (.inp)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.export.files import written_whole
from gearbench.geometry.mesh.cracked_gear import CrackedGearMesh, cracked_mesh
from gearbench.geometry.mesh.quads import QuadGearMesh, QuadSectorMesh, full_quads
from gearbench.geometry.mesh.sector import Element, meshed_sector, refuse_crack
from gearbench.geometry.mesh.sector_mesh import GearMesh, full_mesh
from gearbench.geometry.mesh.sweep import DEFAULT_LAYERS, SolidMesh, joined, swept
from gearbench.geometry.pair.kinematics import Pair, pair
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear, Rig

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Direction in which the case numbers the teeth of driver and driven gear; 1: counter-clockwise.
ORDER = (-1, 1)
FullMesh = GearMesh | QuadGearMesh | CrackedGearMesh

# meshio's names of the formats by suffix; gmsh's format 2.2 in ASCII is what every reader understands.
_FORMATS = {".msh": "gmsh22", ".vtu": "vtu"}


@dataclass(frozen=True)
class PlaneMesh:
    """Points (n, 2) [m], quadratic triangles (m, 6) or quadrilaterals (m, 9), and for each of them the number of its
    gear (0, 1) and tooth, as the case numbers them: in order of meshing, the driver's clockwise."""

    points: Array
    triangles: Index
    gear: Index
    tooth: Index

    @property
    def kind(self) -> str:
        """meshio's name of the elements."""
        return {6: "triangle6", 9: "quad9"}[self.triangles.shape[1]]


def gear_plane(mesh: FullMesh, number: int = 0, angle: float = 0.0, centre: float = 0.0) -> PlaneMesh:
    """A full gear turned by `angle` [rad] and moved to x = `centre` [m], as gear `number`."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = mesh.points.T
    points = np.column_stack((centre + cosine * x - sine * y, sine * x + cosine * y))
    count = len(mesh.cells)
    if isinstance(mesh, CrackedGearMesh):
        sector = mesh.sector
    else:
        sector = np.repeat(np.arange(mesh.teeth), count // mesh.teeth)
    return PlaneMesh(points, mesh.cells, np.full(count, number), ORDER[number] * sector % mesh.teeth)


def pair_plane(meshing: Pair, driver: FullMesh, driven: FullMesh) -> PlaneMesh:
    """Both gears in the world frame at mesh phase 0: both teeth 0 touch at the pitch point, unloaded."""
    one = gear_plane(driver, 0, meshing.driver_angle)
    two = gear_plane(driven, 1, pi + meshing.driven_angle, meshing.centre_distance)
    return PlaneMesh(
        points=np.concatenate((one.points, two.points)),
        triangles=np.concatenate((one.triangles, len(one.points) + two.triangles)),
        gear=np.concatenate((one.gear, two.gear)),
        tooth=np.concatenate((one.tooth, two.tooth)),
    )


def mesh_gear(
    tooth: Profile,
    gear: Gear,
    element_size: float | None = None,
    element: Element = "triangle",
    number: Literal[0, 1] = 0,
) -> FullMesh:
    """The full mesh of the driver (`number` 0) or the driven gear (1), a crack that has a length open in its tooth;
    `element_size` as in `sector_mesh`. Raises GeometryError."""
    name = ("rig.driver", "rig.driven")[number]
    if gear.crack is not None and gear.crack.meshed:
        refuse_crack(gear, element, name)
        return cracked_mesh(tooth, gear, element_size, order=ORDER[number], name=name)
    sector = meshed_sector(tooth, gear, element_size, element)
    return full_quads(sector) if isinstance(sector, QuadSectorMesh) else full_mesh(sector)


def mesh_pair(rig: Rig, element_size: float | None = None, element: Element = "triangle") -> PlaneMesh:
    """Both gears of a rig, meshed and placed as in `pair_plane`."""
    meshing = pair(rig)
    driver = mesh_gear(meshing.driver, rig.driver, element_size, element)
    same = meshing.driver == meshing.driven and rig.driver.hub_radius == rig.driven.hub_radius
    same = same and rig.driver.crack is None and rig.driven.crack is None
    driven = driver if same else mesh_gear(meshing.driven, rig.driven, element_size, element, 1)
    return pair_plane(meshing, driver, driven)


def write_mesh(path: str | Path, mesh: PlaneMesh | SolidMesh) -> Path:
    """Write a mesh in the format of the suffix, .msh, .vtu or, of solids, .inp; coordinates in m (.inp: mm).

    The file appears under its name only when complete. In .msh the gear's number + 1 is the physical group.
    Raises GeometryError for another suffix or a missing folder.
    """
    import meshio

    target = Path(path)
    if target.suffix == ".inp" and isinstance(mesh, SolidMesh):
        return written_whole(target, lambda name: _write_solid(name, mesh))
    if target.suffix not in _FORMATS:
        raise GeometryError(
            f"out = {target.name} has no known mesh format: the suffix must be .msh, .vtu, .inp, .dxf or .step"
        )
    cells = {"gear": [mesh.gear.astype(np.int32)], "tooth": [mesh.tooth.astype(np.int32)]}
    if target.suffix == ".msh":
        group = (mesh.gear + 1).astype(np.int32)
        cells = {"gmsh:physical": [group], "gmsh:geometrical": [group]}
    if isinstance(mesh, SolidMesh):
        # meshio writes these wedges but has forgotten them in its table of dimensions (5.3.5).
        meshio._mesh.topological_dimension.setdefault("wedge15", 3)
        points, elements = mesh.points, mesh.cells
    else:
        # The format's readers expect three coordinates.
        points, elements = np.column_stack((mesh.points, np.zeros(len(mesh.points)))), mesh.triangles
    content = meshio.Mesh(points, [(mesh.kind, elements)], cell_data=cells)
    options = {"binary": False} if target.suffix == ".msh" else {}
    return written_whole(
        target, lambda name: meshio.write(str(name), content, file_format=_FORMATS[target.suffix], **options)
    )


def _write_solid(path: Path, mesh: SolidMesh) -> None:
    """Nodes in mm, and the elements of each gear as a set, for CalculiX to include."""
    kind = {"wedge15": "C3D15", "hexahedron20": "C3D20"}[mesh.kind]
    with path.open("w", encoding="ascii") as file:
        file.write(
            "** Swept gears; mm. Elements only: supports, contacts and loads are the reader's\n*NODE, NSET=NALL\n"
        )
        file.writelines(f"{i}, {x:.12g}, {y:.12g}, {z:.12g}\n" for i, (x, y, z) in enumerate(1e3 * mesh.points, 1))
        for number, name in enumerate(("DRIVER", "DRIVEN")):
            chosen = np.flatnonzero(mesh.gear == number)
            if not len(chosen):
                continue
            file.write(f"*ELEMENT, TYPE={kind}, ELSET=E_{name}\n")
            for element, nodes in zip(chosen.tolist(), (mesh.cells[chosen] + 1).tolist(), strict=True):
                # A line holds sixteen entries at most.
                first, rest = ", ".join(map(str, nodes[:10])), ", ".join(map(str, nodes[10:]))
                file.write(f"{element + 1}, {first},\n{rest}\n")


def sweep_plane(mesh: PlaneMesh, widths: tuple[float, float], layers: int = DEFAULT_LAYERS) -> SolidMesh:
    """The gears of a plane mesh as solids, each over its own face width [m] about z = 0. Errors as in `swept`."""
    parts = []
    for number, width in enumerate(widths):
        chosen = mesh.gear == number
        if not chosen.any():
            continue
        used, cells = np.unique(mesh.triangles[chosen], return_inverse=True)
        points, solids = swept(mesh.points[used], cells.reshape(-1, mesh.triangles.shape[1]), width, layers)
        tooth = np.tile(mesh.tooth[chosen], layers)
        parts.append(SolidMesh(points, solids, np.full(len(solids), number), tooth))
    return joined(parts)
