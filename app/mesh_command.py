"""`mesh CASE --out FILE`: the finite-element mesh as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from gearbench.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.progress import Progress

if TYPE_CHECKING:
    from gearbench.rig import Rig


def mesh(
    case: CaseArgument,
    out: Annotated[
        Path, typer.Option("--out", help="file to write: .msh (gmsh), .vtu (ParaView), .dxf or .step (outlines, mm)")
    ],
    gear: Annotated[
        Literal["both", "driver", "driven"], typer.Option("--gear", help="one gear in its own frame, or both")
    ] = "both",
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Mesh the gears of a case and write the mesh, or draw their outlines, at mesh phase 0, to a file."""
    loaded = load_case(case, settings)
    if out.suffix in (".dxf", ".step"):
        _draw(loaded.rig, out, gear, as_json)
        return
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


def _draw(rig: Rig, out: Path, which: str, as_json: bool) -> None:
    """Outlines of both gears where they stand at mesh phase 0, or of one of them."""
    from gearbench.geometry.drawing import placed_gears, write_dxf, write_step

    gears = [gear for gear in placed_gears(rig) if which in ("both", gear.name.lower())]
    with Progress("mesh") as progress:
        progress.step("drawing")
        (write_dxf if out.suffix == ".dxf" else write_step)(out, gears)
    if as_json:
        print_json({"file": str(out), "gears": len(gears), "unit": "mm"})
    else:
        typer.echo(f"{out}: {' and '.join(gear.name.lower() for gear in gears)}, in mm")
