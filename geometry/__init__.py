"""Gear geometry: exact profile, pair kinematics, bodies, data sheet, mesh and export."""

from gearbench.geometry.body import Body, body, gear_area, sector_area
from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh import GearMesh, MeshingUnavailable, SectorMesh, full_mesh, sector_mesh
from gearbench.geometry.pair import Pair, inverse_involute, pair
from gearbench.geometry.profile import Profile, profile
from gearbench.geometry.quality import Quality, quality

__all__ = [
    "Body",
    "GearMesh",
    "GeometryError",
    "MeshingUnavailable",
    "Pair",
    "Profile",
    "Quality",
    "SectorMesh",
    "body",
    "full_mesh",
    "gear_area",
    "inverse_involute",
    "pair",
    "profile",
    "quality",
    "sector_area",
    "sector_mesh",
]
