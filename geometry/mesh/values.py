"""Meshes as values: nodes and elements of one kind, a tooth sector with its named boundaries, a whole gear of sectors,
and the gears of a pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Kind(NamedTuple):
    """A kind of second-order element: its names for meshio and for the summary, and its number of corners."""

    name: str
    plural: str
    corners: int


# By number of nodes. Corners come first, counter-clockwise, then the middles of the sides 0-1, 1-2, ... and, of a
# quadrilateral, the centre. Of a solid: corners of the lower face, of the upper face, middles of the lower, the upper
# and the upright sides. So count gmsh, meshio, VTK and Abaqus.
KINDS = {
    6: Kind("triangle6", "triangles", 3),
    9: Kind("quad9", "quadrilaterals", 4),
    15: Kind("wedge15", "wedges", 6),
    20: Kind("hexahedron20", "hexahedra", 8),
}


@dataclass(frozen=True)
class Mesh:
    """Nodes and elements: `points` (n, 2) or, of solids, (n, 3) [m]; `cells` (m, k), whose k tells their kind."""

    points: Array
    cells: Index

    @property
    def kind(self) -> Kind:
        """What the elements are."""
        return KINDS[self.cells.shape[1]]

    @property
    def corners(self) -> Index:
        """The elements' corners (m, 3 or more)."""
        return self.cells[:, : self.kind.corners]

    @property
    def middles(self) -> Index:
        """The middles of a plane element's sides (m, 3 or 4), side 0 from corner 0 to corner 1."""
        return self.cells[:, self.kind.corners : 2 * self.kind.corners]


@dataclass(frozen=True)
class CrackNodes:
    """Where the mesh of a sector is cut: `faces` (k, 3), edges (corner, corner, middle) of both faces of the crack,
    none where it is healed; `line` (2 m + 1,), nodes along the crack from the fillet to the tip, corners and middles
    alternating, on its right side."""

    faces: Index
    line: Index


@dataclass(frozen=True)
class SectorMesh(Mesh):
    """One tooth sector between the polar angles -pi/z and +pi/z, from the hub circle to the profile.

    Node numbers: `cut_low`, `cut_high` on the radial cuts, ordered by radius (corners and middles alternate), equal
    under a rotation by 2 pi/z; `hub` on the hub circle by polar angle, ends of the cuts included; `boundary_edges`
    (k, 3) corner, corner, middle along tip land, flanks, fillets and root land by polar angle (counter-clockwise: the
    material lies to the left). `mirror[i]` is the node at (x, -y) of a sound sector, which is symmetric; a sector with
    a crack has `crack` instead.
    """

    teeth: int
    cut_low: Index
    cut_high: Index
    hub: Index
    boundary_edges: Index
    mirror: Index | None = None
    crack: CrackNodes | None = None

    @property
    def free_edges(self) -> Index:
        """All edges that may carry tractions: the boundary's and, where a crack is open, those of its faces."""
        return self.boundary_edges if self.crack is None else np.concatenate((self.boundary_edges, self.crack.faces))


@dataclass(frozen=True)
class GearMesh(Mesh):
    """A whole gear in its own frame, the axis of sector k at the polar angle 2 pi k/z.

    `sector` (m,): of each element; `hub` (h,): nodes of the hub circle, each once; `outlines[k]` (e, 3): boundary edges
    of sector k as in SectorMesh; `node_of[k]` (n,): number in the gear of each node of sector k.
    """

    sector: Index
    hub: Index
    outlines: tuple[Index, ...]
    node_of: tuple[Index, ...]

    @property
    def teeth(self) -> int:
        """Number of teeth."""
        return len(self.outlines)

    @property
    def boundary_edges(self) -> Index:
        """The outlines of all teeth (e, 3)."""
        return np.concatenate(self.outlines)


@dataclass(frozen=True)
class PairMesh(Mesh):
    """The gears of a pair, or one of them, plane or solid, in one frame; of each element the number of its `gear` (0:
    driver, 1: driven gear) and `tooth`, as the case numbers them: in order of meshing, the driver's clockwise."""

    gear: Index
    tooth: Index


def joined(parts: Sequence[PairMesh]) -> PairMesh:
    """Several meshes of the same kind, which share no nodes, as one."""
    first = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
    return PairMesh(
        points=np.concatenate([part.points for part in parts]),
        cells=np.concatenate([n + part.cells for part, n in zip(parts, first, strict=True)]),
        gear=np.concatenate([part.gear for part in parts]),
        tooth=np.concatenate([part.tooth for part in parts]),
    )
