"""One sound tooth sector as curved quadratic triangles: half of it is filled, the other half is its mirror image."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.mesh.element_size import flank_size
from gearbench.geometry.mesh.filling import fill, raise_order, ring_of, walk
from gearbench.geometry.mesh.grading import HalfBoundary, half_boundary
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# A mirrored triangle's nodes: it is turned over, so corners 0 and 1 change places, and the middles of 1-2 and 2-0.
TURNED = [1, 0, 2, 3, 5, 4]


def sector_mesh(gear_profile: Profile, gear: Gear, element_size: float | None = None) -> SectorMesh:
    """Mesh one tooth sector. `element_size` [m] on flanks and fillets; default module/12.

    Raises GeometryError for an element size outside (module/400, module/2), and MeshingUnavailable without
    gmsh.
    """
    size = flank_size(gear.module, element_size)
    return sector_within(gear_profile.teeth, half_boundary(gear_profile, gear.hub_radius, size))


def sector_within(teeth: int, boundary: HalfBoundary) -> SectorMesh:
    """The sector of a gear with that many teeth whose half has the given nodes on its boundary."""
    corners, triangles, _ = fill(ring_of(boundary.sides))
    points, half, sides = raise_order(corners, triangles, boundary.sides)
    return mirrored(teeth, points, half, sides, TURNED)


def mirrored(teeth: int, points: Array, half: Index, sides: list[Index], turned: list[int]) -> SectorMesh:
    """The whole sector from its counter-clockwise half; `turned` is the order of a mirrored cell's nodes."""
    outline, cut, hub, axis = sides
    on_axis = walk(axis)
    points[on_axis, 1] = 0.0
    n = len(points)
    image = np.full(n, -1, dtype=np.int64)
    image[on_axis] = on_axis
    free = np.flatnonzero(image < 0)
    image[free] = n + np.arange(len(free))
    low, high = image[walk(cut)][::-1], walk(cut)[::-1]
    points = np.concatenate((points, points[free] * [1.0, -1.0]))
    points[low] = points[high] @ rotation(-2 * pi / teeth).T
    return SectorMesh(
        points=points,
        cells=np.concatenate((half, image[half][:, turned])),
        teeth=teeth,
        cut_low=low,
        cut_high=high,
        hub=np.concatenate((image[walk(hub)], walk(hub)[-2::-1])),
        boundary_edges=np.concatenate((image[outline][::-1][:, [1, 0, 2]], outline)),
        mirror=np.concatenate((image, free)),
    )
