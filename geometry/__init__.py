"""Gear geometry: exact profile, pair kinematics, bodies, data sheet, mesh and export.

`tooth`: one gear: profile, fillet, flank deviations, crack, what may be. `pair`: kinematics, interference, data sheet,
zones of contact. `mesh`: finite-element meshes of tooth sectors and gears. `export`: files for other programs.
"""

from gearbench.geometry.error import GeometryError
from gearbench.geometry.export.meshes import PlaneMesh, mesh_pair, write_mesh
from gearbench.geometry.mesh.quality import Quality, quality
from gearbench.geometry.mesh.sector_mesh import GearMesh, MeshingUnavailable, SectorMesh, full_mesh, sector_mesh
from gearbench.geometry.pair.datasheet import Datum, data_sheet
from gearbench.geometry.pair.kinematics import Pair, inverse_involute, pair
from gearbench.geometry.tooth.body import Body, body, gear_area, sector_area
from gearbench.geometry.tooth.profile import Profile, profile

__all__ = [
    "Body",
    "Datum",
    "GearMesh",
    "GeometryError",
    "MeshingUnavailable",
    "Pair",
    "PlaneMesh",
    "Profile",
    "Quality",
    "SectorMesh",
    "body",
    "data_sheet",
    "full_mesh",
    "gear_area",
    "inverse_involute",
    "mesh_pair",
    "pair",
    "profile",
    "quality",
    "sector_area",
    "sector_mesh",
    "write_mesh",
]
