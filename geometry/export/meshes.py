"""Meshes as files for gmsh (.msh), ParaView (.vtu) and, as elements without a load, CalculiX (.inp)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearbench.files import write_whole
from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.values import PairMesh

# meshio's names of the formats by suffix; gmsh's format 2.2 in ASCII is what every reader understands.
_FORMATS = {".msh": "gmsh22", ".vtu": "vtu"}


def write_mesh(path: str | Path, mesh: PairMesh) -> Path:
    """Write a mesh in the format of the suffix, .msh, .vtu or, of solids, .inp; coordinates in m (.inp: mm).

    The file appears under its name only when complete. In .msh the gear's number + 1 is the physical group.
    Raises GeometryError for another suffix, FileError for a file that cannot be written.
    """
    import meshio

    target = Path(path)
    solid = mesh.points.shape[1] == 3
    if target.suffix == ".inp" and solid:
        return write_whole(target, lambda name: _write_solid(name, mesh))
    if target.suffix not in _FORMATS:
        raise GeometryError(
            f"out = {target.name} has no known mesh format: the suffix must be .msh, .vtu, .inp, .dxf or .step"
        )
    cells = {"gear": [mesh.gear.astype(np.int32)], "tooth": [mesh.tooth.astype(np.int32)]}
    if target.suffix == ".msh":
        group = (mesh.gear + 1).astype(np.int32)
        cells = {"gmsh:physical": [group], "gmsh:geometrical": [group]}
    # meshio writes these wedges but has forgotten them in its table of dimensions (5.3.5).
    meshio._mesh.topological_dimension.setdefault("wedge15", 3)
    # The formats' readers expect three coordinates.
    points = mesh.points if solid else np.column_stack((mesh.points, np.zeros(len(mesh.points))))
    content = meshio.Mesh(points, [(mesh.kind.name, mesh.cells)], cell_data=cells)
    options = {"binary": False} if target.suffix == ".msh" else {}
    return write_whole(
        target, lambda name: meshio.write(str(name), content, file_format=_FORMATS[target.suffix], **options)
    )


def _write_solid(path: Path, mesh: PairMesh) -> None:
    """Nodes in mm, and the elements of each gear as a set, for CalculiX to include."""
    kind = {"wedge15": "C3D15", "hexahedron20": "C3D20"}[mesh.kind.name]
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

