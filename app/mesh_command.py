"""`mesh CASE --out FILE`: the finite-element mesh as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from gearbench.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.progress import Progress

if TYPE_CHECKING:
    from gearbench.rig import Case, Rig


def mesh(
    case: CaseArgument,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            help="file to write: .msh (gmsh), .vtu (ParaView), .inp (contact model for CalculiX, mm), .dxf or .step"
            " (outlines, mm)",
        ),
    ],
    gear: Annotated[
        Literal["both", "driver", "driven"], typer.Option("--gear", help="one gear in its own frame, or both")
    ] = "both",
    phase: Annotated[float | None, typer.Option("--phase", help="mesh phase of the contact model; absent: 0")] = None,
    torque_nm: Annotated[
        float | None, typer.Option("--torque-nm", help="driver torque of the contact model; absent: the case's mean")
    ] = None,
    dte_um: Annotated[
        float | None, typer.Option("--dte-um", help="its transmission error in um, instead of a torque")
    ] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Mesh the gears of a case and write the mesh, or draw their outlines, at mesh phase 0, to a file.

    To a file .inp it writes both gears in contact, for CalculiX to find the torque at a given transmission error.
    """
    loaded = load_case(case, settings)
    if out.suffix == ".inp":
        _contact(loaded, case, out, phase or 0.0, torque_nm, dte_um, as_json)
        return
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


def _contact(
    case: Case, name: str, out: Path, phase: float, torque_nm: float | None, dte_um: float | None, as_json: bool
) -> None:
    """The contact model for CalculiX, and what it should find."""
    from gearbench.bench.calculix import contact_model
    from gearbench.geometry.calculix import write_deck

    with Progress("mesh") as progress:
        progress.step("contact")
        dte = None if dte_um is None else 1e-6 * dte_um
        model = contact_model(case, phase, dte=dte, torque=torque_nm, name=name)
        progress.step("writing")
        write_deck(out, model.deck)
    summary = {
        "file": str(out),
        "nodes": sum(len(gear.mesh.points) for gear in model.deck.gears),
        "mesh_phase": model.phase,
        "dte_um": 1e6 * model.dte,
        "expected_torque_driver_nm": model.torques[0],
        "expected_torque_driven_nm": model.torques[1],
        "tolerance_percent": model.tolerance,
    }
    if as_json:
        print_json(summary)
        return
    typer.echo(
        f"{out}: contact at mesh phase {model.phase:g}, DTE {summary['dte_um']:.6g} um, {summary['nodes']} nodes; ccx"
        f" should find {model.torques[0]:.6g} N m at the driver and {model.torques[1]:.6g} N m at the driven gear,"
        f" within {model.tolerance:g} % (how to read its result: the comment at the head of the file)"
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
