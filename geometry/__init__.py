"""Gear geometry: exact profile, pair kinematics, bodies, data sheet, mesh and export.

`tooth`: one gear: profile, fillet, flank deviations, crack, what may be. `pair`: kinematics, interference, data sheet,
zones of contact. `mesh`: finite-element meshes of tooth sectors and gears. `export`: files for other programs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearbench.files import names_on_use
from gearbench.geometry.error import GeometryError
from gearbench.geometry.pair.datasheet import Datum, data_sheet
from gearbench.geometry.pair.kinematics import Pair, inverse_involute, pair
from gearbench.geometry.tooth.body import Body, body, gear_area, sector_area
from gearbench.geometry.tooth.profile import Profile, profile

if TYPE_CHECKING:
    from gearbench.geometry.export.meshes import write_mesh
    from gearbench.geometry.mesh.assembly import full_mesh
    from gearbench.geometry.mesh.filling import MeshingUnavailable
    from gearbench.geometry.mesh.gears import mesh_pair
    from gearbench.geometry.mesh.quality import Quality, quality
    from gearbench.geometry.mesh.sector_mesh import sector_mesh
    from gearbench.geometry.mesh.values import GearMesh, Mesh, PairMesh, SectorMesh

__all__ = [
    "Body",
    "Datum",
    "GearMesh",
    "GeometryError",
    "Mesh",
    "MeshingUnavailable",
    "Pair",
    "PairMesh",
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

_HOMES = {
    "GearMesh": "gearbench.geometry.mesh.values",
    "Mesh": "gearbench.geometry.mesh.values",
    "MeshingUnavailable": "gearbench.geometry.mesh.filling",
    "PairMesh": "gearbench.geometry.mesh.values",
    "Quality": "gearbench.geometry.mesh.quality",
    "SectorMesh": "gearbench.geometry.mesh.values",
    "full_mesh": "gearbench.geometry.mesh.assembly",
    "mesh_pair": "gearbench.geometry.mesh.gears",
    "quality": "gearbench.geometry.mesh.quality",
    "sector_mesh": "gearbench.geometry.mesh.sector_mesh",
    "write_mesh": "gearbench.geometry.export.meshes",
}

# Imported on use: a data sheet needs no meshes.
__getattr__ = names_on_use(__name__, _HOMES)
