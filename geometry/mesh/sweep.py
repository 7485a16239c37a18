"""Solid gears: a plane mesh swept along the axis, in layers of quadratic wedges or hexahedra.

Every section is the plane mesh itself, so the boundary nodes lie on the profile; the elements' determinants are those
of the plane ones times half the height of a layer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_LAYERS = 200
DEFAULT_LAYERS = 8
# Corners of the plane elements by their number of nodes.
_CORNERS = {6: 3, 9: 4}


@dataclass(frozen=True)
class SolidMesh:
    """Points (n, 3) [m]; `cells` (m, 15) wedges or (m, 20) hexahedra: corners of the lower face counter-clockwise, of
    the upper face, middles of the lower, the upper and the upright sides (VTK and Abaqus order); for each the number of
    its gear (0, 1) and tooth."""

    points: Array
    cells: Index
    gear: Index
    tooth: Index

    @property
    def kind(self) -> str:
        """meshio's name of the elements."""
        return {15: "wedge15", 20: "hexahedron20"}[self.cells.shape[1]]


def swept(points: Array, cells: Index, width: float, layers: int = DEFAULT_LAYERS) -> tuple[Array, Index]:
    """Sweep plane cells (m, 6) or (m, 9) over the face width [m], centred on z = 0, in equal layers.

    Returns points (n, 3) and solids (layers m, 15 or 20). Raises GeometryError for a number of layers out of range.
    """
    if not 1 <= layers <= MOST_LAYERS:
        raise GeometryError(f"layers = {layers} must lie between 1 and {MOST_LAYERS}")
    k = _CORNERS[cells.shape[1]]
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


def joined(parts: Sequence[SolidMesh]) -> SolidMesh:
    """Several solids, which share no nodes, as one mesh."""
    first = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
    return SolidMesh(
        points=np.concatenate([part.points for part in parts]),
        cells=np.concatenate([part.cells + n for part, n in zip(parts, first, strict=True)]),
        gear=np.concatenate([part.gear for part in parts]),
        tooth=np.concatenate([part.tooth for part in parts]),
    )
