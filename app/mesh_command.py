"""`mesh CASE --out FILE`: the finite-element mesh as a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from gearbench.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.progress import Progress


def mesh(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="file to write: .msh (gmsh) or .vtu (ParaView)")],
    gear: Annotated[
        Literal["both", "driver", "driven"], typer.Option("--gear", help="one gear in its own frame, or both")
    ] = "both",
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Mesh the gears of a case and write the mesh to a file."""
    loaded = load_case(case, settings)
    from gearbench.geometry import mesh_pair, pair, quality, write_mesh
    from gearbench.geometry.export import gear_plane, mesh_gear

    size = loaded.simulation.element_size
    with Progress("mesh") as progress:
        progress.step("meshing")
        if gear == "both":
            plane = mesh_pair(loaded.rig, size)
        else:
            meshing = pair(loaded.rig)
            tooth, body = getattr(meshing, gear), getattr(loaded.rig, gear)
            plane = gear_plane(mesh_gear(tooth, body, size), ("driver", "driven").index(gear))
        progress.step("writing")
        write_mesh(out, plane)
        found = quality(plane.points, plane.triangles)
    summary = {
        "file": str(out),
        "triangles": found.triangles,
        "nodes": found.nodes,
        "smallest_angle_deg": found.angle * 57.29577951308232,
        "smallest_relative_jacobian": found.jacobian,
    }
    if as_json:
        print_json(summary)
    else:
        typer.echo(
            f"{out}: {found.triangles} triangles, {found.nodes} nodes, smallest angle"
            f" {summary['smallest_angle_deg']:.1f} deg, smallest relative Jacobian {found.jacobian:.2f}"
        )
