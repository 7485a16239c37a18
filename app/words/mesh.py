"""What `mesh` says of the mesh that it has written."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearbench.geometry import PairMesh

def mesh_report(plane: PairMesh, solid: PairMesh | None) -> dict[str, Any]:
    """Counts and quality of what was written. A solid's section is the plane mesh, whose quality is its own."""
    from gearbench.geometry import quality

    flat = quality(plane)
    found: dict[str, Any] = {plane.kind.plural: flat.elements, "nodes": flat.nodes}
    found["smallest_angle_deg"] = degrees(flat.angle)
    if plane.kind.corners == 4:
        found["largest_angle_deg"] = degrees(flat.widest)
    found["smallest_relative_jacobian"] = flat.jacobian
    if solid is not None:
        found |= {solid.kind.plural: len(solid.cells), "nodes": len(solid.points)}
    return found


def report_line(summary: Mapping[str, Any]) -> str:
    """The report in a line."""
    kinds = [kind for kind in ("wedges", "hexahedra", "triangles", "quadrilaterals") if kind in summary]
    angles = f"smallest angle {summary['smallest_angle_deg']:.1f} deg"
    if "largest_angle_deg" in summary:
        angles += f", largest {summary['largest_angle_deg']:.1f} deg"
    on = f" (sections of {summary[kinds[1]]} {kinds[1]})" if len(kinds) > 1 else ""
    return (
        f"{summary['file']}: {summary[kinds[0]]} {kinds[0]}{on}, {summary['nodes']} nodes, {angles}, smallest relative"
        f" Jacobian {summary['smallest_relative_jacobian']:.2f}"
    )
