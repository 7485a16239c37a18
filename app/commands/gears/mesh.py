"""`mesh CASE --out FILE`: the finite-element mesh as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gearbench.commands.gears.mesh_options import check_crack, check_mesh_options
from gearbench.shell.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.shell.progress import Progress
from gearbench.words.mesh import mesh_report, report_line

if TYPE_CHECKING:
    from gearbench.rig import Case, Rig


def mesh(
    case: CaseArgument,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            help="file to write: .msh (gmsh), .vtu (ParaView), .inp (CalculiX, mm: the pair in contact or, with"
            " --dimension 3, elements), .dxf or .step (outlines, mm)",
        ),
    ],
    gear: Annotated[
        Literal["both", "driver", "driven"], typer.Option("--gear", help="one gear in its own frame, or both")
    ] = "both",
    element: Annotated[
        Literal["triangle", "quadrilateral"] | None,
        typer.Option("--element", help="kind of the plane elements; absent: the case's simulation.element"),
    ] = None,
    dimension: Annotated[
        int, typer.Option("--dimension", help="2, or 3: swept over the face width to wedges or hexahedra")
    ] = 2,
    layers: Annotated[int | None, typer.Option("--layers", help="layers over the face width; absent: 8")] = None,
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
    contact = {"--phase": phase, "--torque-nm": torque_nm, "--dte-um": dte_um}
    check_mesh_options(out, dimension=dimension, layers=layers, element=element, gear=gear, contact=contact)
    if out.suffix == ".inp" and dimension == 2:
        _contact(loaded, case, out, phase or 0.0, torque_nm, dte_um, as_json)
        return
    if out.suffix in (".dxf", ".step"):
        check_crack(loaded.rig, gear, out)
        _draw(loaded.rig, out, gear, as_json)
        return
    check_crack(loaded.rig, gear, out, element, loaded.simulation.element)
    from gearbench.geometry.mesh.sweep import DEFAULT_LAYERS

    kind = element or loaded.simulation.element
    summary = _write_elements(loaded, out, gear, kind, layers or DEFAULT_LAYERS if dimension == 3 else None)
    if as_json:
        print_json(summary)
    else:
        typer.echo(report_line(summary))


def _write_elements(
    case: Case,
    out: Path,
    gear: Literal["both", "driver", "driven"],
    element: Literal["triangle", "quadrilateral"],
    layers: int | None,
) -> dict[str, Any]:
    """The elements of one gear or both, swept if there are layers; a summary."""
    from gearbench.geometry import mesh_pair, pair, write_mesh
    from gearbench.geometry.mesh.gears import gear_plane, mesh_gear
    from gearbench.geometry.mesh.sweep import sweep

    rig, size = case.rig, case.simulation.element_size
    with Progress("mesh") as progress:
        progress.step("meshing")
        if gear == "both":
            plane = mesh_pair(rig, size, element)
        else:
            tooth, body = getattr(pair(rig), gear), getattr(rig, gear)
            number: Literal[0, 1] = 0 if gear == "driver" else 1
            plane = gear_plane(mesh_gear(tooth, body, size, element, number), number)
        widths = rig.driver.face_width, rig.driven.face_width
        solid = None if layers is None else sweep(plane, widths, layers)
        progress.step("writing")
        write_mesh(out, solid or plane)
        return {"file": str(out)} | mesh_report(plane, solid)


def _contact(
    case: Case, name: str, out: Path, phase: float, torque_nm: float | None, dte_um: float | None, as_json: bool
) -> None:
    """The contact model for CalculiX, and what it should find."""
    from gearbench.bench.export.calculix import contact_model
    from gearbench.geometry.export.calculix import write_deck

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
    from gearbench.geometry.export.drawing import placed_gears, write_dxf, write_step

    gears = [gear for gear in placed_gears(rig) if which in ("both", gear.name.lower())]
    with Progress("mesh") as progress:
        progress.step("drawing")
        (write_dxf if out.suffix == ".dxf" else write_step)(out, gears)
    if as_json:
        print_json({"file": str(out), "gears": len(gears), "unit": "mm"})
    else:
        typer.echo(f"{out}: {' and '.join(gear.name.lower() for gear in gears)}, in mm")
