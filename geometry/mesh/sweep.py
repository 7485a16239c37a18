"""Solid gears: a plane mesh swept along the axis, in layers of quadratic wedges or hexahedra.

Every section is the plane mesh itself, so the boundary nodes lie on the profile; the elements' determinants are those
of the plane ones times half the height of a layer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.values import KINDS, PairMesh, joined

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_LAYERS = 200
DEFAULT_LAYERS = 8

def swept(points: Array, cells: Index, width: float, layers: int = DEFAULT_LAYERS) -> tuple[Array, Index]:
    """Sweep plane cells (m, 6) or (m, 9) over the face width [m], centred on z = 0, in equal layers.

    Returns points (n, 3) and solids (layers m, 15 or 20). Raises GeometryError for a number of layers out of range.
    """
    if not 1 <= layers <= MOST_LAYERS:
        raise GeometryError(f"layers = {layers} must lie between 1 and {MOST_LAYERS}")
    k = KINDS[cells.shape[1]].corners
    section = np.unique(cells[:, : 2 * k])  # the centre of a quadrilateral has no place in a solid
    corner = np.unique(cells[:, :k])
    place, upright = np.full((2, len(points)), -1, dtype=np.int64)
    place[section] = np.arange(len(section))
    upright[corner] = (layers + 1) * len(section) + np.arange(len(corner))
    heights = np.linspace(-0.5 * width, 0.5 * width, layers + 1)
    between = 0.5 * (heights[1:] + heights[:-1])
    nodes = [_at(points[section], z) for z in heights] + [_at(points[corner], z) for z in between]
    low = place[cells[:, : 2 * k]]
    solids = []
    for layer in range(layers):
        down, up = low + layer * len(section), low + (layer + 1) * len(section)
        sides = upright[cells[:, :k]] + layer * len(corner)
        solids.append(np.column_stack((down[:, :k], up[:, :k], down[:, k:], up[:, k:], sides)))
    return np.concatenate(nodes), np.concatenate(solids)


def _at(points: Array, z: float) -> Array:
    return np.column_stack((points, np.full(len(points), z)))


def sweep(mesh: PairMesh, widths: tuple[float, float], layers: int = DEFAULT_LAYERS) -> PairMesh:
    """The gears of a plane mesh as solids, each over its own face width [m] about z = 0. Errors as in `swept`."""
    parts = []
    for number, width in enumerate(widths):
        chosen = mesh.gear == number
        if not chosen.any():
            continue
        used, cells = np.unique(mesh.cells[chosen], return_inverse=True)
        points, solids = swept(mesh.points[used], cells.reshape(-1, mesh.cells.shape[1]), width, layers)
        parts.append(PairMesh(points, solids, np.full(len(solids), number), np.tile(mesh.tooth[chosen], layers)))
    return joined(parts)
